"""Overlap of bodies that touch in settled scenes, by booleans of manifold3d, which is not ours.

    overlaps.py DATASET COUNT

Each mesh is welded and has to be a manifold for it; pairs with another mesh are counted. Prints JSON: scenes, pairs that touch, pairs that
could be cut, the largest and the middle overlap [mm3], and each pair above 10 mm3.
"""

import json
import sys

import graspmill
import manifold3d
import numpy as np


def manifold_of(mesh):
    """The solid of a mesh, or None where its triangles bound none."""
    points, numbers = np.unique(np.asarray(mesh.vertices, np.float64), axis=0, return_inverse=True)
    triangles = numbers.reshape(-1)[np.asarray(mesh.triangles)].astype(np.uint64)
    solid = manifold3d.Manifold(manifold3d.Mesh64(vert_properties=1e3 * points, tri_verts=triangles))
    return solid if solid.status() == manifold3d.Error.NoError and solid.volume() > 0 else None


def main():
    data = graspmill.Dataset(sys.argv[1], graspmill.SceneSample)
    solids = {mesh.object: manifold_of(mesh) for mesh in graspmill.object_meshes(sys.argv[1]).values()}
    found = {"scenes": 0, "pairs": 0, "cut": 0, "worst": 0.0, "median": 0.0, "above": []}
    overlaps = []
    for index in np.linspace(0, len(data) - 1, min(int(sys.argv[2]), len(data))).round().astype(int):
        scene = data[int(index)]
        found["scenes"] += 1
        for first, second in np.unique(scene.contacts.pairs, axis=0):
            if min(first, second) < 1:
                continue
            found["pairs"] += 1
            placed = []
            for body in (first, second):
                pose = scene.world_from_object[body - 1].copy()
                pose[:3, 3] *= 1e3
                solid = solids[scene.objects[body - 1]]
                placed.append(None if solid is None else solid.transform(pose[:3]))
            if None in placed:
                continue
            overlap = (placed[0] ^ placed[1]).volume()
            overlaps.append(overlap)
            if overlap > 10.0:
                found["above"].append([int(index), int(first), int(second), round(overlap, 3)])
    found["cut"] = len(overlaps)
    if overlaps:
        found["worst"], found["median"] = max(overlaps), float(np.median(overlaps))
    found["no_manifold"] = sum(solid is None for solid in solids.values())
    print(json.dumps(found))


main()
