"""Views of a dataset against MuJoCo's rays: which body each pixel sees, and its depth.

    views_by_mujoco.py DATASET COUNT

Bodies are mesh geoms at the stored poses, in one model with container and table. Prints counts as JSON: pixels that differ, of these the ones
two pixels and more away from every edge of MuJoCo's own map, and the largest difference of depth there [m].
"""

import json
import sys

import graspmill
import mujoco
import numpy as np
from pixels import calm, directions

NOTHING, CONTAINER, TABLE = 0, 254, 255


def model_of(view, meshes):
    """The model of a scene, and the number of what each geom is."""
    spec = mujoco.MjSpec()
    numbers = []

    def add(number, **geom):
        spec.worldbody.add_geom(contype=0, conaffinity=0, **geom)
        numbers.append(number)

    for number, (digest, pose) in enumerate(zip(view.objects, view.world_from_object), 1):
        mesh = meshes[digest]
        spec.add_mesh(name=f"m{number}", uservert=mesh.vertices.astype(np.float64).ravel(), userface=mesh.triangles.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, pose[:3, :3].flatten())
        add(number, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"m{number}", pos=pose[:3, 3], quat=quaternion)
    kind, sizes = view.container
    floor, half = 0.0, np.asarray(view.table_size) / 2
    if kind == "bin":
        # The bins stand upright: a tilted one has one more number.
        x, y, z, wall = sizes
        floor = -wall
        box = mujoco.mjtGeom.mjGEOM_BOX
        add(CONTAINER, type=box, size=[x / 2 + wall, y / 2 + wall, wall / 2], pos=[0, 0, -wall / 2])
        for sign in (-1, 1):
            add(CONTAINER, type=box, size=[wall / 2, y / 2 + wall, (z + wall) / 2], pos=[sign * (x + wall) / 2, 0, (z - wall) / 2])
            add(CONTAINER, type=box, size=[x / 2 + wall, wall / 2, (z + wall) / 2], pos=[0, sign * (y + wall) / 2, (z - wall) / 2])
    add(TABLE, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[half[0], half[1], 1], pos=[0, 0, floor])
    return spec.compile(), numbers


def main():
    data = graspmill.Dataset(sys.argv[1], graspmill.ViewSample)
    meshes = {mesh.object: mesh for mesh in graspmill.object_meshes(sys.argv[1]).values()}
    result = {"views": 0, "pixels": 0, "differ": 0, "wrong": 0, "worst_depth": 0.0}
    for index in np.linspace(0, len(data) - 1, min(int(sys.argv[2]), len(data))).round().astype(int):
        view = data[int(index)]
        camera, pose = view.camera, view.world_from_camera
        model, numbers = model_of(view, meshes)
        state = mujoco.MjData(model)
        mujoco.mj_forward(model, state)
        rays = directions(camera, pose)
        geom = np.zeros(1, np.int32)
        seen, depth = np.zeros(len(rays), np.uint8), np.full(len(rays), np.nan)
        for ray, direction in enumerate(rays):
            length = np.linalg.norm(direction)
            distance = mujoco.mj_ray(model, state, pose[:3, 3], direction / length, None, 1, -1, geom)
            if distance >= 0:
                seen[ray], depth[ray] = numbers[geom[0]], distance / length
        seen, depth = seen.reshape(view.instances.shape), depth.reshape(view.instances.shape)
        differ = seen != view.instances
        result["views"] += 1
        result["pixels"] += differ.size
        result["differ"] += int(differ.sum())
        result["wrong"] += int((differ & calm(seen)).sum())
        inner = calm(seen) & ~differ & ~np.isnan(depth) & ~np.isnan(view.depth)
        result["worst_depth"] = max(result["worst_depth"], float(np.abs(view.depth - depth)[inner].max()))
    print(json.dumps(result))


main()
