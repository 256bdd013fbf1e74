"""Views of a dataset against Embree: which body each pixel sees, every silhouette alone, and depth, by rays of another library.

    views.py DATASET COUNT

Casts a ray through every pixel centre against the meshes of `shapes.mcap`, body by body and all together, with container and table
made here. A pixel counts as wrong when the two see different bodies although no edge is near: the four neighbours of Embree's own map are
alike, and the two nearest surfaces there differ by more than 1e-5 m. Prints counts as JSON.
"""

import json
import sys

import graspmill
import numpy as np
import trimesh
from pixels import FAR, NOTHING, calm, depth_of, fixed_meshes


def main():
    data = graspmill.Dataset(sys.argv[1], graspmill.ViewSample)
    meshes = {
        mesh.object: trimesh.Trimesh(mesh.vertices, mesh.triangles, process=False)
        for mesh in graspmill.object_meshes(sys.argv[1]).values()
    }
    count = min(int(sys.argv[2]), len(data))
    result = {"views": 0, "pixels": 0, "differ": 0, "wrong": 0, "mask_differ": 0, "mask_wrong": 0, "worst_depth": 0.0}
    for index in np.linspace(0, len(data) - 1, count).round().astype(int):
        view = data[int(index)]
        camera, pose = view.camera, view.world_from_camera
        numbers, layers = [], []
        for number, (digest, world_from_object) in enumerate(zip(view.objects, view.world_from_object), 1):
            placed = meshes[digest].copy()
            placed.apply_transform(world_from_object)
            alone = depth_of(placed, camera, pose)
            mask = view.mask(number)
            hit = alone < FAR
            result["mask_differ"] += int((mask != hit).sum())
            result["mask_wrong"] += int(((mask != hit) & calm(hit)).sum())
            numbers.append(number)
            layers.append(alone)
        for number, mesh in fixed_meshes(view):
            numbers.append(number)
            layers.append(depth_of(mesh, camera, pose))
        layers = np.stack(layers)
        order = np.argsort(layers, axis=0, kind="stable")
        nearest = np.take_along_axis(layers, order[:1], 0)[0]
        second = np.take_along_axis(layers, order[1:2], 0)[0]
        expected = np.where(nearest < FAR, np.asarray(numbers)[order[0]], NOTHING)
        differ = expected != view.instances
        apart = second - nearest > 1e-5
        result["views"] += 1
        result["pixels"] += differ.size
        result["differ"] += int(differ.sum())
        result["wrong"] += int((differ & calm(expected) & apart).sum())
        inner = calm(expected) & ~differ & (nearest < FAR) & ~np.isnan(view.depth)
        result["worst_depth"] = max(result["worst_depth"], float(np.abs(view.depth - nearest)[inner].max()))
    print(json.dumps(result))


main()
