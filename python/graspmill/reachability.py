"""Samples of reachability datasets: one position with all its orientations."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .geometry import Floats
from .samples import Sample, as_array, content, expect_lengths

LABELS = ("no_solution", "colliding", "reachable")
"""Name of each label: no joint values reach the pose, all of them collide, reachable."""
PROOFS = ("bound", "interval_ends", "swept", "searched", "witness")
"""Name of each proof of a label."""


class ReachabilitySample(Sample):
    """Labels of the cells of one position, C order over (roll, pitch, yaw) or (direction, roll)."""

    product = "reachability"
    __slots__ = ()

    @content
    def labels(self) -> npt.NDArray[np.uint8]:
        """(orientations,) indices into ``LABELS``."""
        return as_array(self.message("block")["labels"], "u1", -1)

    @content
    def proofs(self) -> npt.NDArray[np.uint8]:
        """(orientations,) indices into ``PROOFS``."""
        return as_array(self.message("block")["proofs"], "u1", -1)

    @content
    def witnesses(self) -> Floats:
        """(reachable cells, joints) rad or m: joint values of each cell with label 2, in the order of the cells."""
        message = self.message("block")
        found: Floats = message["witnesses"].reshape(-1, message["joints"])
        expect_lengths(int(np.count_nonzero(self.labels == 2)), witnesses=found)
        return found
