"""Results of libigl and trimesh for the cases that tests/solid_oracles.rs leaves in a folder; one JSON line per case.

A case NAME is NAME.vertices (f32, xyz), NAME.triangles (u32), and NAME.words (u64, the solid grid); cases.json lists
{name, origin, pitch}. solid.py winding DIR STEP | volume DIR | distance DIR | rest DIR | binvox FILE...
"""

import json
import sys
from pathlib import Path

import numpy as np

SIDE = 256


def load(folder, name):
    vertices = np.fromfile(folder / f"{name}.vertices", "<f4").reshape(-1, 3).astype(float)
    triangles = np.fromfile(folder / f"{name}.triangles", "<u4").reshape(-1, 3).astype(np.int64)
    return vertices, triangles


def cases(folder):
    for case in json.loads((folder / "cases.json").read_text()):
        yield case, *load(folder, case["name"])


def winding(folder, step):
    """Insides on every STEP-th cell of each axis; cells within one pitch of the surface are counted apart."""
    import igl

    for case, vertices, triangles in cases(folder):
        bits = np.fromfile(folder / f"{case['name']}.words", "u1")
        grid = np.unpackbits(bits, bitorder="little").reshape(SIDE, SIDE, SIDE) > 0
        along = np.arange(step // 2, SIDE, step)
        cells = np.stack(np.meshgrid(along, along, along, indexing="ij"), -1).reshape(-1, 3)
        points = np.array(case["origin"]) + (cells + 0.5) * case["pitch"]
        number = igl.fast_winding_number(vertices, triangles, points)
        # The fast number is an approximation: where that could matter, the exact one decides.
        close = np.abs(np.abs(number) - 0.5) < 0.02
        if close.any():
            number[close] = igl.winding_number(vertices, triangles, points[close])
        theirs = np.abs(number) >= 0.5
        ours = grid[tuple(cells.T)]
        squared = igl.point_mesh_squared_distance(points, vertices, triangles)[0]
        band = squared <= case["pitch"] ** 2
        count = lambda where: {
            "cells": int(where.sum()),
            "both": int((ours & theirs & where).sum()),
            "either": int(((ours | theirs) & where).sum()),
        }
        # How far from one half the winding number is where the two differ: near it a surface with holes has no inside.
        unlike = np.abs(np.abs(number[(ours != theirs) & ~band]) - 0.5)
        doubt = float(unlike.max(initial=0.0))
        print(json.dumps({"name": case["name"], "outside_band": count(~band), "band": count(band), "doubt": doubt}))


def volume(folder):
    import trimesh

    for case, vertices, triangles in cases(folder):
        mesh = trimesh.Trimesh(vertices, triangles, process=False)
        facts = {"watertight": bool(mesh.is_watertight), "volume": float(mesh.volume), "area": float(mesh.area)}
        print(json.dumps({"name": case["name"], **facts}))


def distance(folder):
    """Distances of the points in NAME.points (f64, xyz) to the surface."""
    import igl

    for case, vertices, triangles in cases(folder):
        points = np.fromfile(folder / f"{case['name']}.points", "<f8").reshape(-1, 3)
        squared = igl.point_mesh_squared_distance(points, vertices, triangles)[0]
        print(json.dumps({"name": case["name"], "distances": np.sqrt(squared).tolist()}))


def resting(folder):
    """Stable poses about the centre of mass in NAME.points (f64, xyz): probability, and which way is up in the object."""
    import trimesh
    from trimesh.poses import compute_stable_poses

    for case, vertices, triangles in cases(folder):
        centre = np.fromfile(folder / f"{case['name']}.points", "<f8")
        mesh = trimesh.Trimesh(vertices, triangles, process=False)
        poses, probabilities = compute_stable_poses(mesh, center_mass=centre, sigma=0.0, n_samples=1)
        facts = {"probabilities": probabilities.tolist(), "ups": poses[:, 2, :3].tolist()}
        print(json.dumps({"name": case["name"], **facts}))


def binvox(paths):
    """Each file as trimesh reads it, as packed bits beside it (x slowest, z fastest)."""
    from trimesh.exchange.binvox import load_binvox

    for path in paths:
        with open(path, "rb") as file:
            voxels = load_binvox(file)
        np.packbits(voxels.matrix.reshape(-1), bitorder="little").tofile(f"{path}.bits")
        facts = {"shape": list(voxels.matrix.shape), "translation": voxels.transform[:3, 3].tolist()}
        print(json.dumps({"name": path, **facts}))


if __name__ == "__main__":
    what, *rest = sys.argv[1:]
    if what == "winding":
        winding(Path(rest[0]), int(rest[1]))
    elif what == "volume":
        volume(Path(rest[0]))
    elif what == "distance":
        distance(Path(rest[0]))
    elif what == "rest":
        resting(Path(rest[0]))
    elif what == "binvox":
        binvox(rest)
    else:
        sys.exit(__doc__)
