"""Touch of bodies in clutter against Embree, MuJoCo and libigl: every ray is sent again among the meshes of its scene.

    touch_in_clutter.py PAIRS VIEWS

Rays start as specified in docs/format.md. Embree finds what each meets first among the triangles of the body, of the other bodies and of boxes
of our own for the container; libigl's winding numbers show whether it starts inside of something, heights whether below the table. MuJoCo's
rays run from each contact to the camera, past the body itself and everything else. Prints counts as JSON.
"""

import json
import sys

import graspmill
import igl
import mujoco
import numpy as np
import trimesh
from amodal import moved
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from pixels import walls_of

CONTAINER, TABLE = 254, 255
# Room behind the box, and what a contact has to be clear of [m].
ROOM, CLEARANCE = 1e-3, 1e-6
AWAY = np.array([0.0, 0.0, 1.0])


class Thing:
    """Triangles in a frame of their own."""

    def __init__(self, vertices, faces, is_closed):
        self.vertices = np.ascontiguousarray(vertices, np.float64)
        self.faces = np.ascontiguousarray(faces, np.int64)
        self.is_closed = is_closed
        self.embree = rtcore_scene.EmbreeScene(robust=True)
        TriangleMesh(self.embree, self.vertices[self.faces].astype(np.float32))
        spec = mujoco.MjSpec()
        asset = spec.add_mesh(name="m", uservert=self.vertices.ravel().tolist(), userface=self.faces.ravel().tolist())
        asset.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="m", contype=0, conaffinity=0)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)

    def first(self, starts, direction):
        """Distance of the first hit of each ray, infinite for none."""
        found = self.embree.run(starts.astype(np.float32), np.tile(direction, (len(starts), 1)).astype(np.float32), output=1)
        return np.where(found["primID"] >= 0, found["tfar"].astype(np.float64), np.inf)

    def holds(self, points):
        """Whether each point is inside; never of an open surface."""
        if not self.is_closed:
            return np.zeros(len(points), bool)
        return igl.winding_number(self.vertices, self.faces, points) > 0.5

    def hides(self, start, way, length):
        geom, normal = np.zeros(1, np.int32), np.zeros(3)
        distance = mujoco.mj_ray(self.model, self.data, start, way, None, 1, -1, geom, normal)
        return 0 <= distance <= length


def things_of(view, pair, meshes, boxes):
    """Number, thing, and the thing's frame from the camera's, of everything but the table."""
    world_from_camera = pair.world_from_camera
    found = [
        (number, meshes[digest], np.linalg.inv(pose) @ world_from_camera)
        for number, (digest, pose) in enumerate(zip(view.objects, view.world_from_object), 1)
    ]
    return found + [(CONTAINER, box, world_from_camera) for box in boxes]


def rays_of(touch, far):
    """Probe, (x, y), and of each whether it has a contact, what blocked it (0: nothing) and where it ended along z."""
    rows = [(int(p), *at[:2], True, 0, at[2]) for p, at in zip(touch.probe, touch.positions.astype(float))]
    blocked = zip(touch.blocked_probe, touch.blocked_by, touch.blocked_positions.astype(float))
    rows += [(int(p), *at[:2], False, int(by), at[2]) for p, by, at in blocked]
    rest = sorted(set(range(touch.probes)) - {row[0] for row in rows})
    assert len(rest) == len(touch.misses)
    rows += [(p, *at[:2], False, 0, np.nan) for p, at in zip(rest, touch.misses.astype(float))]
    assert np.all(np.abs(touch.misses[:, 2] - far) < 1e-5)
    return sorted(rows)


def check_rays(result, touch, instance, things, world_from_camera, table):
    own, own_from_camera = next((thing, pose) for number, thing, pose in things if number == instance)
    depths = moved(own.vertices, np.linalg.inv(own_from_camera))[:, 2]
    near, far = depths.min(), depths.max()
    rows = rays_of(touch, far)
    starts = np.array([[x, y, far + ROOM] for _, x, y, *_ in rows])
    ends = np.full(len(rows), np.inf)
    by = np.zeros(len(rows), int)
    inside = moved(starts, world_from_camera)[:, 2] < table
    ends[inside], by[inside] = 0.0, TABLE
    close = np.zeros(len(rows), bool)
    for number, thing, pose in things:
        local, direction = moved(starts, pose), pose[:3, :3] @ -AWAY
        # The body itself is met from clear of its box: a flat back lies on the plane from which rays are counted.
        behind = 0.01 if number == instance else 0.0
        distance = thing.first(local - behind * direction, direction) - behind
        if number != instance:
            distance = np.where(thing.holds(local), 0.0, distance)
        close |= np.abs(distance - ends) < 1e-5
        nearer = (distance < ends) | ((distance == ends) & (number < by))
        ends, by = np.where(nearer, distance, ends), np.where(nearer, number, by)
    missed = ends > far - near + ROOM
    by[missed] = 0
    close |= np.abs(ends - (far - near + ROOM)) < 1e-5
    for row, (_, _, _, touched, blocked_by, z) in enumerate(rows):
        expected = by[row] == instance, by[row] if by[row] != instance else 0
        result["rays"] += 1
        result["blocked"] += int(blocked_by > 0)
        result["blocked_by_bodies"] += int(0 < blocked_by < CONTAINER)
        result["blocked_by_container"] += int(blocked_by == CONTAINER)
        if (touched, blocked_by) != expected:
            result["unlike" if not close[row] else "at_edges"] += 1
        elif touched or blocked_by:
            result["worst_end"] = max(result["worst_end"], abs(starts[row, 2] - ends[row] - z))


def check_sight(result, touch, things, world_from_camera, table):
    """``table``: half its sides, and its height."""
    for point, visible in zip(touch.positions.astype(float), touch.visible):
        length = np.linalg.norm(point)
        way = -point / length
        start = point + way * CLEARANCE
        hidden = any(
            thing.hides(pose[:3, :3] @ start + pose[:3, 3], pose[:3, :3] @ way, length - CLEARANCE) for _, thing, pose in things
        )
        start, way = moved(start, world_from_camera), world_from_camera[:3, :3] @ way
        reach = (table[2] - start[2]) / way[2] if way[2] != 0 else -1.0
        hidden |= 0 <= reach <= length - CLEARANCE and bool((np.abs(start + reach * way)[:2] <= table[:2]).all())
        result["contacts"] += 1
        result["visible"] += int(visible)
        result["visible_unlike"] += int(hidden == visible)


def main():
    data = graspmill.Dataset(sys.argv[1], graspmill.AmodalSample)
    views = graspmill.Dataset(sys.argv[2], graspmill.ViewSample)
    by_id = {(view.id.subject, view.id.item): place for place, view in enumerate(views)}
    closed = {row["object"]: row["watertight"] for row in data.folder.objects()}
    meshes = {
        mesh.object: Thing(mesh.vertices, mesh.triangles, closed[mesh.object]) for mesh in graspmill.object_meshes(sys.argv[2]).values()
    }
    names = ("pairs", "rays", "blocked", "blocked_by_bodies", "blocked_by_container", "contacts", "visible")
    result = dict.fromkeys(names + ("unlike", "at_edges", "visible_unlike", "cells_unlike"), 0) | {"worst_end": 0.0}
    for sample in data:
        pair, clutter, touch = sample.pair, sample.clutter, sample.touch["touch_rays"]
        view = views[by_id[pair.sample.subject, pair.sample.item]]
        parts, table = walls_of(view)
        boxes = [Thing(part.vertices, part.faces, True) for part in parts]
        things = things_of(view, pair, meshes, boxes)
        check_rays(result, touch, clutter.instance, things, pair.world_from_camera, table)
        check_sight(result, touch, things, pair.world_from_camera, np.append(view.table_size / 2, table))
        grid, n = pair.grid, sample.resolution
        index = np.floor((touch.positions.astype(float) - np.asarray(grid.lower_corner)) / grid.cell_size).astype(int)
        within = ((index >= 0) & (index < n)).all(1)
        expected = np.where(within, (index[:, 0] * n + index[:, 1]) * n + index[:, 2], n**3)
        result["cells_unlike"] += int((expected != touch.cells.astype(int)).sum())
        result["pairs"] += 1
    print(json.dumps(result))


main()
