"""What both tiers of `make bench-data` share: who is tested on, faults to plant, and by how much scores differ.

Grids are bool (pairs, N, N, N), indexed x, y, z in camera axes (x right, y down, z away). Numpy only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from default_view import N

# Numbers of the scans that no training sees; a number is a family, held out whole (the ten cups are alike). Bowl, mug,
# lid, spoon, spatula, scissors, clamps and cups are among them, and seven solid shapes.
HELD_OUT = (
    *("005", "006", "015", "024", "025", "028", "031", "033", "035", "037"),
    *("050", "051", "052", "055", "061", "065", "077"),
)
# Of the cups, four sizes are enough to test on.
UNTESTED = tuple(f"065-{letter}" for letter in "bcefhi")
# An object is hollow or thin when less of its convex hull is solid.
SOLID_SHARE = 0.4

ALL, HOLLOW = "all", "hollow or thin"

Change = Callable[[np.ndarray], np.ndarray]
Partners = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def is_held_out(name: str) -> bool:
    """Whether a scan of this name (`025_mug`) must not be trained on."""
    return name.startswith(HELD_OUT)


def is_tested(name: str) -> bool:
    return is_held_out(name) and not name.startswith(UNTESTED)


def strata(solid_shares: np.ndarray) -> dict[str, np.ndarray]:
    """Which objects each stratum holds, as masks, by the share of its convex hull that each fills."""
    return {ALL: np.ones(len(solid_shares), bool), HOLLOW: solid_shares < SOLID_SHARE}


def unpack(packed: np.ndarray) -> np.ndarray:
    """Grids out of rows of bits as they are stored: uint8 (pairs, N^3 / 8)."""
    return np.unpackbits(packed, axis=1, bitorder="little", count=N**3).reshape(-1, N, N, N).astype(bool)


def of_others(objects: np.ndarray) -> np.ndarray:
    """For the object of each sample the row of a sample of another object, wherever there is one."""
    order = np.argsort(objects, kind="stable")
    # As far on as the object with most samples reaches: no sample is left with its own object.
    most = int(np.unique(objects, return_counts=True)[1].max())
    rows = np.empty(len(order), int)
    rows[order] = np.roll(order, most)
    return rows


def same(grids: np.ndarray) -> np.ndarray:
    return grids


def shifted(grids: np.ndarray, axis: int) -> np.ndarray:
    """One cell on along an axis; what leaves the grid is lost."""
    moved = np.roll(grids, 1, axis=axis)
    moved[(slice(None),) * axis + (0,)] = False
    return moved


def shell_of(grids: np.ndarray) -> np.ndarray:
    """Occupied cells with an empty neighbour."""
    padded = np.pad(grids, ((0, 0), (1, 1), (1, 1), (1, 1)))
    core = grids.copy()
    for axis in (1, 2, 3):
        for step in (-1, 1):
            core &= np.roll(padded, step, axis=axis)[:, 1:-1, 1:-1, 1:-1]
    return grids & ~core


def filled(grids: np.ndarray) -> np.ndarray:
    """Cells that lie between two occupied ones along any axis: a voxeliser that fills mugs."""
    solid = grids.copy()
    for axis in (1, 2, 3):
        before = np.logical_or.accumulate(grids, axis=axis)
        behind = np.flip(np.logical_or.accumulate(np.flip(grids, axis), axis=axis), axis)
        solid |= before & behind
    return solid


def own(objects: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return np.arange(len(objects))


def mixed_up(objects: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A fifth of the pairs get the complete grid of another such pair, of whatever object."""
    rows = np.arange(len(objects))
    wrong = rng.choice(len(rows), len(rows) // 5, replace=False)
    rows[wrong] = np.roll(wrong, 1)
    return rows


def of_another_view(objects: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Each pair gets the complete grid of another view of its object, where there is one."""
    rows = np.arange(len(objects))
    for name in np.unique(objects):
        mine = rng.permutation(np.flatnonzero(objects == name))
        rows[mine] = np.roll(mine, 1)
    return rows


@dataclass(frozen=True)
class Fault:
    """A way in which the complete grids of training data can be wrong."""

    name: str
    change: Change = same
    """The wrong grids out of right ones."""
    partners: Partners = own
    """(objects of the pairs, random numbers) -> the row whose complete grid each pair gets."""
    stratum: str = ALL
    """Where it must show."""


# A vote of neighbours cannot tell it: what it makes of thin walls is a blur either way.
HOLLOWS_FILLED = Fault("hollows filled in", filled, stratum=HOLLOW)
FAULTS = (
    Fault("truth one cell off in x", lambda grids: shifted(grids, 1)),
    Fault("truth one cell off in y", lambda grids: shifted(grids, 2)),
    Fault("truth one cell off in z", lambda grids: shifted(grids, 3)),
    Fault("x and y of the truth swapped", lambda grids: grids.transpose(0, 2, 1, 3)),
    Fault("truth mirrored", lambda grids: grids[:, ::-1]),
    Fault("truth of another view", partners=of_another_view),
    Fault("20 % of pairs mixed up", partners=mixed_up),
    Fault("shell instead of solid", shell_of),
    HOLLOWS_FILLED,
)


def jaccard(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cells in both over cells in either, 0 where there are none; (pairs,)."""
    both = (a & b).sum(axis=(1, 2, 3))
    either = (a | b).sum(axis=(1, 2, 3))
    return both / np.maximum(either, 1)


def by_object(scores: np.ndarray, objects: np.ndarray) -> np.ndarray:
    """Mean score of each object, in ascending order of their numbers; (objects,)."""
    return np.array([scores[objects == number].mean() for number in np.unique(objects)])


def interval(of_objects: np.ndarray, draws: int = 4000) -> tuple[float, float]:
    """95 % bootstrap interval of the mean over objects, resampling whole objects."""
    rows = np.random.default_rng(0).integers(len(of_objects), size=(draws, len(of_objects)))
    low, high = np.quantile(of_objects[rows].mean(axis=1), [0.025, 0.975])
    return float(low), float(high)
