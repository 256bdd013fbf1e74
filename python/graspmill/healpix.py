"""Directions spread evenly over the sphere, and the triangle of three directions around another one.

The same numbers as the Rust program's ``geom::field``: ring order after Gorski et al., "HEALPix", Astrophysical Journal
622 (2005), section 4.1; strips of triangles between neighbouring rings; weights where a direction meets the plane of
its three.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


def _rings(nside: int) -> list[tuple[float, float, int, float]]:
    """Rings from +z down: height, distance from the axis, count, azimuth of the first direction in steps."""
    rings = []
    for i in range(1, 4 * nside):
        north = min(i, 4 * nside - i)
        side = 1.0 if i <= 2 * nside else -1.0
        if north < nside:
            # 1 - |z|, which z itself would round away near a pole.
            below = north**2 / (3.0 * nside**2)
            rings.append((side * (1.0 - below), float(np.sqrt(below * (2.0 - below))), 4 * north, 0.5))
        else:
            z = side * (4.0 / 3.0 - 2.0 * north / (3.0 * nside))
            shift = 0.5 if (i - nside + 1) % 2 == 1 else 1.0
            rings.append((z, float(np.sqrt((1.0 - z) * (1.0 + z))), 4 * nside, shift))
    return rings


def _azimuth(ring: tuple[float, float, int, float], steps: npt.ArrayLike) -> Floats:
    return np.asarray(2.0 * np.pi / ring[2] * (np.asarray(steps) + ring[3]), np.float64)


def angles(nside: int) -> Floats:
    """Elevation and azimuth (-pi..pi) of each direction, (12 nside^2, 2) rad."""
    parts = []
    for ring in _rings(nside):
        azimuth = _azimuth(ring, np.arange(ring[2]))
        azimuth = np.where(azimuth < np.pi, azimuth, azimuth - 2.0 * np.pi)
        parts.append(np.stack([np.full(ring[2], np.arctan2(ring[0], ring[1])), azimuth], axis=1))
    return np.concatenate(parts)


def directions(nside: int) -> Floats:
    """The directions as unit vectors, (12 nside^2, 3)."""
    parts = []
    for ring in _rings(nside):
        azimuth = _azimuth(ring, np.arange(ring[2]))
        height = np.full(ring[2], ring[0])
        parts.append(np.stack([ring[1] * np.cos(azimuth), ring[1] * np.sin(azimuth), height], axis=1))
    return np.concatenate(parts)


def triangles(nside: int) -> Ints:
    """Triangles over the sphere with the directions as corners, (24 nside^2 - 4, 3), counter-clockwise from outside."""
    rings = _rings(nside)
    found = [(0, 1, 2), (0, 2, 3)]
    above, first = rings[0], 0
    for below in rings[1:]:
        second = first + above[2]
        # All azimuths once: a step past the end is one revolution further.
        high = [float(_azimuth(above, s % above[2])) + 2.0 * np.pi * (s // above[2]) for s in range(above[2] + 2)]
        low = [float(_azimuth(below, s % below[2])) + 2.0 * np.pi * (s // below[2]) for s in range(below[2] + 2)]
        a = b = 0
        while a < above[2] or b < below[2]:
            here = first + a % above[2], second + b % below[2]
            along, across = abs(high[a + 1] - low[b]), abs(low[b + 1] - high[a])
            if b == below[2] or (a < above[2] and along <= across):
                found.append((here[0], here[1], first + (a + 1) % above[2]))
                a += 1
            else:
                found.append((here[0], here[1], second + (b + 1) % below[2]))
                b += 1
        above, first = below, second
    found += [(first, first + 2, first + 1), (first, first + 3, first + 2)]
    return np.array(found, np.int64)


class DirectionMesh:
    """The triangles, prepared for many queries at once."""

    def __init__(self, nside: int) -> None:
        self.corners = triangles(nside)
        a, b, c = (directions(nside)[self.corners[:, k]] for k in range(3))
        volume = np.sum(a * np.cross(b, c), axis=1)[:, None]
        # A direction's weights are its products with these, over their sum.
        self._duals = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=1) / volume[..., None]
        sides = {
            (row[(k + 1) % 3], row[(k + 2) % 3]): at for at, row in enumerate(self.corners.tolist()) for k in range(3)
        }
        self._beyond = np.array(
            [[sides[row[(k + 2) % 3], row[(k + 1) % 3]] for k in range(3)] for row in self.corners.tolist()], np.int64
        )
        self._side = 2 * nside
        self._hints = self._starts()

    def around(self, ahead: Floats) -> tuple[Ints, Floats, Floats]:
        """Neighbours of directions (p, 3): the three around each (p, 3), their weights (p, 3), which sum to 1, and the
        derivative of each weight with respect to the direction (p, 3, 3)."""
        at = self._walk(ahead, self._hint(ahead))
        duals = self._duals[at]
        parts = np.einsum("pkc,pc->pk", duals, ahead)
        total = parts.sum(axis=1, keepdims=True)
        weights = parts / total
        together = duals.sum(axis=1)
        slopes = (duals - weights[..., None] * together[:, None, :]) / total[..., None]
        return self.corners[at], weights, slopes

    def _starts(self) -> Ints:
        """For each cell of the six faces of a cube a triangle nearby: the one around its middle."""
        side = self._side
        face, row, column = np.indices((6, side, side)).reshape(3, -1)
        middle = np.zeros((len(face), 3))
        every = np.arange(len(face))
        axis = face // 2
        middle[every, axis] = np.where(face % 2 == 0, 1.0, -1.0)
        middle[every, (axis + 1) % 3] = (row + 0.5) / side * 2.0 - 1.0
        middle[every, (axis + 2) % 3] = (column + 0.5) / side * 2.0 - 1.0
        return self._widest(middle)

    def _widest(self, ahead: Floats) -> Ints:
        """The triangle whose smallest weight is largest, by checking all of them."""
        best = np.empty(len(ahead), np.int64)
        for first in range(0, len(ahead), 256):
            some = ahead[first : first + 256]
            best[first : first + 256] = np.argmax(np.einsum("tkc,pc->ptk", self._duals, some).min(axis=2), axis=1)
        return best

    def _hint(self, ahead: Floats) -> Ints:
        every = np.arange(len(ahead))
        face = np.argmax(np.abs(ahead), axis=1)
        largest = ahead[every, face]
        cells = []
        for k in (1, 2):
            place = (ahead[every, (face + k) % 3] / np.abs(largest) + 1.0) * 0.5 * self._side
            cells.append(np.clip(place.astype(np.int64), 0, self._side - 1))
        number = 2 * face + (largest < 0.0)
        hints: Ints = self._hints[(number * self._side + cells[0]) * self._side + cells[1]]
        return hints

    def _walk(self, ahead: Floats, at: Ints) -> Ints:
        """The triangle around each direction, from one nearby: steps across the side that the direction is farthest beyond."""
        at = at.copy()
        open_ = np.arange(len(ahead))
        for _ in range(4 * self._side):
            parts = np.einsum("pkc,pc->pk", self._duals[at[open_]], ahead[open_])
            least = np.argmin(parts, axis=1)
            beyond = parts[np.arange(len(open_)), least] < 0.0
            if not beyond.any():
                return at
            open_, least = open_[beyond], least[beyond]
            at[open_] = self._beyond[at[open_], least]
        # A circle of rounding ends here.
        at[open_] = self._widest(ahead[open_])
        return at
