"""Completion pairs that graspmill had no part in: depth and columns by Embree, surface samples by trimesh.

The same camera, distance and grid as a job's that says nothing of them.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from default_view import ANCHOR, AWAY, FOCAL, HEIGHT, N, WIDTH, random_rotations


class NeutralObject:
    """A mesh before the pinhole camera (x right, y down, z away), 1 m off, seen by Embree; rays go to its frame."""

    def __init__(self, scan: Path, rng: np.random.Generator) -> None:
        self.mesh = trimesh.load(scan)
        self.mesh.apply_translation(-self.mesh.bounds.mean(axis=0))
        self.embree = RayMeshIntersector(self.mesh)
        self.surface = trimesh.sample.sample_surface(self.mesh, 60_000, seed=int(rng.integers(1 << 31)))[0]

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
        low, high = points.min(axis=0), points.max(axis=0)
        centre, cell = (low + high) / 2, (high - low).max() / (0.8 * N)

        def mark(points: np.ndarray) -> np.ndarray:
            grid = np.zeros((N, N, N), bool)
            cells = np.floor((points - centre) / cell + ANCHOR).astype(int)
            grid[tuple(cells[((cells >= 0) & (cells < N)).all(axis=1)].T)] = True
            return grid

        partial = mark(points)
        if partial.sum() < 100:
            return None
        surface = self.surface @ rotation.T + AWAY
        complete = mark(surface)
        # Columns along z through the cell centres: what lies between an odd and an even crossing is inside.
        x, y = np.meshgrid(np.arange(N), np.arange(N), indexing="ij")
        start = (np.stack([x.ravel() + 0.5, y.ravel() + 0.5, np.zeros(N * N)], axis=1) - ANCHOR) * cell + centre
        start[:, 2] = surface[:, 2].min() - 4 * cell
        hits, columns, _ = self.embree.intersects_location(
            (start - AWAY) @ rotation, np.tile(rotation[2], (N * N, 1))
        )
        crossing = (hits @ rotation[2] + AWAY[2] - centre[2]) / cell + ANCHOR[2]
        for column in np.unique(columns):
            z = np.sort(crossing[columns == column])
            for enter, leave in zip(z[0::2], z[1::2]):
                first, end = int(np.ceil(enter - 0.5)), int(np.ceil(leave - 0.5))
                complete[column // N, column % N, max(first, 0) : max(end, 0)] = True
        return partial, complete, ANCHOR - centre / cell


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
    """So many views of each scan; those that show too little are left out."""
    with ProcessPoolExecutor() as pool:
        pairs, shares = zip(*pool.map(pairs_of, scans, range(len(scans)), [views] * len(scans)))
    partial, complete, eyes = (np.array([pair[part] for of_scan in pairs for pair in of_scan]) for part in range(3))
    objects = np.repeat(np.arange(len(scans)), [len(of_scan) for of_scan in pairs])
    return NeutralPairs(partial, complete, eyes, objects, np.array(shares))
