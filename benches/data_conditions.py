"""Which data teaches a network to complete shapes under occlusion and noise? The third tier of `make bench-data`.

The network of `data_torch.py`, somewhat wider, learns from datasets of the same objects and views that differ in a few keys
of their jobs, from the partial grid alone or with the cells that the camera sees to be free beside it. Each is tested on
pairs of objects that none was trained on, made by Embree and trimesh (`data_neutral.py`) under four conditions: as they
are, with noise, behind an occluder, and both; noise and occluders are this file's own. Differences are paired by
object, with bootstrap intervals.

Needs PyTorch; on the CPU alone. Run by `make bench-data-conditions`.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
import trimesh
from torch import nn
from trimesh.ray.ray_pyembree import RayMeshIntersector

from data_faults import SOLID_SHARE, is_tested, unpack
from data_job import make_dataset
from data_neutral import NeutralObject, frame_of, marked
from data_torch import Completion, from_blocks, to_blocks
from default_view import ANCHOR, FOCAL, N, random_rotations

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill import CompletionSample, Dataset, PairBatch  # noqa: E402

OCCLUSION = "\n[occlusion]\n"
NOISE = '\n[sensor]\nprofile = "kinect-v1"\n'
# Keys of each dataset beside those that all have.
DATASETS = {"standard": "", "occlusion": OCCLUSION, "kinect-v1": NOISE, "kinect-v1, occlusion": NOISE + OCCLUSION}
# Dataset, and whether visibility is an input, too. The first is what the others are compared with.
ARMS = tuple((data, sees) for data in DATASETS for sees in (False, True))
CONDITIONS = ("clean", "noisy", "occluded", "both")
PEAK_RATE = 1e-2
# Disparity of the neutral sensor: focal length times baseline [px m], its step and its standard deviation [px].
DISPARITY, STEP, SPREAD = 44.0, 0.125, 0.08


@dataclass(frozen=True)
class Pairs:
    """Rows of bits, uint8 (pairs, N^3 / 8)."""

    partial: np.ndarray
    free: np.ndarray
    complete: np.ndarray
    objects: np.ndarray
    """Index of each pair's object, (pairs,)."""


class Conditions(NeutralObject):
    """A mesh that is seen with noise and behind occluders."""

    def pairs(self, rotation: np.ndarray, rng: np.random.Generator) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]] | None:
        """(partial, free, complete) under each condition; None when too little is seen under any."""
        points = self.depth(rotation)
        if len(points) < 50:
            return None
        occluder = self.occluder(points, rng)
        found = []
        for condition in CONDITIONS:
            hidden = condition in ("occluded", "both")
            seen = points
            if hidden:
                seen = points[~hits(occluder, points / points[:, 2:])]
            if condition in ("noisy", "both"):
                seen = noisy(seen, rng)
            pair = self.grids(rotation, seen, occluder if hidden else None)
            if pair is None:
                return None
            found.append(pair)
        return found

    def occluder(self, points: np.ndarray, rng: np.random.Generator) -> RayMeshIntersector:
        """A box or ball before the object that hides 10 to 50 % of its pixels: shifted until it does."""
        size = (points.max(axis=0) - points.min(axis=0))[:2].max()
        rays = points / points[:, 2:]
        while True:
            wanted = rng.uniform(0.1, 0.5)
            sides = size * rng.uniform(0.4, 1.6, 3)
            mesh = trimesh.creation.box(sides) if rng.random() < 0.5 else trimesh.creation.icosphere(2, sides[0] / 2)
            mesh.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
            depth = points[:, 2].min() - size * rng.uniform(0.1, 0.6) - np.linalg.norm(sides) / 2
            if depth - np.linalg.norm(sides) / 2 < 0.12:
                continue
            angle = rng.uniform(0, 2 * np.pi)
            centre = points.mean(axis=0) / points[:, 2].mean() * depth
            for way in np.linspace(2.0, 0.0, 41) * size:
                moved = mesh.copy()
                moved.apply_translation(centre + way * np.array([np.cos(angle), np.sin(angle), 0.0]))
                found = RayMeshIntersector(moved)
                share = hits(found, rays).mean()
                if abs(share - wanted) < 0.04 and 0.1 <= share <= 0.5:
                    return found

    def grids(
        self, rotation: np.ndarray, points: np.ndarray, occluder: RayMeshIntersector | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        if len(points) < 2:
            return None
        centre, cell = frame_of(points)
        partial = marked(points, centre, cell)
        if partial.sum() < 100:
            return None
        # A cell is free where the pixel of its centre sees something behind it, or nothing at all.
        image: dict[tuple[int, int], float] = {}
        for (u, v), z in zip(np.floor(FOCAL * points[:, :2] / points[:, 2:]).astype(int), points[:, 2]):
            image[int(u), int(v)] = z
        index = np.stack(np.meshgrid(*[np.arange(N)] * 3, indexing="ij"), -1).reshape(-1, 3)
        middles = (index + 0.5 - ANCHOR) * cell + centre
        pixels = np.floor(FOCAL * middles[:, :2] / middles[:, 2:]).astype(int)
        unique, back = np.unique(pixels, axis=0, return_inverse=True)
        ends = np.array([image.get((int(u), int(v)), np.inf) for u, v in unique])
        if occluder is not None:
            rays = np.concatenate([(unique + 0.5) / FOCAL, np.ones((len(unique), 1))], axis=1)
            # Nothing in the grid is in front of the occluder.
            ends[hits(occluder, rays)] = 0.0
        free = (ends[back.reshape(-1)] > middles[:, 2]).reshape(N, N, N) & ~partial
        return partial, free, self.complete(rotation, centre, cell)


def hits(occluder: RayMeshIntersector, rays: np.ndarray) -> np.ndarray:
    return occluder.intersects_any(np.zeros_like(rays), rays)


def noisy(points: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The points as a sensor has them: noise of the disparity over windows of 7 pixels, its steps, and lost edges."""
    pixels = np.floor(FOCAL * points[:, :2] / points[:, 2:]).astype(int)
    low = pixels.min(axis=0)
    shape = pixels.max(axis=0) - low + 1
    seen = np.zeros(shape + 2, bool)
    at = tuple((pixels - low + 1).T)
    seen[at] = True
    white = rng.normal(size=shape + 8)
    blurred = np.lib.stride_tricks.sliding_window_view(white, (7, 7)).sum(axis=(2, 3)) / 7
    disparity = DISPARITY / points[:, 2] + SPREAD * blurred[tuple((pixels - low).T)]
    depth = DISPARITY / (np.round(disparity / STEP) * STEP)
    inner = seen[2:, 1:-1] & seen[:-2, 1:-1] & seen[1:-1, 2:] & seen[1:-1, :-2]
    kept = inner[tuple((pixels - low).T)] | (rng.random(len(points)) < 0.5)
    return (points / points[:, 2:] * depth[:, None])[kept]


def pairs_of(scan: Path, seed: int, views: int) -> tuple[list, float]:
    rng = np.random.default_rng(1000 + seed)
    neutral = Conditions(scan, rng)
    found = []
    for rotation in random_rotations(rng, 3 * views):
        pairs = neutral.pairs(rotation, rng) if len(found) < views else None
        if pairs is not None:
            found.append([[np.packbits(grid.reshape(-1), bitorder="little") for grid in pair] for pair in pairs])
    return found, neutral.mesh.volume / neutral.mesh.convex_hull.volume


def neutral_pairs(scans: list[Path], views: int) -> tuple[list[Pairs], np.ndarray]:
    """Pairs under each condition, and each scan's share of its convex hull."""
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        pairs, shares = zip(*pool.map(pairs_of, scans, range(len(scans)), [views] * len(scans)))
    objects = np.repeat(np.arange(len(scans)), [len(of_scan) for of_scan in pairs])
    rows = np.array([pair for of_scan in pairs for pair in of_scan])
    return [Pairs(*(rows[:, condition, part] for part in range(3)), objects) for condition in range(4)], np.array(shares)


def read(folder: Path) -> Pairs:
    data = Dataset(folder, CompletionSample, split="training", channels=["pair", "visibility"])
    batch = PairBatch.of(data.gather(range(len(data))))
    assert batch.free is not None
    return Pairs(batch.partial, batch.free, batch.complete, np.zeros(len(data), int))


class Seeing(Completion):
    """The network, with or without the free cells as a second input."""

    def __init__(self, sees: bool) -> None:
        super().__init__(24, 48, 256)
        self.sees = sees
        if sees:
            self.enter = nn.Linear(128, 24)


def inputs(pairs: Pairs, rows: np.ndarray | slice, sees: bool) -> torch.Tensor:
    partial = to_blocks(unpack(pairs.partial[rows]))
    return torch.cat([partial, to_blocks(unpack(pairs.free[rows]))], dim=-1) if sees else partial


def learn(pairs: Pairs, sees: bool, steps: int, batch: int, seed: int) -> Seeing:
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    network = Seeing(sees)
    optimiser = torch.optim.Adam(network.parameters(), fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, PEAK_RATE, total_steps=steps)
    count = len(pairs.partial)
    order = np.concatenate([rng.permutation(count) for _ in range(steps * batch // count + 1)])
    for step in range(steps):
        rows = order[step * batch : (step + 1) * batch]
        truth = to_blocks(unpack(pairs.complete[rows]))
        loss = nn.functional.binary_cross_entropy_with_logits(network(inputs(pairs, rows, sees)), truth)
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
    return network.eval()


def completed(network: Seeing, test: Pairs, rows: slice) -> np.ndarray:
    with torch.no_grad():
        return from_blocks((network(inputs(test, rows, network.sees)) > 0).numpy())


class Neighbours:
    """No network: the vote of the ten training pairs whose inputs differ from a test pair's in the fewest cells."""

    def __init__(self, pairs: Pairs, sees: bool) -> None:
        self.pairs, self.sees = pairs, sees
        self.words = self.bits(pairs, slice(None))

    def bits(self, pairs: Pairs, rows: slice) -> np.ndarray:
        planes = [pairs.partial[rows], pairs.free[rows]] if self.sees else [pairs.partial[rows]]
        return np.ascontiguousarray(np.concatenate(planes, axis=1)).view(np.uint64)

    def completed(self, test: Pairs, rows: slice) -> np.ndarray:
        votes = []
        for words in self.bits(test, rows):
            unlike = np.bitwise_count(self.words ^ words).sum(axis=1, dtype=np.int64)
            nearest = np.argpartition(unlike, 10)[:10]
            votes.append(unpack(self.pairs.complete[nearest]).mean(axis=0) > 0.5)
        return np.array(votes)


def scores(learner: Seeing | Neighbours, test: Pairs, scans: int) -> np.ndarray:
    """Mean Jaccard overlap by object: of all cells, and of those that are not in the partial grid; (2, scans)."""
    values = []
    for first in range(0, len(test.partial), 64):
        rows = slice(first, first + 64)
        found = learner.completed(test, rows) if isinstance(learner, Neighbours) else completed(learner, test, rows)
        truth, partial = unpack(test.complete[rows]), unpack(test.partial[rows])
        of_pairs = []
        for within in (np.ones_like(partial), ~partial):
            both, either = (found & truth & within), ((found | truth) & within)
            of_pairs.append(both.sum(axis=(1, 2, 3)) / np.maximum(either.sum(axis=(1, 2, 3)), 1))
        values.append(np.array(of_pairs))
    by_pair = np.concatenate(values, axis=1)
    return np.array([by_pair[:, test.objects == scan].mean(axis=1) for scan in range(scans)]).T


def learnt(task: tuple[int, int]) -> tuple[tuple[int, int], np.ndarray]:
    """Scores of an arm and a seed: (conditions, 2, scans)."""
    arm, seed = task
    data, sees = ARMS[arm]
    pairs = held["training"][data]
    learner = learn(pairs, sees, held["steps"], held["batch"], seed) if held["steps"] else Neighbours(pairs, sees)
    return task, np.array([scores(learner, test, held["scans"]) for test in held["test"]])


held: dict = {}


def hold(everything: dict) -> None:
    held.update(everything)
    torch.set_num_threads(1)


def interval(differences: np.ndarray) -> tuple[float, float, float]:
    """Mean over objects, and its 95 % interval by 4,000 bootstraps."""
    rng = np.random.default_rng(0)
    means = differences[rng.integers(len(differences), size=(4000, len(differences)))].mean(axis=1)
    return float(differences.mean()), *(float(end) for end in np.quantile(means, [0.025, 0.975]))


def table(results: dict[tuple[int, int], np.ndarray], arms: list[int], shares: np.ndarray) -> list[str]:
    """Lines of a Markdown table: the first arm as it is, the others as differences to it."""
    def of_arm(arm: int) -> np.ndarray:
        return np.mean([found for (which, _), found in results.items() if which == arm], axis=0)
    thin = shares < SOLID_SHARE
    base = of_arm(arms[0])
    lines = ["| trained on | " + " | ".join(CONDITIONS) + " | both, unseen part | both, thin |", "| --- |" + " --- |" * 6]
    for arm in arms:
        data, sees = ARMS[arm]
        found = of_arm(arm)
        cells = [(condition, 0, np.ones(len(shares), bool)) for condition in range(4)]
        cells += [(3, 1, np.ones(len(shares), bool)), (3, 0, thin)]
        words = []
        for condition, part, within in cells:
            mean, low, high = interval((found - (base if arm != arms[0] else 0))[condition, part, within])
            words.append(f"{mean:.3f}" if arm == arms[0] else f"{mean:+.3f} [{low:+.3f}, {high:+.3f}]")
        lines.append(f"| {data}{' + visibility' if sees else ''} | " + " | ".join(words) + " |")
    return lines


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--graspmill", default="target/release/graspmill")
    arguments.add_argument("--scans", type=Path, default=Path(".deps/ycb"))
    arguments.add_argument("--views", type=int, default=80, help="of each training object")
    arguments.add_argument("--built-in", type=int, default=48)
    arguments.add_argument("--test-views", type=int, default=6)
    arguments.add_argument("--steps", type=int, default=800, help="0: no network, the vote of the nearest pairs")
    arguments.add_argument("--batch", type=int, default=32)
    arguments.add_argument("--seeds", type=int, default=2)
    arguments.add_argument("--arms", help="indices, by commas; without it all")
    arguments.add_argument("--json", type=Path, help="results, written after every network")
    options = arguments.parse_args()
    arms = [int(arm) for arm in options.arms.split(",")] if options.arms else list(range(len(ARMS)))
    test_scans = [scan for scan in sorted(options.scans.glob("*.stl")) if is_tested(scan.name)]
    if not test_scans:
        print(f"{options.scans} holds no scans: make setup", file=sys.stderr)
        return 1
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        training = {}
        for data in {ARMS[arm][0] for arm in arms}:
            own = Path(folder) / data.replace(", ", "-")
            own.mkdir()
            made = make_dataset(
                options.graspmill, test_scans, own, options.views, options.built_in, DATASETS[data], visibility=True
            )
            training[data] = read(made)
    test, shares = neutral_pairs(test_scans, options.test_views)
    print(f"{len(test[0].partial)} test pairs of {len(shares)} objects per condition", file=sys.stderr)
    print({data: len(pairs.partial) for data, pairs in training.items()}, file=sys.stderr, flush=True)
    everything = {
        "training": training, "test": test, "steps": options.steps, "batch": options.batch, "scans": len(shares)
    }
    tasks = [(arm, seed) for seed in range(options.seeds) for arm in arms]
    results: dict[tuple[int, int], np.ndarray] = {}
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), spawn, hold, (everything,)) as pool:
        for task, found in pool.map(learnt, tasks):
            results[task] = found
            print(task, [round(float(value), 3) for value in found[:, 0].mean(axis=1)], file=sys.stderr, flush=True)
            if options.json:
                rows = [{"arm": arm, "seed": seed, "scores": found.tolist()} for (arm, seed), found in results.items()]
                options.json.write_text(json.dumps({"arms": ARMS, "shares": shares.tolist(), "rows": rows}))
    print("\n".join(table(results, arms, shares)))
    print(f"{options.seeds} networks an arm, {options.steps} batches of {options.batch}; {time.perf_counter() - began:.0f} s")
    return 0


if __name__ == "__main__":
    sys.exit(main())
