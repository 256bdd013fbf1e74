"""Distances of a hand's solids from the meshes of a scene, by coal.

question.json: {"meshes": [{"vertices", "triangles", "pose"}], "solids": [{"half", "round", "thickness"}]}, poses by rows of
three times four; poses: rows of f64, for each pose of the hand one pose of each solid. A solid is a box, or the cylinder in it about
z, thickened. Writes distances: f64, for each pose of the hand one of each mesh [m], the least of all solids, at most 0 where one
overlaps it; where a solid meets no triangle but its middle lies in the mesh, -1 mm. Farther than 2 cm a lower bound is written.

passage.py FOLDER
"""

import json
import sys
from pathlib import Path

import coal
import numpy as np
import trimesh

# Distances beyond this are not needed [m].
FAR = 0.02

# How deep a solid is that lies wholly in a mesh [m].
INSIDE = 0.001


def transform(rows):
    rows = np.asarray(rows, dtype=float).reshape(3, 4)
    return coal.Transform3s(rows[:, :3], rows[:, 3])


def model_of(vertices, triangles):
    corners = vertices[triangles]
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(corners), 3 * len(corners))
    for triangle in corners:
        model.addTriangle(*triangle)
    model.endModel()
    return model


def solid_of(half, is_round, thickness):
    """A shape, and by how much its surface lies inside the solid's: coal thickens no box among triangles itself."""
    if max(half) == 0.0:
        return coal.Sphere(thickness), 0.0
    if half[0] == 0.0 and half[1] == 0.0:
        return coal.Capsule(thickness, 2 * half[2]), 0.0
    return coal.Cylinder(half[0], 2 * half[2]) if is_round else coal.Box(*(2 * side for side in half)), thickness


def main(folder):
    folder = Path(folder)
    question = json.loads((folder / "question.json").read_text())
    meshes = []
    for mesh in question["meshes"]:
        vertices = np.array(mesh["vertices"], dtype=float)
        triangles = np.array(mesh["triangles"])
        meshes.append((model_of(vertices, triangles), transform(mesh["pose"]), trimesh.Trimesh(vertices, triangles, process=False)))
    solids = [solid_of(solid["half"], solid["round"], solid["thickness"]) for solid in question["solids"]]
    thickness = np.array([solid["thickness"] for solid in question["solids"]])
    reach = thickness + [np.linalg.norm(solid["half"]) for solid in question["solids"]]
    poses = np.fromfile(folder / "poses", dtype="<f8").reshape(-1, len(solids), 12)
    found = np.empty((len(poses), len(meshes)))
    for index, (model, scene_from_mesh, mesh) in enumerate(meshes):
        rotation, origin = np.array(scene_from_mesh.getRotation()), np.array(scene_from_mesh.getTranslation())
        middles = (poses.reshape(-1, 3, 4)[:, :, 3] - origin) @ rotation
        near = np.all((middles > mesh.bounds[0]) & (middles < mesh.bounds[1]), axis=1)
        inside = np.zeros(len(middles), dtype=bool)
        if near.any():
            inside[near] = mesh.contains(middles[near])
        inside = inside.reshape(len(poses), len(solids))
        outside = np.maximum(np.maximum(mesh.bounds[0] - middles, middles - mesh.bounds[1]), 0.0)
        bounds = np.linalg.norm(outside, axis=1).reshape(len(poses), len(solids)) - reach
        for number, placed in enumerate(poses):
            least = np.inf
            for solid, pose in enumerate(placed):
                if bounds[number, solid] > FAR:
                    least = min(least, bounds[number, solid])
                    continue
                request, result = coal.DistanceRequest(), coal.DistanceResult()
                shape, inside_by = solids[solid]
                distance = coal.distance(shape, transform(pose), model, scene_from_mesh, request, result) - inside_by
                if distance > 0 and inside[number, solid]:
                    distance = -INSIDE
                least = min(least, distance)
            found[number, index] = least
    found.astype("<f8").tofile(folder / "distances")
    print(json.dumps({"poses": len(poses), "meshes": len(meshes)}))


if __name__ == "__main__":
    main(sys.argv[1])
