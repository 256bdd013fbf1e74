"""A hand that explores bodies in clutter against MuJoCo's kinematics and libigl: what it touched, what stopped it, what it passes through.

    hand_in_clutter.py PAIRS VIEWS HAND

MuJoCo places the solids of the hand by the recorded joint values; points of their surfaces are measured by libigl against the true meshes of
the body and of its neighbours, against boxes of our own for the container, and by their height over the table. Prints counts as JSON.
"""

import json
import sys

import graspmill
import igl
import mujoco
import numpy as np
import trimesh
from amodal import moved
from pixels import walls_of

CONTAINER, TABLE = 254, 255
AT_REST, TIMED_OUT, BLOCKED = 0, 1, 5


class Hand:
    """Points of a hand's solids, about 2 mm apart, in their geoms' frames."""

    def __init__(self, path):
        self.model = mujoco.MjModel.from_xml_path(path)
        self.data = mujoco.MjData(self.model)
        kinds = mujoco.mjtGeom
        self.points = {}
        for geom in range(self.model.ngeom):
            if not self.model.geom_contype[geom] | self.model.geom_conaffinity[geom]:
                continue
            size, kind = self.model.geom_size[geom], self.model.geom_type[geom]
            if kind == kinds.mjGEOM_BOX:
                solid = trimesh.creation.box(2 * size)
            elif kind == kinds.mjGEOM_CAPSULE:
                solid = trimesh.creation.capsule(2 * size[1], size[0])
                solid.apply_translation(-solid.bounds.mean(0))
            elif kind == kinds.mjGEOM_CYLINDER:
                solid = trimesh.creation.cylinder(size[0], 2 * size[1])
            else:
                solid = trimesh.creation.icosphere(3, size[0])
            count = int(solid.area / 0.002**2) + 1
            self.points[geom] = trimesh.sample.sample_surface(solid, count, seed=1)[0]

    def placed(self, joints, values):
        """Points in the base's frame."""
        for name, value in zip(joints, values):
            self.data.qpos[self.model.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(self.model, self.data)
        return np.concatenate(
            [at @ self.data.geom_xmat[geom].reshape(3, 3).T + self.data.geom_xpos[geom] for geom, at in self.points.items()]
        )


def signed(mesh, points):
    """Signed distances, negative inside of a closed mesh."""
    distance = np.sqrt(igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)[0])
    inside = igl.winding_number(mesh.vertices, mesh.faces, points) > 0.5 if mesh.is_watertight else np.zeros(len(points), bool)
    return np.where(inside, -distance, distance)


def main():
    data = graspmill.Dataset(sys.argv[1], graspmill.AmodalSample)
    views = graspmill.Dataset(sys.argv[2], graspmill.ViewSample)
    hand = Hand(sys.argv[3])
    by_id = {(view.id.subject, view.id.item): place for place, view in enumerate(views)}
    meshes = {
        mesh.object: trimesh.Trimesh(mesh.vertices.astype(float), mesh.triangles, process=False)
        for mesh in graspmill.object_meshes(sys.argv[2]).values()
    }
    names = ("pairs", "approaches", "contacts", "blocked", "at_rest", "blocked_approaches", "inside_at_start")
    result = dict.fromkeys(names, 0) | {"worst_contact": 0.0, "worst_stop": 0.0, "farthest_block": 0.0, "deepest": 0.0}
    for sample in data:
        pair, touch = sample.pair, sample.touch["touch_exploration"]
        view = views[by_id[pair.sample.subject, pair.sample.item]]
        world = pair.world_from_camera
        parts, table = walls_of(view)

        def apart(number, points, view=view, world=world, parts=parts, table=table):
            """Signed distances of points in the camera's frame from a thing."""
            if number == TABLE:
                return moved(points, world)[:, 2] - table
            if number == CONTAINER:
                return np.min([signed(part, moved(points, world)) for part in parts], 0)
            pose = np.linalg.inv(view.world_from_object[number - 1]) @ world
            return signed(meshes[view.objects[number - 1]], moved(points, pose))

        own = sample.id.instance
        result["pairs"] += 1
        result["approaches"] += touch.probes
        result["contacts"] += len(touch.probe)
        result["blocked"] += len(touch.blocked_probe)
        if len(touch.probe):
            worst = np.abs(apart(own, touch.positions.astype(float))).max()
            result["worst_contact"] = max(result["worst_contact"], float(worst))
        others = [number for number in range(1, len(view.objects) + 1) if number != own] + [TABLE]
        others += [CONTAINER] if parts else []
        for probe in range(touch.probes):
            points = moved(hand.placed(touch.joints, touch.joint_values[probe]), touch.camera_from_hand[probe])
            end = touch.ends[probe]
            rows = np.nonzero(touch.blocked_probe == probe)[0]
            if end == BLOCKED:
                result["blocked_approaches"] += 1
                assert len(rows) > 0
            for row in rows:
                by, at = int(touch.blocked_by[row]), touch.blocked_positions[row : row + 1].astype(float)
                distance = float(apart(by, at)[0])
                nearest = float(apart(by, points).min())
                # The hand began in it.
                if end == BLOCKED and nearest < -0.001:
                    result["inside_at_start"] += 1
                    continue
                result["worst_stop"] = max(result["worst_stop"], abs(distance))
                result["farthest_block"] = max(result["farthest_block"], nearest)
            if end in (AT_REST, TIMED_OUT):
                result["at_rest"] += 1
                deepest = min(float(apart(number, points).min()) for number in others)
                result["deepest"] = max(result["deepest"], -deepest)
    print(json.dumps(result))


main()
