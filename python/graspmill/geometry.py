"""Samples in space: ids, cameras, grids, poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True, order=True)
class SampleId:
    """The name of a sample; the same in every dataset."""

    subject: str
    """BLAKE3 of the prepared object, of the robot's description or of the settled scene, 64 hexadecimal digits."""
    instance: int
    """Body of a scene, from 1; 0 for a single object, a robot and a scene as a whole."""
    item: int
    """Number of the view, position, run or grasp of the subject."""
    camera: int

    @classmethod
    def of(cls, message: dict[str, Any]) -> SampleId:
        """From a ``SampleId`` message."""
        return cls(bytes(message["subject"]).hex(), message["instance"], message["item"], message["camera"])


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: x right, y down, +z away from it; pixel centres at +0.5."""

    width: int
    """px"""
    height: int
    """px"""
    fx: float
    """px"""
    fy: float
    """px"""
    cx: float
    """px"""
    cy: float
    """px"""
    near: float
    """m"""

    def points(self, depth: npt.NDArray[np.float32], left: int = 0, top: int = 0) -> Floats:
        """The points behind a crop of depth (m, NaN = no return) whose first pixel is (``left``, ``top``).

        Shape (height, width, 3), metres, in the camera's frame.
        """
        rows, columns = np.indices(depth.shape)
        x = (columns + left + 0.5 - self.cx) / self.fx
        y = (rows + top + 0.5 - self.cy) / self.fy
        return np.stack([x, y, np.ones_like(x)], axis=-1) * depth.astype(np.float64)[..., None]


@dataclass(frozen=True)
class Grid:
    """Where a pair's cells are, in the camera's frame."""

    resolution: int
    """Cells along each axis, n."""
    centre: Floats
    """(3,) m, at 0.5 n, 0.5 n and 0.45 n cells from the lower corner."""
    cell_size: float
    """m"""

    @classmethod
    def of(cls, message: dict[str, Any]) -> Grid:
        """From a ``Grid`` message."""
        centre = np.array([message["centre_x"], message["centre_y"], message["centre_z"]])
        return cls(message["resolution"], centre, message["cell_size"])

    @property
    def lower_corner(self) -> Floats:
        """(3,) m, in the camera's frame."""
        return self.centre - np.array([0.5, 0.5, 0.45]) * self.resolution * self.cell_size

    def cells(self, points: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """The cells (x, y, z) of points (..., 3) in the camera's frame [m]; they may be outside 0..n."""
        places = (np.asarray(points, np.float64) - self.centre) / self.cell_size
        cells: npt.NDArray[np.int64] = np.floor(places + np.array([0.5, 0.5, 0.45]) * self.resolution).astype(np.int64)
        return cells

    def centres(self, cells: npt.ArrayLike) -> Floats:
        """The centres of cells (..., 3) in the camera's frame [m]."""
        return self.lower_corner + (np.asarray(cells, np.float64) + 0.5) * self.cell_size


def heights(grid: Grid, world_from_camera: Floats) -> Floats:
    """Heights of all cell centres of a grid above the plane z = 0 of the world: (n, n, n) m, indexed (x, y, z)."""
    n, axis = grid.resolution, world_from_camera[2, :3]
    x, y, z = (axis[:, None] * (grid.lower_corner[:, None] + (np.arange(n) + 0.5) * grid.cell_size))
    found: Floats = x[:, None, None] + y[None, :, None] + z[None, None, :] + world_from_camera[2, 3]
    return found


def pose(rows: npt.NDArray[np.float64]) -> Floats:
    """A pose ``a_from_b`` as (4, 4), from its twelve stored numbers."""
    return np.vstack([rows.reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])


def poses(rows: Floats) -> Floats:
    """(k, 4, 4) poses, from twelve stored numbers each."""
    rows = rows.reshape(-1, 3, 4)
    found = np.tile(np.eye(4), (len(rows), 1, 1))
    found[:, :3] = rows
    return found


def container_mesh(message: Mapping[str, Any]) -> tuple[Floats, npt.NDArray[np.uint32]] | None:
    """Vertices (n, 3) in the world [m] and triangles (m, 3) of the container of a message; ``None`` for a plane or a bin."""
    if message["container"] != "mesh":
        return None
    sizes = message["container_size"]
    tilt = np.radians(sizes[3]) if len(sizes) > 3 else 0.0
    turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(tilt), -np.sin(tilt)], [0.0, np.sin(tilt), np.cos(tilt)]])
    vertices = np.frombuffer(message["container_vertices"], "<f4").reshape(-1, 3).astype(np.float64)
    triangles = np.frombuffer(message["container_triangles"], "<u4").reshape(-1, 3).astype(np.uint32)
    return vertices @ turn.T, triangles


def bytes_of_cells(resolution: int) -> int:
    """Bytes of a packed bit plane, ceil(n^3 / 8)."""
    return (resolution**3 + 7) // 8


def unpack(bits: npt.NDArray[np.uint8], resolution: int) -> npt.NDArray[np.bool_]:
    """Packed bit planes (..., ceil(n^3 / 8)) as cells (..., n, n, n), indexed (x, y, z)."""
    cells = np.unpackbits(bits, axis=-1, count=resolution**3, bitorder="little")
    return cells.reshape(*bits.shape[:-1], resolution, resolution, resolution).view(np.bool_)


def pack(cells: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """Cells (..., n, n, n) as packed bit planes (..., ceil(n^3 / 8))."""
    return np.packbits(cells.reshape(*cells.shape[:-3], -1), axis=-1, bitorder="little")
