"""Samples of suction: poses of a suction cup on one body of a settled scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from .geometry import Floats, poses
from .picks import PICK_OBSTACLES
from .samples import as_array, content, expect_lengths
from .settled import BodySample

SUCTION_RESULTS = ("free", "blocked", "weak", "leaking")
"""Results of poses, by the numbers of ``results``."""
SEAL_LIMITS = ("surface", "stroke", "flex", "stretch", "bulge", "hole", "curvature")
"""Limits of a seal, by the numbers of ``seal_limits``."""
SUCTION_STRENGTHS = ("pull", "shear", "torsion", "tilt")
"""Strengths of a cup, by the numbers of ``strengths``; 255 where it leaks."""
SURFACE_MEASURES = (
    "seat",
    "compression",
    "spread",
    "slope_x",
    "slope_y",
    "flex",
    "stretch",
    "bulge",
    "hole",
    "curvature_low",
    "curvature_high",
)
"""Columns of ``surfaces``: lengths in m, curvatures in 1/m, slopes and stretch without a unit."""


@dataclass(frozen=True)
class CupMeasures:
    """Measures of a suction cup [m]."""

    radius: float
    """Of the circle along which the lip seals."""
    outer_radius: float
    """Of the lip."""
    height: float
    """Of the relaxed cup."""
    tube_radius: float
    """Of the tube behind the cup."""
    tube_length: float
    """Of that tube."""


class SuctionSample(BodySample):
    """Poses of a suction cup on one body of a settled scene. Bodies are numbered from 1, in the order of the scene; poses are rows of
    arrays, in drawn order."""

    product = "suction"
    main = "poses"
    __slots__ = ()

    @content
    def mass(self) -> float:
        """Mass of the body [kg]."""
        return float(self.message("poses")["mass"])

    @content
    def centre_of_mass(self) -> Floats:
        """(3,) centre of mass of the body, in the object's frame [m]."""
        found: Floats = self.message("poses")["centre_of_mass"]
        expect_lengths(3, centre_of_mass=found)
        return found

    @content
    def cup(self) -> CupMeasures:
        """Measures of the cup."""
        found = self.message("poses")["cup"]
        expect_lengths(5, cup=found)
        return CupMeasures(*found.tolist())

    @content
    def margin(self) -> float:
        """Distance that cup and tube keep from everything except the body [m]."""
        return float(self.message("poses")["margin"])

    @content
    def counts(self) -> dict[str, Any]:
        """Poses by result: ``drawn`` is the sum of ``tilted``, ``leaking`` (by limit), ``weak`` (by strength), ``alike``, ``blocked``
        (by obstacle) and ``free``."""
        message = self.message("poses")
        found: dict[str, Any] = {name: int(message[name]) for name in ("drawn", "tilted", "alike", "free")}
        for name, reasons in (("leaking", SEAL_LIMITS), ("weak", SUCTION_STRENGTHS), ("blocked", PICK_OBSTACLES[1:])):
            numbers = np.asarray(message[name]).tolist()
            expect_lengths(len(reasons), **{name: numbers})
            found[name] = dict(zip(reasons, numbers))
        return found

    @content
    def numbers(self) -> npt.NDArray[np.uint32]:
        """(poses,) number of each pose in drawn order, from 0."""
        return np.asarray(self.message("poses")["poses"], np.uint32)

    @content
    def schemes(self) -> npt.NDArray[np.uint8]:
        """(poses,) draw of the point: an index into ``PICK_SCHEMES``."""
        return self._bytes("schemes")

    @content
    def object_from_cup(self) -> Floats:
        """(poses, 4, 4) the cup in the object's frame: origin where its axis meets the surface, z the approach."""
        found = poses(self.message("poses")["object_from_cup"])
        expect_lengths(len(self.numbers), object_from_cup=found)
        return found

    @content
    def results(self) -> npt.NDArray[np.uint8]:
        """(poses,) result: an index into ``SUCTION_RESULTS``."""
        return self._bytes("results")

    @content
    def free(self) -> npt.NDArray[np.bool_]:
        """(poses,) whether the cup seals, holds the body, and gets there without touching anything else."""
        return np.asarray(self.results == 0)

    @content
    def seal_limits(self) -> npt.NDArray[np.uint8]:
        """(poses,) limit of the seal that is used most: an index into ``SEAL_LIMITS``."""
        return self._bytes("seal_limits")

    @content
    def seal_margins(self) -> Floats:
        """(poses,) 1 less the used share of that limit, at least -1; minus the share of rays that miss. The cup seals from 0 on."""
        return self._floats("seal_margins")

    @content
    def missed(self) -> npt.NDArray[np.uint32]:
        """(poses,) rays that miss the surface."""
        found = np.asarray(self.message("poses")["missed"], np.uint32)
        expect_lengths(len(self.numbers), missed=found)
        return found

    @content
    def surfaces(self) -> Floats:
        """(poses, 11) measures of the surface under the cup, by ``SURFACE_MEASURES``; NaN where a ray misses."""
        return self._floats("surfaces", len(SURFACE_MEASURES))

    @content
    def suctionnet_seals(self) -> Floats:
        """(poses,) seal score of SuctionNet-1Billion, 0 to 1."""
        return self._floats("seals")

    @content
    def suctionnet_wrenches(self) -> Floats:
        """(poses,) wrench score of SuctionNet-1Billion, 0 to 1."""
        return self._floats("wrenches")

    @content
    def strengths(self) -> npt.NDArray[np.uint8]:
        """(poses,) strength that is used most: an index into ``SUCTION_STRENGTHS``, 255 where the cup leaks."""
        return self._bytes("strengths")

    @content
    def hold_margins(self) -> Floats:
        """(poses,) 1 less the used share of that strength, at least -1. The cup holds from 0 on. NaN where it leaks."""
        return self._floats("hold_margins")

    @content
    def used(self) -> Floats:
        """(poses, 4) used share of each of ``SUCTION_STRENGTHS``; NaN where the cup leaks."""
        return self._floats("used", len(SUCTION_STRENGTHS))

    @content
    def forces(self) -> Floats:
        """(poses,) N, force of the vacuum less that of the bellows; NaN where the cup leaks."""
        return self._floats("forces")

    @content
    def obstacles(self) -> npt.NDArray[np.uint8]:
        """(poses,) obstacle on the path of cup and tube: an index into ``PICK_OBSTACLES``; 0 for none."""
        return self._bytes("obstacles")

    @content
    def stages(self) -> npt.NDArray[np.uint8]:
        """(poses,) part of the path with the obstacle: 1 the pose itself, 2 the line to it; 0 without one."""
        return self._bytes("stages")

    @content
    def neighbours(self) -> npt.NDArray[np.uint32]:
        """(poses,) number of the body that is the obstacle, from 1; 0 if it is not a neighbour."""
        found = np.asarray(self.message("poses")["neighbours"], np.uint32)
        expect_lengths(len(self.numbers), neighbours=found)
        return found

    @content
    def clearances(self) -> Floats:
        """(poses,) m from the obstacle, negative where they overlap; without one the smallest distance, up to 0.01."""
        return self._floats("clearances")

    @content
    def robustness(self) -> Floats:
        """(poses,) share of poses with errors in which the cup of a free pose seals and holds; NaN for other poses."""
        return self._floats("robustness")

    def _bytes(self, name: str) -> npt.NDArray[np.uint8]:
        return as_array(self.message("poses")[name], "u1", len(self.numbers))

    def _floats(self, name: str, columns: int | None = None) -> Floats:
        found: Floats = np.asarray(self.message("poses")[name], np.float64)
        count = len(self.numbers)
        expect_lengths(count * (columns or 1), **{name: found})
        return found if columns is None else found.reshape(count, columns)
