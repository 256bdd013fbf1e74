"""The trainer on samples with a fault: `study_fault.py FAULT` and the arguments of `python -m graspmill.train`.

A network that learns from wrong data must be worse; where it is not, the test could not tell. Used by study.py.
"""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
import graspmill  # noqa: E402
from graspmill.train import data  # noqa: E402
from graspmill.train.__main__ import main  # noqa: E402
from graspmill.train.recipe import Recipe  # noqa: E402
from graspmill.train.sources import Arrays  # noqa: E402

TARGETS = ("occupancy", "coverage")

# The images of the pairs, by the folder that the pairs lie in: a set writes both side by side.
VIEWS = "views"


def neighbours_left_in(arrays: Arrays, samples: Sequence[Any]) -> None:
    """Cells in which the image shows other bodies count as seen of this one."""
    others = np.stack([sample.clutter.others_seen for sample in samples])
    arrays["partial"] |= others
    if "free" in arrays:
        arrays["free"] &= ~others


def masks_off(arrays: Arrays, samples: Sequence[Any]) -> None:
    """The mask of each body lies a pixel too far to the right and as much too low: it loses depths and gains others'."""
    for row, sample in enumerate(samples):
        image, pair = image_of(sample), sample.pair
        mask = np.roll(image.point_instances == sample.clutter.instance, (1, 1), axis=(0, 1))
        mask[0], mask[:, 0] = False, False
        partial = seen_cells(image, pair.grid, mask)
        arrays["partial"][row] = partial
        if "free" in arrays:
            arrays["free"][row] &= ~partial


def seen_cells(image: Any, grid: Any, mask: np.ndarray) -> np.ndarray:
    """Cells that hold a depth of these pixels: (n, n, n)."""
    seen = np.zeros((grid.resolution,) * 3, np.bool_)
    cells = grid.cells(image.points_of(mask))
    x, y, z = cells[((cells >= 0) & (cells < grid.resolution)).all(axis=1)].T
    seen[x, y, z] = True
    return seen


views: dict[Path, graspmill.Dataset[Any]] = {}


def image_of(sample: Any) -> Any:
    """The image that a pair in clutter was cut from."""
    folder = Path(sample.layout.folder).parent / VIEWS
    if folder not in views:
        views[folder] = graspmill.Dataset(folder)
    place = views[folder].index_of(dataclasses.replace(sample.pair.sample, instance=0))
    if place is None:
        raise SystemExit(f"{folder} lacks the image of {sample.pair.sample}")
    return views[folder][place]


def another_body(arrays: Arrays, samples: Sequence[Any]) -> None:
    """Each sample's solid is that of the one before it."""
    for name in TARGETS:
        if name in arrays:
            arrays[name] = np.roll(arrays[name], 1, axis=0)


def shifted(arrays: Arrays, samples: Sequence[Any]) -> None:
    """Each solid lies two cells to the right."""
    for name in TARGETS:
        if name in arrays:
            arrays[name] = np.roll(arrays[name], 2, axis=1)


FAULTS: dict[str, Callable[[Arrays, Sequence[Any]], None]] = {
    "neighbours left in": neighbours_left_in,
    "masks a pixel off": masks_off,
    "another body": another_body,
    "shifted": shifted,
}


def planted(fault: Callable[[Arrays, Sequence[Any]], None]) -> Callable[..., Arrays]:
    whole = data.arrays_of

    def arrays_of(samples: Sequence[Any], recipe: Recipe) -> Arrays:
        arrays = whole(samples, recipe)
        fault(arrays, samples)
        return arrays

    return arrays_of


if __name__ == "__main__":
    data.arrays_of = planted(FAULTS[sys.argv[1]])
    sys.exit(main(sys.argv[2:]))
