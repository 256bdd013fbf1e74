"""Does the data teach a network? And would we notice if it did not? The second tier of `make bench-data`.

A small 3D convolutional network (after Varley, DeChant, Richardson, Ruales and Allen 2017, scaled down) learns to
complete shapes from pairs of the training split, read by the Python package. It is tested on pairs of the split's test
models from another renderer and another voxeliser (`data_neutral.py`). The same network, with the same budget, first
weights and order, then learns from the same pairs with a fault planted. Good data must beat every fault, by object,
beyond chance. It is compared with completions that learn nothing. Leaked test objects show in the nearest training pair,
which must then look better than it is; the network is too small and sees too little to know them by heart.

Needs PyTorch; on the CPU alone, so that figures come again. Run by `make bench-data-torch`; exit code 1 when a fault
goes unseen.
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
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from torch import nn

from data_baselines import extruded, hull, mirrored, nearest_neighbour
from data_faults import FAULTS, Fault, by_object, is_tested, jaccard, strata, unpack
from data_job import make_dataset
from data_neutral import NeutralPairs, neutral_pairs
from data_table import DATA, FAULT, LEAK, TRIVIAL, Row, Table
from default_view import N

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill import CompletionSample, Dataset, PairBatch  # noqa: E402

# As made, then everything that can be wrong.
VARIANTS = (Fault("as made"), *FAULTS)
# Of the one cycle that the learning rate goes through.
PEAK_RATE = 1.5e-2

@dataclass(frozen=True)
class Budget:
    """Limits of what a run costs."""

    views: int
    """Views of each object of the dataset."""
    built_in: int
    """Built-in shapes beside the scans."""
    test_views: int
    """Views of each test object."""
    steps: int
    """Batches that each network learns from."""
    batch: int = 16
    seeds: int = 3


DEFAULT = Budget(views=40, built_in=48, test_views=16, steps=200)
FULL = Budget(views=80, built_in=96, test_views=20, steps=1000)


@dataclass(frozen=True)
class Pairs:
    """Pairs of a split as the package reads them."""

    partial: np.ndarray
    """uint8 (pairs, N^3 / 8)"""
    complete: np.ndarray
    """uint8 (pairs, N^3 / 8)"""
    objects: np.ndarray
    """Names, (pairs,)."""

    @classmethod
    def of(cls, folder: Path, split: str) -> Pairs:
        data = Dataset(folder, CompletionSample, split=split, channels=["pair"])
        batch = PairBatch.of(data.gather(range(len(data))))
        return cls(batch.partial, batch.complete, data.column("object"))

    def __add__(self, other: Pairs) -> Pairs:
        ours, theirs = vars(self).values(), vars(other).values()
        return Pairs(*(np.concatenate(both) for both in zip(ours, theirs)))


def to_blocks(grids: np.ndarray) -> torch.Tensor:
    """Bool (pairs, N, N, N) as floats (pairs, 10, 10, 10, 64): the cells of each 4^3 block side by side."""
    side = N // 4
    blocks = grids.reshape(-1, side, 4, side, 4, side, 4).transpose(0, 1, 3, 5, 2, 4, 6)
    return torch.from_numpy(blocks.reshape(-1, side, side, side, 64).astype(np.float32))


def from_blocks(blocks: np.ndarray) -> np.ndarray:
    """(pairs, 10, 10, 10, 64) as (pairs, N, N, N)."""
    side = N // 4
    return blocks.reshape(-1, side, side, side, 4, 4, 4).transpose(0, 1, 4, 2, 5, 3, 6).reshape(-1, N, N, N)


class Completion(nn.Module):
    """Logits of the complete grid from the partial, both in blocks: 40 cells a side to 10, 5, a dense middle, and back.

    The first and the last convolution have kernels as wide as their stride: on blocks, a matrix product.
    """

    def __init__(self, fine: int = 16, coarse: int = 32, middle: int = 128) -> None:
        super().__init__()
        self.enter = nn.Linear(64, fine)
        self.look = nn.Conv3d(fine, fine, 3, padding=1)
        self.down = nn.Conv3d(fine, coarse, 2, stride=2)
        self.dense = nn.Sequential(
            nn.Linear(coarse * 125, middle), nn.ReLU(), nn.Linear(middle, coarse * 125), nn.ReLU()
        )
        self.up = nn.ConvTranspose3d(coarse, fine, 2, stride=2)
        self.leave = nn.Linear(2 * fine, 64)
        # Most cells are empty: the first batches need not learn that.
        nn.init.constant_(self.leave.bias, -2.0)

    def forward(self, partial: torch.Tensor) -> torch.Tensor:
        """(batch, 10, 10, 10, 64) to the same shape."""
        fine = self.look(self.enter(partial).relu().movedim(-1, 1)).relu()
        coarse = self.down(fine).relu()
        coarse = self.dense(coarse.flatten(1)).reshape(coarse.shape)
        return self.leave(torch.cat([fine, self.up(coarse).relu()], dim=1).movedim(1, -1))


def learn(pairs: Pairs, fault: Fault, budget: Budget, seed: int) -> Completion:
    """A network trained on those pairs with that fault; first weights and order follow from the seed alone."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    partners = fault.partners(pairs.objects, np.random.default_rng(seed))
    network = Completion()
    optimiser = torch.optim.Adam(network.parameters(), fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, PEAK_RATE, total_steps=budget.steps)
    order = np.concatenate(
        [rng.permutation(len(pairs.objects)) for _ in range(budget.steps * budget.batch // len(pairs.objects) + 1)]
    )
    for step in range(budget.steps):
        rows = order[step * budget.batch : (step + 1) * budget.batch]
        partial, truth = unpack(pairs.partial[rows]), fault.change(unpack(pairs.complete[partners[rows]]))
        loss = nn.functional.binary_cross_entropy_with_logits(network(to_blocks(partial)), to_blocks(truth))
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
    return network.eval()


def completed(network: Completion, partial: np.ndarray) -> np.ndarray:
    """Cells that the network thinks more likely occupied than not; bool (pairs, N, N, N)."""
    with torch.no_grad():
        parts = np.array_split(partial, max(1, len(partial) // 64))
        return np.concatenate([from_blocks((network(to_blocks(part)) > 0).numpy()) for part in parts])


@dataclass(frozen=True)
class Bench:
    """What all networks learn from and are tested on."""

    training: Pairs
    leak: Pairs
    """Pairs of the test objects and their twins."""
    test: NeutralPairs
    budget: Budget

    def overlap(self, found: np.ndarray) -> np.ndarray:
        """Mean Jaccard overlap by test object of completions of the test pairs."""
        return by_object(jaccard(found, self.test.complete), self.test.objects)

    def learnt(self, variant: int, seed: int) -> np.ndarray:
        """The overlap of a network that learnt with one of `VARIANTS` and a seed."""
        network = learn(self.training, VARIANTS[variant], self.budget, seed)
        return self.overlap(completed(network, self.test.partial))


# In each process of the pool.
held: Bench


def hold(bench: Bench) -> None:
    global held
    held = bench
    torch.set_num_threads(1)


def learnt(task: tuple[int, int]) -> np.ndarray:
    return held.learnt(*task)


def learnt_rows(bench: Bench) -> list[Row]:
    """Every fault, every seed; one thread a network, as many at once as there are cores."""
    seeds = range(bench.budget.seeds)
    tasks = [(place, seed) for seed in seeds for place in range(len(VARIANTS))]
    of_task: dict[tuple[int, int], np.ndarray] = {}
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(len(os.sched_getaffinity(0)), spawn, hold, (bench,)) as pool:
        for task, found in zip(tasks, pool.map(learnt, tasks)):
            of_task[task] = found
            if sys.stderr.isatty():
                print(f"\r{len(of_task)} of {len(tasks)} networks trained", end="", file=sys.stderr, flush=True)
    mean = [np.mean([of_task[variant, seed] for seed in seeds], axis=0) for variant in range(len(VARIANTS))]
    good = Row(VARIANTS[0].name, DATA, mean[0])
    return [good, *(Row(fault.name, FAULT, found, fault.stratum) for fault, found in zip(FAULTS, mean[1:]))]


def unlearnt_rows(bench: Bench) -> list[Row]:
    """Trivial completions, and what a leak does to the last of them."""
    test, training = bench.test, bench.training
    all_pairs = training + bench.leak
    nearest = "nearest training pair"
    grids = {
        "partial alone": test.partial,
        "extruded along the rays": extruded(test.partial, test.eyes),
        "mirrored at the far end": mirrored(test.partial),
        "convex hull": hull(test.partial),
        nearest: nearest_neighbour(test.partial, training.partial, training.complete),
    }
    leaked = bench.overlap(nearest_neighbour(test.partial, all_pairs.partial, all_pairs.complete))
    rows = [Row(name, TRIVIAL, bench.overlap(found)) for name, found in grids.items()]
    return [*rows, Row("nearest, test objects leaked", LEAK, leaked, against=nearest)]


def verdict(table: Table) -> str:
    """Summary of the table: faults detected, the one nearest to good data with its interval, completions beaten."""
    unseen, unbeaten = table.untold(FAULT, LEAK), table.untold(TRIVIAL)
    planted = sum(row.kind in (FAULT, LEAK) for row in table.rows)
    trivial = sum(row.kind == TRIVIAL for row in table.rows)
    faults = f"{planted - len(unseen)} of {planted} planted faults are told from good data"
    others = f"good data beat {trivial - len(unbeaten)} of {trivial} trivial completions"
    closest = min((row for row in table.rows if row.kind == FAULT), key=lambda row: table.loss(row, row.stratum)[1])
    mean, low, high = table.loss(closest, closest.stratum)
    faults += f", nearest to it '{closest.name}' at {mean:+.3f} [{low:+.3f}, {high:+.3f}]"
    return "\n".join(
        sentence + (f"; not: {', '.join(names)}" if names else "")
        for sentence, names in ((faults, unseen), (others, unbeaten))
    )


def main() -> int:
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--graspmill", default="target/release/graspmill")
    arguments.add_argument("--scans", type=Path, default=Path(".deps/ycb"))
    arguments.add_argument("--full", action="store_true", help="twice the views, five times the batches")
    arguments.add_argument("--json", action="store_true")
    options = arguments.parse_args()
    test_scans = [scan for scan in sorted(options.scans.glob("*.stl")) if is_tested(scan.name)]
    if not test_scans:
        print(f"{options.scans} holds no scans: make setup", file=sys.stderr)
        return 1
    budget = FULL if options.full else DEFAULT
    began = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        dataset = make_dataset(options.graspmill, test_scans, Path(folder), budget.views, budget.built_in)
        training, leak = (Pairs.of(dataset, split) for split in ("training", "test"))
        root = Dataset(dataset).folder.root
    unseen = set(leak.objects.tolist())
    assert unseen >= {scan.stem for scan in test_scans} and not unseen & set(training.objects.tolist())
    bench = Bench(training, leak, neutral_pairs(test_scans, budget.test_views), budget)
    table = Table(learnt_rows(bench) + unlearnt_rows(bench), strata(bench.test.solid_shares))
    seconds = time.perf_counter() - began

    if options.json:
        facts = {
            "root": root,
            "budget": asdict(budget),
            "training_pairs": len(training.objects),
            "test_pairs": len(bench.test.objects),
            "test_objects": [scan.stem for scan in test_scans],
            "rows": table.facts(),
            "verdict": verdict(table).splitlines(),
            "seconds": round(seconds, 1),
        }
        print(json.dumps(facts, indent=2))
    else:
        test_pairs = f"{len(bench.test.objects)} neutral test pairs of {len(test_scans)} other objects"
        print(f"{len(training.objects)} training pairs, {test_pairs}")
        print(f"{budget.seeds} networks a row, {budget.steps} batches of {budget.batch} pairs each\n")
        print(f"{table.text()}\n\n* differs beyond chance where it must\n{verdict(table)}\n{seconds:.0f} s")
    return 1 if table.untold(FAULT, LEAK) else 0


if __name__ == "__main__":
    sys.exit(main())
