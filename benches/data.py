"""Does the data teach? And would we notice if it did not?

A vote of the 10 nearest training pairs (by pooled partial grid) completes shapes that it never saw. It learns from
pairs that graspmill made, and is tested on pairs of other objects from another renderer and another voxeliser: Embree's
depth, trimesh's surface samples and Embree's column crossings. The same learner then gets the same data with a fault
planted. Good data must beat every fault, by object, beyond chance, and test objects among the training pairs must look
better than they are; otherwise this check could not see such a fault and fails.

Numpy only (trimesh and embreex make the test pairs). Run by `make bench-data`; exit code 1 when a fault goes unseen.
`data_torch.py` makes the same test with a network.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from data_baselines import nearest, pooled
from data_faults import FAULTS, HOLLOWS_FILLED, Change, Fault, by_object, is_tested, jaccard, strata, unpack
from data_job import make_dataset
from data_neutral import neutral_pairs
from data_table import DATA, FAULT, LEAK, TRIVIAL, Row, Table

NEIGHBOURS = 10
TEST_VIEWS = 20
TRAINING_VIEWS = 80


def vote(neighbours: np.ndarray, complete: np.ndarray, partners: np.ndarray, change: Change) -> np.ndarray:
    """Majority of the complete grids that the neighbours were given, after `change`; (tests, N, N, N)."""
    votes = [change(unpack(complete[partners[row]])).sum(axis=0) > NEIGHBOURS / 2 for row in neighbours]
    return np.array(votes)


def exported(program: str, dataset: Path, out: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Arrays of all pairs, test objects' too: partials and completes, packed (pairs, bytes), objects, and which may train."""
    command = [program, "export", str(dataset), "--to", "npy", "--out", str(out)]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with open(out / "samples.csv", newline="") as table:
        samples = list(csv.DictReader(table))
    partial, complete = (np.load(out / f"{name}.npy") for name in ("partial", "complete"))
    assert len(partial) == len(complete) == len(samples), "the export's parts differ in length"
    objects, splits = (np.array([sample[column] for sample in samples]) for column in ("object", "split"))
    return partial, complete, objects, splits == "training"


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--graspmill", default="target/release/graspmill")
    arguments.add_argument("--scans", type=Path, default=Path(".deps/ycb"))
    options = arguments.parse_args()
    scans = [scan for scan in sorted(options.scans.glob("*.stl")) if is_tested(scan.name)]
    if not scans:
        print(f"{options.scans} holds no scans: make setup", file=sys.stderr)
        return 1
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        dataset = make_dataset(options.graspmill, scans, folder, TRAINING_VIEWS)
        partial, complete, objects, trains = exported(options.graspmill, dataset, folder / "npy")
    assert not set(objects[trains]) & {scan.stem for scan in scans}, "a test model trains"
    test = neutral_pairs(scans, TEST_VIEWS)
    print(f"{trains.sum()} training pairs, {len(test.partial)} neutral test pairs of {len(scans)} other objects\n")

    parts = np.array_split(partial, max(1, len(partial) // 500))
    features, queries = np.concatenate([pooled(unpack(part)) for part in parts]), pooled(test.partial)

    def scores(fault: Fault, rows: np.ndarray) -> np.ndarray:
        """By test object, of a vote of the nearest among those rows."""
        partners = rows[fault.partners(objects[rows], np.random.default_rng(0))]
        nearest_rows = nearest(queries, features[rows], NEIGHBOURS)
        return by_object(jaccard(vote(nearest_rows, complete, partners, fault.change), test.complete), test.objects)

    training = np.flatnonzero(trains)
    rows = [Row("as made", DATA, scores(Fault("as made"), training))]
    planted = [fault for fault in FAULTS if fault is not HOLLOWS_FILLED]
    rows += [Row(fault.name, FAULT, scores(fault, training), fault.stratum) for fault in planted]
    rows.append(Row("test objects in training", LEAK, scores(Fault("leak"), np.arange(len(objects)))))
    rows.append(Row("partial alone", TRIVIAL, by_object(jaccard(test.partial, test.complete), test.objects)))
    table = Table(rows, strata(test.solid_shares))
    unseen = table.untold(FAULT, LEAK)
    print(f"{table.text()}\n\n* differs beyond chance where it must\n{time.perf_counter() - began:.1f} s")
    if unseen:
        print(f"not told from good data: {', '.join(unseen)}", file=sys.stderr)
        return 1
    print("every planted fault is told from the data as made")
    return 0


if __name__ == "__main__":
    sys.exit(main())
