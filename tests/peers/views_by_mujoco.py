"""Views of a dataset against MuJoCo's rays, or its renderer: which body each pixel sees, and by rays its depth.

    views_by_mujoco.py DATASET COUNT rays|renderer

Bodies are mesh geoms at the stored poses, in one model with container and table. Prints counts as JSON: pixels that differ, in all and in the
worst view, of these the ones two pixels and more away from every edge of MuJoCo's own map, and the largest difference of depth there [m].
The renderer needs EGL.
"""

import json
import os
import sys

os.environ.setdefault("MUJOCO_GL", "egl")

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
        # The bins are upright: a tilted one has one more number.
        x, y, z, wall = sizes
        floor = -wall
        box = mujoco.mjtGeom.mjGEOM_BOX
        add(CONTAINER, type=box, size=[x / 2 + wall, y / 2 + wall, wall / 2], pos=[0, 0, -wall / 2])
        for sign in (-1, 1):
            add(CONTAINER, type=box, size=[wall / 2, y / 2 + wall, (z + wall) / 2], pos=[sign * (x + wall) / 2, 0, (z - wall) / 2])
            add(CONTAINER, type=box, size=[x / 2 + wall, wall / 2, (z + wall) / 2], pos=[0, sign * (y + wall) / 2, (z - wall) / 2])
    add(TABLE, type=mujoco.mjtGeom.mjGEOM_PLANE, size=[half[0], half[1], 1], pos=[0, 0, floor])
    # One sample a pixel, at its centre, and nothing cut off near the camera.
    spec.visual.quality.offsamples = 0
    spec.visual.global_.offwidth, spec.visual.global_.offheight = view.camera.width, view.camera.height
    spec.stat.extent, spec.visual.map.znear, spec.visual.map.zfar = 1.0, 0.02, 20.0
    camera, pose = view.camera, view.world_from_camera
    assert camera.fx == camera.fy and 2 * camera.cx == camera.width and 2 * camera.cy == camera.height
    quaternion = np.zeros(4)
    # MuJoCo's cameras face their negative z, with y up.
    mujoco.mju_mat2Quat(quaternion, (pose[:3, :3] * [1, -1, -1]).flatten())
    spec.worldbody.add_camera(name="view", pos=pose[:3, 3], quat=quaternion, fovy=np.degrees(2 * np.arctan(camera.height / 2 / camera.fy)))
    return spec.compile(), numbers


def by_rays(model, state, numbers, view):
    """MuJoCo's rays: the body of each pixel, and its depth."""
    rays = directions(view.camera, view.world_from_camera)
    geom = np.zeros(1, np.int32)
    seen, depth = np.zeros(len(rays), np.uint8), np.full(len(rays), np.nan)
    for ray, direction in enumerate(rays):
        length = np.linalg.norm(direction)
        distance = mujoco.mj_ray(model, state, view.world_from_camera[:3, 3], direction / length, None, 1, -1, geom)
        if distance >= 0:
            seen[ray], depth[ray] = numbers[geom[0]], distance / length
    return seen.reshape(view.instances.shape), depth.reshape(view.instances.shape)


def by_renderer(model, state, numbers, view):
    """MuJoCo's renderer: the body of each pixel, without depth."""
    with mujoco.Renderer(model, view.camera.height, view.camera.width) as renderer:
        renderer.enable_segmentation_rendering()
        renderer.update_scene(state, camera="view")
        geoms = renderer.render()[..., 0]
    return np.array([*numbers, NOTHING], np.uint8)[geoms], None


def main():
    data = graspmill.Dataset(sys.argv[1], graspmill.ViewSample)
    meshes = {mesh.object: mesh for mesh in graspmill.object_meshes(sys.argv[1]).values()}
    result = {"views": 0, "pixels": 0, "differ": 0, "most": 0, "wrong": 0, "worst_depth": 0.0}
    for index in np.linspace(0, len(data) - 1, min(int(sys.argv[2]), len(data))).round().astype(int):
        view = data[int(index)]
        model, numbers = model_of(view, meshes)
        state = mujoco.MjData(model)
        mujoco.mj_forward(model, state)
        seen, depth = (by_renderer if sys.argv[3] == "renderer" else by_rays)(model, state, numbers, view)
        differ = seen != view.instances
        result["views"] += 1
        result["pixels"] += differ.size
        result["differ"] += int(differ.sum())
        result["most"] = max(result["most"], int(differ.sum()))
        result["wrong"] += int((differ & calm(seen)).sum())
        if depth is not None:
            inner = calm(seen) & ~differ & ~np.isnan(depth) & ~np.isnan(view.depth)
            result["worst_depth"] = max(result["worst_depth"], float(np.abs(view.depth - depth)[inner].max()))
    print(json.dumps(result))


main()
