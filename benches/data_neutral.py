"""Completion pairs that graspmill had no part in: depth and columns by Embree, surface samples by trimesh.

The same camera, distance and grid as the defaults of a job.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from default_view import ANCHOR, AWAY, FOCAL, HEIGHT, N, WIDTH, random_rotations

# Points on the surface. Of 60,000 a mug's cells that the surface only just meets have none: 6 % of all that it meets were
# missing, and grids without them beat right ones.
SURFACE = 2_000_000
# Columns along each side of a cell, for the share of it that is solid.
COLUMNS = 4


def frame_of(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Where the grid of seen points lies: the middle of their box, and the side of a cell [m]."""
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, float((high - low).max() / (0.8 * N))


def marked(points: np.ndarray, centre: np.ndarray, cell: float) -> np.ndarray:
    """Cells that hold a point, bool (N, N, N)."""
    grid = np.zeros((N, N, N), bool)
    cells = np.floor((points - centre) / cell + ANCHOR).astype(int)
    grid[tuple(cells[((cells >= 0) & (cells < N)).all(axis=1)].T)] = True
    return grid


class NeutralObject:
    """A mesh before the pinhole camera (x right, y down, z away), 1 m off, seen by Embree; rays go to its frame."""

    def __init__(self, scan: Path, rng: np.random.Generator) -> None:
        self.mesh = trimesh.load(scan)
        self.mesh.apply_translation(-self.mesh.bounds.mean(axis=0))
        self.embree = RayMeshIntersector(self.mesh)
        self.surface = trimesh.sample.sample_surface(self.mesh, SURFACE, seed=int(rng.integers(1 << 31)))[0]

    def depth(self, rotation: np.ndarray) -> np.ndarray:
        """Points in camera axes [m] seen by the camera; shape (hits, 3)."""
        vertices = self.mesh.vertices @ rotation.T + AWAY
        projected = FOCAL * vertices[:, :2] / vertices[:, 2:]
        low = np.floor(projected.min(axis=0)).astype(int) - 1
        high = np.ceil(projected.max(axis=0)).astype(int) + 2
        u, v = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
        inside = (abs(u) < WIDTH / 2) & (abs(v) < HEIGHT / 2)
        rays = np.stack([u[inside] / FOCAL, v[inside] / FOCAL, np.ones(inside.sum())], axis=1)
        eye, directions = -AWAY @ rotation, rays @ rotation
        triangles = self.embree.intersects_first(np.broadcast_to(eye, directions.shape), directions)
        hit = triangles >= 0
        directions, triangles = directions[hit], triangles[hit]
        # Exact plane hit: Embree's own distance is single precision.
        normals, corners = self.mesh.face_normals[triangles], self.mesh.triangles[triangles, 0]
        return rays[hit] * ((normals * (corners - eye)).sum(axis=1) / (normals * directions).sum(axis=1))[:, None]

    def pair(self, rotation: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """(partial, complete, eye): bool (N, N, N) indexed x, y, z in camera axes; the camera's place [cells].

        None when too little is seen.
        """
        points = self.depth(rotation)
        if len(points) < 2:
            return None
        centre, cell = frame_of(points)
        partial = marked(points, centre, cell)
        if partial.sum() < 100:
            return None
        return partial, self.complete(rotation, centre, cell), ANCHOR - centre / cell

    def complete(self, rotation: np.ndarray, centre: np.ndarray, cell: float) -> np.ndarray:
        """Cells that the surface meets or whose centre is inside, bool (N, N, N); the middle of the visible box and the
        side of a cell [m] define the grid."""
        complete = marked(self.surface @ rotation.T + AWAY, centre, cell)
        for x, y, enter, leave in self.inside(rotation, centre, cell, 1):
            first, end = int(np.ceil(enter - 0.5)), int(np.ceil(leave - 0.5))
            complete[x, y, max(first, 0) : max(end, 0)] = True
        return complete

    def share(self, rotation: np.ndarray, centre: np.ndarray, cell: float) -> np.ndarray:
        """Share of each cell that is solid, float32 (N, N, N), by columns through it."""
        edges, share = np.arange(N + 1), np.zeros((N, N, N), np.float32)
        for x, y, enter, leave in self.inside(rotation, centre, cell, COLUMNS):
            share[x // COLUMNS, y // COLUMNS] += np.diff(np.clip(edges, enter, leave)) / COLUMNS**2
        return share

    def inside(
        self, rotation: np.ndarray, centre: np.ndarray, cell: float, per_cell: int
    ) -> Iterator[tuple[int, int, float, float]]:
        """Where columns along z, `per_cell` along each side of a cell, are inside the mesh: column (x, y), and from where
        to where [cells]. What lies between an odd and an even crossing is inside."""
        side = N * per_cell
        x, y = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
        flat = np.stack([(x.ravel() + 0.5) / per_cell, (y.ravel() + 0.5) / per_cell, np.zeros(side * side)], axis=1)
        start = (flat - ANCHOR) * cell + centre
        start[:, 2] = (self.mesh.vertices @ rotation.T + AWAY)[:, 2].min() - 4 * cell
        hits, columns, _ = self.embree.intersects_location(
            (start - AWAY) @ rotation, np.tile(rotation[2], (side * side, 1))
        )
        crossing = (hits @ rotation[2] + AWAY[2] - centre[2]) / cell + ANCHOR[2]
        order = np.lexsort((crossing, columns))
        columns, crossing = columns[order], crossing[order]
        for column, z in zip(*grouped(columns, crossing)):
            for enter, leave in zip(z[0::2], z[1::2]):
                yield int(column) // side, int(column) % side, float(enter), float(leave)


def grouped(keys: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
    """Each of the sorted keys once, and the values of each."""
    unique, firsts = np.unique(keys, return_index=True)
    return unique, np.split(values, firsts[1:]) if len(unique) else []


@dataclass(frozen=True)
class NeutralPairs:
    """Pairs of several objects."""

    partial: np.ndarray
    """bool (pairs, N, N, N)"""
    complete: np.ndarray
    """bool (pairs, N, N, N)"""
    eyes: np.ndarray
    """(pairs, 3) cells, from the corner of the grid."""
    objects: np.ndarray
    """(pairs,) place of each pair's scan in the list."""
    solid_shares: np.ndarray
    """(scans,) volume of each scan over that of its convex hull."""


def pairs_of(scan: Path, seed: int, views: int) -> tuple[list[tuple[np.ndarray, np.ndarray, np.ndarray]], float]:
    """(partial, complete, eye) of each view, and the scan's share of its convex hull."""
    rng = np.random.default_rng(seed)
    neutral = NeutralObject(scan, rng)
    pairs = (neutral.pair(rotation) for rotation in random_rotations(rng, views))
    return [pair for pair in pairs if pair is not None], neutral.mesh.volume / neutral.mesh.convex_hull.volume


def neutral_pairs(scans: list[Path], views: int) -> NeutralPairs:
    """`views` views of each scan; those that show too little are left out."""
    with ProcessPoolExecutor() as pool:
        pairs, shares = zip(*pool.map(pairs_of, scans, range(len(scans)), [views] * len(scans)))
    partial, complete, eyes = (np.array([pair[part] for of_scan in pairs for pair in of_scan]) for part in range(3))
    objects = np.repeat(np.arange(len(scans)), [len(of_scan) for of_scan in pairs])
    return NeutralPairs(partial, complete, eyes, objects, np.array(shares))
