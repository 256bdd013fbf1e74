"""Reads a dataset with random-ray touch and compares every ray with MuJoCo, Embree and libigl.

touch.py DATASET SCANS. Each ray is sent again from its recorded start: by mj_ray and by Embree in the
mesh's frame; a mj_ray runs from each contact to the camera; points are compared with the mesh by libigl's distances and winding
numbers, cells with the text of docs/format.md. Prints one JSON object.
"""

import json
import sys
from pathlib import Path

import igl
import mujoco
import numpy as np
import trimesh
from embreex import rtcore_scene
from embreex.mesh_construction import TriangleMesh
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

data, scans = Path(sys.argv[1]), Path(sys.argv[2])
assets = {row["object"]: row for row in json.loads((data / "assets.json").read_text())["objects"]}
AWAY = np.array([0.0, 0.0, 1.0])
# Rays start this far behind their recorded start: some surfaces are exactly on the plane [m].
BEHIND = 0.01
CLEARANCE = 1e-6
BINS = [0.5, 1, 2, 4]


class Scan:
    def __init__(self, name):
        mesh = trimesh.load(scans / f"{name}.stl")
        # As the program repairs them: all faces on the same three vertices are removed.
        keys = np.sort(mesh.faces, axis=1)
        _, place, count = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
        self.vertices = np.ascontiguousarray(mesh.vertices, np.float64)
        self.faces = np.ascontiguousarray(mesh.faces[count[place.ravel()] == 1], np.int64)
        spec = mujoco.MjSpec()
        asset = spec.add_mesh(name="m", uservert=self.vertices.ravel().tolist(), userface=self.faces.ravel().tolist())
        asset.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="m", contype=0, conaffinity=0)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        mujoco.mj_forward(self.model, self.data)
        self.embree = rtcore_scene.EmbreeScene(robust=True)
        TriangleMesh(self.embree, self.vertices[self.faces].astype(np.float32))

    def ray(self, start, direction):
        """Distance, -1 for none, and normal by mj_ray."""
        geom, normal = np.zeros(1, np.int32), np.zeros(3)
        distance = mujoco.mj_ray(self.model, self.data, start, direction, None, 1, -1, geom, normal)
        return distance, normal


meshes = {}
facts = dict.fromkeys(
    ["pairs", "rays", "contacts", "visible", "outside", "cells", "cells_in_partial", "cells_outside_complete"], 0
)
facts |= dict.fromkeys(["hits_unlike_mujoco", "hits_unlike_embree", "visible_unlike", "cells_unlike", "inside_out"], 0)
facts["watertight"] = {"contacts": 0, "visible": 0}
apart = {name: [] for name in ["mujoco", "embree", "mesh", "normal_mujoco", "normal_embree", "unit"]}
# By local thickness [cells]: contacts, visible ones, those in a seen cell.
thin = np.zeros((len(BINS) + 1, 3), int)


def triples(data):
    return np.frombuffer(data, "<f4").reshape(-1, 3).astype(np.float64)


def plane(bits, n):
    return np.unpackbits(np.frombuffer(bits, np.uint8), bitorder="little", count=n**3) > 0


def check(pair, touch):
    name = assets[pair.sample.subject.hex()]["name"]
    if name not in meshes:
        meshes[name] = Scan(name)
    scan, n = meshes[name], pair.grid.resolution
    assert touch.resolution == n and touch.sample.SerializeToString() == pair.sample.SerializeToString()
    positions, normals, misses = triples(touch.positions), triples(touch.normals), triples(touch.misses)
    distances, visible = np.frombuffer(touch.distances, "<f4"), np.frombuffer(touch.visible, np.uint8) > 0
    probe, cells = np.array(touch.probe, int), np.array(touch.cells, int)
    assert len(probe) + len(misses) == touch.probes and (np.diff(probe) > 0).all()
    pose = np.array(pair.camera_from_object).reshape(3, 4)
    to_object, turn = (lambda p: (p - pose[:, 3]) @ pose[:, :3]), (lambda v: v @ pose[:, :3])

    starts = np.concatenate([positions + distances[:, None] * AWAY, misses])
    starts = to_object(starts + BEHIND * AWAY)
    towards = turn(-AWAY)
    direct = np.tile(towards, (len(starts), 1))
    embree = scan.embree.run(starts.astype(np.float32), direct.astype(np.float32), output=1)
    for row, start in enumerate(starts):
        distance, normal = scan.ray(start, towards)
        touched = row < len(positions)
        facts["rays"] += 1
        facts["hits_unlike_mujoco"] += int((distance >= 0) != touched)
        facts["hits_unlike_embree"] += int((embree["primID"][row] >= 0) != touched)
        if not touched:
            continue
        if distance >= 0:
            apart["mujoco"].append(abs(distance - BEHIND - distances[row]))
            apart["normal_mujoco"].append(1 - abs(turn(normals[row]) @ normal))
        if embree["primID"][row] >= 0:
            apart["embree"].append(abs(embree["tfar"][row] - BEHIND - distances[row]))
            ng = np.array([embree["Ng"][row]]).ravel()
            apart["normal_embree"].append(1 - abs(turn(normals[row]) @ ng) / max(np.linalg.norm(ng), 1e-30))
    if len(positions) == 0:
        return
    points, outward = to_object(positions), turn(normals)
    apart["unit"].extend(abs(np.linalg.norm(normals, axis=1) - 1))
    apart["mesh"].extend(np.sqrt(igl.point_mesh_squared_distance(points, scan.vertices, scan.faces)[0]))
    camera = to_object(np.zeros(3))
    anchor, low = np.array([0.5, 0.5, 0.45]) * n, np.array([pair.grid.centre_x, pair.grid.centre_y, pair.grid.centre_z])
    index = np.floor((positions - low) / pair.grid.cell_size + anchor).astype(int)
    inside = ((index >= 0) & (index < n)).all(axis=1)
    expected = np.where(inside, (index[:, 0] * n + index[:, 1]) * n + index[:, 2], n**3)
    facts["cells_unlike"] += int((expected != cells).sum())
    facts["outside"] += int((~inside).sum())
    assert touch.outside == (~inside).sum()
    partial, complete = plane(pair.partial, n), plane(pair.complete, n)
    tactile = np.zeros(n**3 + 1, bool)
    tactile[cells] = True
    tactile = tactile[:-1]
    facts["cells"] += int(tactile.sum())
    facts["cells_in_partial"] += int((tactile & partial).sum())
    facts["cells_outside_complete"] += int((tactile & ~complete).sum())
    watertight = assets[pair.sample.subject.hex()]["watertight"]
    for point, normal, seen, cell in zip(points, outward, visible, cells):
        way = camera - point
        length = np.linalg.norm(way)
        blocked, _ = scan.ray(point + way / length * CLEARANCE, way / length)
        facts["visible_unlike"] += int((blocked < 0 or blocked > length) != seen)
        thickness, _ = scan.ray(point - normal * CLEARANCE, -normal)
        place = np.searchsorted(BINS, thickness / pair.grid.cell_size) if thickness >= 0 else len(BINS)
        thin[place] += [1, seen, cell < n**3 and partial[cell]]
    if watertight:
        facts["watertight"]["contacts"] += len(points)
        facts["watertight"]["visible"] += int(visible.sum())
        step = 2e-6
        sides = igl.winding_number(scan.vertices, scan.faces, np.concatenate([points + step * outward, points - step * outward]))
        facts["inside_out"] += int(((sides[: len(points)] > 0.5) | (sides[len(points) :] < 0.5)).sum())
    facts["pairs"] += 1
    facts["contacts"] += len(points)
    facts["visible"] += int(visible.sum())


for shard in sorted((data / "shards").glob("*.mcap")):
    with shard.open("rb") as file:
        pair = None
        for _, channel, _, record in make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages():
            if channel.topic == "/completion/pair":
                pair = record
            elif channel.topic == "/completion/touch_rays":
                check(pair, record)

for name, values in apart.items():
    values = np.sort(np.array(values))
    at = lambda share: float(values[int((len(values) - 1) * share)])
    facts[name] = {"median": at(0.5), "p999": at(0.999), "max": at(1.0)}
facts["thickness"] = [
    {"below_cells": bound, "contacts": int(c), "visible": int(v), "in_partial": int(p)}
    for bound, (c, v, p) in zip([*BINS, "any"], thin)
]
print(json.dumps(facts))
