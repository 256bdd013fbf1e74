"""Reads a dataset with the format's own library and holds every pair against docs/format.md and the meshes.

audit.py DATASET SCANS. Depth to points, points to the mesh's frame by the stored pose, distance to the mesh by libigl;
points to the grid by the words of the format, in numpy. Prints one JSON object.
"""

import json
import sys
from pathlib import Path

import igl
import numpy as np
import trimesh
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

data, scans = Path(sys.argv[1]), Path(sys.argv[2])
names = {row["object"]: row["name"] for row in json.loads((data / "assets.json").read_text())["objects"]}
meshes = {}


def mesh_of(subject):
    name = names[subject.hex()]
    if name not in meshes:
        mesh = trimesh.load(scans / f"{name}.stl")
        meshes[name] = np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)
    return meshes[name]


def plane(bits, n):
    return np.unpackbits(np.frombuffer(bits, np.uint8), bitorder="little", count=n**3).reshape(n, n, n) > 0


def points_of(depth, camera):
    z = np.frombuffer(depth.data, "<f4").reshape(depth.height, depth.width).astype(np.float64)
    row, column = np.nonzero(np.isfinite(z))
    z = z[row, column]
    x = (column + depth.left + 0.5 - camera.cx) / camera.fx * z
    y = (row + depth.top + 0.5 - camera.cy) / camera.fy * z
    return np.stack([x, y, z], axis=1)


facts = {"pairs": 0, "points": 0, "worst_distance": 0.0, "worst_placement": 0.0, "partials_unlike": 0, "partials_outside": 0}
cells = []
for shard in sorted((data / "shards").glob("*.mcap")):
    with shard.open("rb") as file:
        pairs, depths = {}, {}
        for _, channel, message, record in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            kinds = {"/completion/pair": pairs, "/completion/depth": depths}
            if channel.topic in kinds:
                kinds[channel.topic][message.log_time] = record
    for place, pair in pairs.items():
        n, points = pair.grid.resolution, points_of(depths[place], pair.camera)
        pose = np.array(pair.camera_from_object).reshape(3, 4)
        in_object = (points - pose[:, 3]) @ pose[:, :3]
        squared = igl.point_mesh_squared_distance(in_object, *mesh_of(pair.sample.subject))[0]
        low, high = points.min(axis=0), points.max(axis=0)
        centre, cell = (low + high) / 2, (high - low).max() / (0.8 * n)
        stored = np.array([pair.grid.centre_x, pair.grid.centre_y, pair.grid.centre_z])
        index = np.floor((points - stored) / pair.grid.cell_size + np.array([0.5, 0.5, 0.45]) * n).astype(int)
        index = index[((index >= 0) & (index < n)).all(axis=1)]
        expected = np.zeros((n, n, n), bool)
        expected[tuple(index.T)] = True
        partial, complete = plane(pair.partial, n), plane(pair.complete, n)
        facts["pairs"] += 1
        facts["points"] += len(points)
        facts["worst_distance"] = max(facts["worst_distance"], float(np.sqrt(squared.max())))
        placement = max(float(abs(stored - centre).max()), abs(pair.grid.cell_size - cell))
        facts["worst_placement"] = max(facts["worst_placement"], placement)
        facts["partials_unlike"] += int((partial != expected).any())
        facts["partials_outside"] += int((partial & ~complete).any())
        cells.append([int(partial.sum()), int((partial & complete).sum())])
print(json.dumps({**facts, "cells": cells}))
