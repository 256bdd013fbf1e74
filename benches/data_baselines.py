"""Ways to complete a shape that learn nothing, or next to nothing: what a network must beat.

Grids are bool (pairs, N, N, N), indexed x, y, z in camera axes (x right, y down, z away). NumPy; SciPy for the hull.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from data_faults import unpack
from default_view import N


def pooled(grids: np.ndarray) -> np.ndarray:
    """Roots of the counts of occupied cells in each 4^3 block, so that no filled one drowns others; (pairs, 1000)."""
    blocks = grids.reshape(-1, N // 4, 4, N // 4, 4, N // 4, 4).sum(axis=(2, 4, 6))
    return np.sqrt(blocks.reshape(len(grids), -1)).astype(np.float32)


def nearest(queries: np.ndarray, features: np.ndarray, count: int) -> np.ndarray:
    """Rows of the `count` features nearest to each query, in no order; (queries, count)."""
    distance = (queries**2).sum(axis=1)[:, None] - 2 * queries @ features.T + (features**2).sum(axis=1)[None]
    return np.argpartition(distance, count - 1, axis=1)[:, :count]


def far_end(partial: np.ndarray) -> np.ndarray:
    """Last layer along z that holds a seen cell; (pairs,)."""
    seen = partial.any(axis=(1, 2))
    return N - 1 - seen[:, ::-1].argmax(axis=1)


def extruded(partial: np.ndarray, eyes: np.ndarray) -> np.ndarray:
    """Each seen cell drawn out along its ray from the eye [cells], to the last layer in which anything is seen."""
    complete = partial.copy()
    for grid, eye, end in zip(complete, eyes, far_end(partial)):
        seen = np.argwhere(grid) + 0.5
        # Half a layer at a time.
        steps = np.arange(2 * N)[:, None] / 2
        depth = np.minimum(seen[:, 2] + steps, end + 0.5)
        rays = eye + (seen - eye) * ((depth - eye[2]) / (seen[:, 2] - eye[2]))[..., None]
        cells = np.floor(rays.reshape(-1, 3)).astype(int)
        cells = cells[((cells >= 0) & (cells < N)).all(axis=1)]
        grid[tuple(cells.T)] = True
    return complete


def mirrored(partial: np.ndarray) -> np.ndarray:
    """Each seen cell joined along z to its image behind the last layer in which anything is seen."""
    complete = partial.copy()
    z = np.arange(N)
    for grid, end in zip(complete, far_end(partial)):
        seen = grid.any(axis=2)
        first = grid.argmax(axis=2)[..., None]
        grid |= seen[..., None] & (z >= first) & (z <= 2 * end - first)
    return complete


def hull(partial: np.ndarray) -> np.ndarray:
    """Cells whose centres lie in the convex hull of the seen cells' centres; what is flat stays as it is."""
    return np.array([_hull(grid) for grid in partial])


def _hull(grid: np.ndarray) -> np.ndarray:
    try:
        planes = ConvexHull(np.argwhere(grid)).equations
    except QhullError:
        return grid
    # Facets may be listed more than once, as triangles; rounded, as their corners are whole numbers.
    planes = np.unique(planes.round(9), axis=0)
    x, y = np.indices((N, N)).reshape(2, -1)
    # normal . (x, y, z) + offset <= 0: a bound on z from each facet, column by column.
    rest = planes[:, :2] @ np.stack([x, y]) + planes[:, 3:]
    slope = planes[:, 2]
    up, down, upright = slope > 1e-9, slope < -1e-9, abs(slope) <= 1e-9
    high = (-rest[up] / slope[up, None]).min(axis=0)
    low = (-rest[down] / slope[down, None]).max(axis=0)
    inside = (rest[upright] <= 1e-6).all(axis=0)[:, None]
    z = np.arange(N)
    inside = inside & (z >= low[:, None] - 1e-6) & (z <= high[:, None] + 1e-6)
    return inside.reshape(N, N, N) | grid


def nearest_neighbour(partial: np.ndarray, train_partial: np.ndarray, train_complete: np.ndarray) -> np.ndarray:
    """The complete grid of the training pair whose pooled partial is nearest; training grids packed."""
    parts = np.array_split(train_partial, max(1, len(train_partial) // 500))
    features = np.concatenate([pooled(unpack(part)) for part in parts])
    return unpack(train_complete[nearest(pooled(partial), features, 1)[:, 0]])
