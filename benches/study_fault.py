"""The trainer on samples with a fault: `study_fault.py FAULT` and the arguments of `python -m graspmill.train`.

A network that learns from wrong data must be worse; where it is not, the test could not tell. Used by study.py.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
from graspmill.train import data  # noqa: E402
from graspmill.train.__main__ import main  # noqa: E402
from graspmill.train.recipe import Recipe  # noqa: E402
from graspmill.train.sources import Arrays  # noqa: E402

TARGETS = ("occupancy", "coverage")


def neighbours_left_in(arrays: Arrays, samples: Sequence[Any]) -> None:
    """Cells in which the image shows other bodies count as seen of this one."""
    others = np.stack([sample.clutter.others_seen for sample in samples])
    arrays["partial"] |= others
    if "free" in arrays:
        arrays["free"] &= ~others


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
