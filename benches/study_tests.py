"""The tests of a study: pairs of datasets, or pairs that graspmill had no part in, as rows of bits.

Tests of a study are tables `[[tests]]`:

    name = "other objects"       of the rows
    data = ["clean"]             datasets of the study
    split = "test"               training, holdout, validation or test
    objects = 14                 of this training subset alone; all without it
    per_object = 12              largest number of samples of each object, evenly taken
    change = "touch of others"   what is done to the inputs: see CHANGES; nothing without it

    name = "noisy"               or: pairs by Embree and trimesh, with noise and an occluder of their own
    neutral = "noisy"            clean, noisy, occluded or both, of data_conditions.py
    views = 6                    of each of its objects
"""

from __future__ import annotations

import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from data_faults import SOLID_SHARE, is_tested, of_others, unpack
from default_view import N

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill import AmodalSample, CompletionSample, Dataset  # noqa: E402
from graspmill.completion import TOUCH  # noqa: E402
from graspmill.train.sources import objects_of  # noqa: E402

# An object is hollow or thin when less than half of the volume of its occupied cells is solid.
SOLID = 0.5
# Solids of two samples are the same shape when their cells overlap by this much.
SAME = 0.95
# Touched cells of a sample at most, as many as rays are sent.
CONTACTS = 40
PLANES = ("partial", "free", "touch", "occupancy")
SHARE = "share"


@dataclass(frozen=True)
class Samples:
    """The samples of a test, one row each."""

    bits: dict[str, np.ndarray]
    """The known ones of `PLANES`: uint8 (samples, N^3 / 8)."""
    objects: np.ndarray
    """Name or digest of each sample's object."""
    thin: np.ndarray
    """bool (samples,): whether the object is hollow or thin."""
    hidden: np.ndarray
    """(samples,) share of the silhouette that something else hides, 0 to 1."""
    share: np.ndarray | None = None
    """uint8 (samples, N, N, N): share of each cell that is solid, of 255, where it is known."""

    def cells(self, plane: str, rows: slice | list[int]) -> np.ndarray:
        """bool (samples, N, N, N)."""
        return unpack(self.bits[plane][rows])

    def twins(self) -> list[np.ndarray]:
        """For each sample the others whose seen cells are the same and whose true cells overlap its own by less than `SAME`:
        their numbers."""
        _, group = np.unique(self.bits["partial"], axis=0, return_inverse=True)
        found = []
        for row, mine in enumerate(group.reshape(-1)):
            alike = np.flatnonzero(group.reshape(-1) == mine)
            truth, truths = self.cells("occupancy", [row]), self.cells("occupancy", alike.tolist())
            both, either = (truth & truths).sum(axis=(1, 2, 3)), (truth | truths).sum(axis=(1, 2, 3))
            found.append(alike[both < SAME * either])
        return found

    def end_on(self) -> np.ndarray:
        """(samples,) extent of the true cells along the optical axis over the larger one across it."""
        found = []
        for row in range(len(self.objects)):
            x, y, z = np.nonzero(self.cells("occupancy", slice(row, row + 1))[0])
            sides = [int(np.ptp(axis)) + 1 if len(axis) else 1 for axis in (x, y, z)]
            found.append(sides[2] / max(sides[0], sides[1]))
        return np.array(found)

    def save(self, path: Path) -> None:
        facts = {"objects": self.objects, "thin": self.thin, "hidden": self.hidden} | self.bits
        if self.share is not None:
            facts[SHARE] = self.share
        np.savez_compressed(path, **facts)  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> Samples:
        with np.load(path) as stored:
            bits = {plane: stored[plane] for plane in PLANES if plane in stored}
            share = stored[SHARE] if SHARE in stored else None
            return cls(bits, stored["objects"], stored["thin"], stored["hidden"], share)


def packed(cells: np.ndarray) -> np.ndarray:
    return np.packbits(cells.reshape(len(cells), -1), axis=1, bitorder="little")


def hidden_share(sample: CompletionSample) -> float:
    if isinstance(sample, AmodalSample):
        return 1 - sample.clutter.visible_share
    return sample.occlusion.hidden_share if sample.has("occlusion") else 0.0


def of_datasets(folders: list[Path], split: str, subset: int | None, per_object: int) -> Samples:
    """Samples of a split, evenly taken from each object of each dataset."""
    planes: dict[str, list[np.ndarray]] = {plane: [] for plane in PLANES}
    names, hidden, solid = [], [], []
    shares: list[np.ndarray] = []
    for folder in folders:
        data: Dataset[Any] = Dataset(folder, split=split, subset=subset)
        # Objects are cheap to look up but for those of bodies of scenes, each of which names its own.
        scenes = data.kind is AmodalSample
        every = objects_of(data, list(data) if scenes else [], range(len(data)))
        of_each = np.array(every)
        places = []
        for name in np.unique(of_each):
            mine = np.flatnonzero(of_each == name)
            places += mine[np.linspace(0, len(mine) - 1, min(per_object, len(mine))).round().astype(int)].tolist()
        samples = data.gather(places)
        names += of_each[places].tolist()
        hidden += [hidden_share(sample) for sample in samples]
        for sample in samples:
            planes["partial"].append(sample.partial)
            planes["occupancy"].append(sample.complete)
            planes["free"] += [sample.free] if sample.has("visibility") else []
            planes["touch"] += [sample.tactile] if any(map(sample.has, TOUCH)) else []
            coverage = sample.coverage if sample.has("coverage") else None
            shares += [] if coverage is None else [coverage]
            solid.append(np.inf if coverage is None else coverage.sum(dtype=np.int64) / 255)
    objects = np.array(names)
    cells = np.array([grid.sum() for grid in planes["occupancy"]])
    thin = np.zeros(len(objects), bool)
    for name in np.unique(objects):
        mine = objects == name
        thin[mine] = np.array(solid)[mine].sum() < SOLID * cells[mine].sum()
    bits = {plane: packed(np.array(grids)) for plane, grids in planes.items() if len(grids) == len(objects)}
    return Samples(bits, objects, thin, np.array(hidden), np.array(shares) if len(shares) == len(objects) else None)


def neutral_pairs_of(scan: Path, seed: int, views: int) -> tuple[list[list[list[np.ndarray]]], float]:
    """`views` views of a scan under each condition of data_conditions.py, each as rows of its planes and the share of
    each cell that is solid; and the scan's share of its convex hull."""
    from data_conditions import CONDITIONS, Conditions
    from data_neutral import frame_of
    from default_view import random_rotations

    class Shared(Conditions):
        """Grids with the share of each cell that is solid."""

        def grids(self, rotation: np.ndarray, points: np.ndarray, occluder: Any) -> Any:
            found = super().grids(rotation, points, occluder)
            return found and (*found, self.share(rotation, *frame_of(points)))

    rng = np.random.default_rng(1000 + seed)
    seen = Shared(scan, rng)
    found: list[list[list[np.ndarray]]] = []
    for rotation in random_rotations(rng, 3 * views):
        pairs = seen.pairs(rotation, rng) if len(found) < views else None
        if pairs is not None:
            rows = [[*(packed(grid[None])[0] for grid in pair[:3]), to_bytes(pair[3])] for pair in pairs]
            assert len(rows) == len(CONDITIONS)
            found.append(rows)
    return found, float(seen.mesh.volume / seen.mesh.convex_hull.volume)


def to_bytes(share: np.ndarray) -> np.ndarray:
    return np.round(np.clip(share, 0, 1) * 255).astype(np.uint8)


def neutral(scans: Path, views: int) -> dict[str, Samples]:
    """Pairs of held out scans under each condition of data_conditions.py, by Embree and trimesh."""
    from data_conditions import CONDITIONS

    held_out = [scan for scan in sorted(scans.glob("*.stl")) if is_tested(scan.name)]
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        found = list(pool.map(neutral_pairs_of, held_out, range(len(held_out)), [views] * len(held_out)))
    names = np.array([scan.stem for scan, (pairs, _) in zip(held_out, found) for _ in pairs])
    thin = np.array([share < SOLID_SHARE for pairs, share in found for _ in pairs])
    tests = {}
    for number, condition in enumerate(CONDITIONS):
        columns = list(zip(*(pair[number] for pairs, _ in found for pair in pairs)))
        planes = {plane: np.array(column) for plane, column in zip(("partial", "free", "occupancy", SHARE), columns)}
        share = planes.pop(SHARE)
        tests[condition] = Samples(planes, names, thin, np.zeros(len(names)), share)
    return tests


def seen_again(test: Samples) -> np.ndarray:
    """Touched cells that are seen cells of the same sample: as many more points of what is visible."""
    rng = np.random.default_rng(0)
    found = []
    for row in range(len(test.objects)):
        seen = np.flatnonzero(test.cells("partial", slice(row, row + 1)).reshape(-1))
        cells = np.zeros(N**3, bool)
        cells[rng.permutation(seen)[:CONTACTS]] = True
        found.append(cells.reshape(N, N, N))
    return packed(np.array(found))


def changed(test: Samples, change: str) -> Samples:
    """The test with other inputs than its own."""
    bits = dict(test.bits)
    if change == "touch of others":
        bits["touch"] = bits["touch"][of_others(test.objects)]
    elif change == "touch of what is seen":
        bits["touch"] = seen_again(test)
    elif change == "no touch":
        bits["touch"] = np.zeros_like(bits["touch"])
    elif change == "free of others":
        bits["free"] = bits["free"][of_others(test.objects)]
    elif change:
        raise ValueError(f"no change is called {change!r}")
    return replace(test, bits=bits)


def tests_of(tables: list[dict[str, Any]], folders: dict[str, Path], scans: Path, kept: Path) -> dict[str, Samples]:
    """The tests of a study by name; made once and kept in a folder."""
    kept.mkdir(parents=True, exist_ok=True)
    missing = [table for table in tables if not (kept / f"{table['name']}.npz").exists()]
    if any("neutral" in table for table in missing):
        views = max(table.get("views", 6) for table in missing if "neutral" in table)
        pairs = neutral(scans, views)
    for table in missing:
        if "neutral" in table:
            test = pairs[table["neutral"]]
        else:
            known = Dataset(folders[table["data"][0]]).folder.splits()["training_subsets"]
            subset = known.index(table["objects"]) if "objects" in table else None
            of = [folders[name] for name in table["data"]]
            test = of_datasets(of, table["split"], subset, table.get("per_object", 12))
        changed(test, table.get("change", "")).save(kept / f"{table['name']}.npz")
    return {table["name"]: Samples.load(kept / f"{table['name']}.npz") for table in tables}
