"""Samples of amodal pairs: completion pairs of the bodies of settled scenes, with the surroundings of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .completion import Cells, CompletionSample
from .geometry import bytes_of_cells, heights, unpack
from .samples import content, expect_lengths


@dataclass(frozen=True, eq=False)
class Clutter:
    """Surroundings of one body of a scene in one image, on the grid of its pair."""

    object: str
    """Digest of the body's object, 64 hexadecimal digits, as in ``assets.json``."""
    instance: int
    """Number of the body in its scene and in its image, from 1."""
    pixels_all: int
    """Pixels of its silhouette alone, including those outside the image."""
    pixels_in_image: int
    """Pixels of its silhouette alone, in the image."""
    pixels_visible: int
    """Pixels that see it."""
    points: int
    """Measured depths from which the partial grid is made."""
    own_points: int
    """Points among them that were measured on the body's own surface."""
    others_seen: Cells
    """Cells that hold a measured depth of anything else: (n, n, n), indexed (x, y, z)."""
    others_solid: Cells
    """Cells that meet another body, the container or the half-space below the table: (n, n, n), indexed (x, y, z)."""

    @property
    def visible_share(self) -> float:
        """Visible share of its silhouette, 0 to 1."""
        return self.pixels_visible / max(self.pixels_all, 1)

    @property
    def truncated(self) -> bool:
        """Whether the body extends beyond the image."""
        return self.pixels_in_image < self.pixels_all

    @property
    def purity(self) -> float:
        """Share of the points that were measured on the body, 0 to 1."""
        return self.own_points / max(self.points, 1)


class AmodalSample(CompletionSample):
    """A completion pair of one body of a scene in one image: all attributes of a ``CompletionSample`` except occluders, and
    ``clutter``."""

    product = "amodal"
    __slots__ = ()

    @content
    def clutter(self) -> Clutter:
        """Surroundings of the body."""
        message, n = self.message("clutter"), self.resolution
        grids = {name: np.frombuffer(message[name], np.uint8) for name in ("others_seen", "others_solid")}
        expect_lengths(bytes_of_cells(n), **grids)
        return Clutter(
            object=bytes(message["object"]).hex(),
            instance=int(message["sample"]["instance"]),
            pixels_all=int(message["pixels_all"]),
            pixels_in_image=int(message["pixels_in_image"]),
            pixels_visible=int(message["pixels_visible"]),
            points=int(message["points"]),
            own_points=int(message["own_points"]),
            others_seen=unpack(grids["others_seen"], n),
            others_solid=unpack(grids["others_solid"], n),
        )

    @content
    def below_support(self) -> Cells:
        """Cells of the table or of a bin's floor: their centre is below the plane z = 0 of the world, and something other than
        the body is in them. (n, n, n), indexed (x, y, z). A runtime knows this plane, so networks may see these cells."""
        pair = self.pair
        below: Cells = heights(pair.grid, pair.world_from_camera) < 0.0
        return below & self.clutter.others_solid & ~self.partial
