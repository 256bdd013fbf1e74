"""The default camera and grid of a job, and rotations of views, for the benchmarks' other chains."""

from __future__ import annotations

import numpy as np

# Cells on a side of a grid, and where in it [cells] the middle of the seen box lies.
N = 40
ANCHOR = np.array([0.5, 0.5, 0.45]) * N
# The image [px] and its horizontal field of view [rad]; focal length [px].
WIDTH, HEIGHT, FOV = 640, 480, 1.047
FOCAL = WIDTH / 2 / np.tan(FOV / 2)
# Position of the object before the camera (x right, y down, z away) [m].
AWAY = np.array([0.0, 0.0, 1.0])


def random_rotations(rng: np.random.Generator, count: int) -> np.ndarray:
    """Uniform rotations by normalised quaternions; shape (count, 3, 3)."""
    q = rng.normal(size=(count, 4))
    w, x, y, z = (q / np.linalg.norm(q, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)
