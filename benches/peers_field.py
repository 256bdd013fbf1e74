"""Lookups and fields of scipy and scikit-fmm on the Fetch's grid, beside `cargo bench --bench reachability`.

Poses are random in the box of the grid. scipy has no gradient: its time is that of the value alone.
"""

from __future__ import annotations

import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import distance_transform_edt, map_coordinates

SHAPE = (12, 22, 20, 2, 8, 8)
PERIODIC = (False, False, False, True, True, True)
STEPS = (0.1, 0.1, 0.1, 0.127 * np.pi, 0.127 * np.pi / 4, 0.127 * np.pi / 4)
POSES = 100_000


def best(call, rounds: int = 3) -> float:
    """Seconds of CPU of the fastest round."""
    times = []
    for _ in range(rounds):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


def balls(draw: np.random.Generator) -> np.ndarray:
    """The union of eight balls, five steps wide."""
    inside = np.zeros(SHAPE, bool)
    places = np.indices(SHAPE, sparse=True)
    for _ in range(8):
        square = 0
        for axis, count, periodic in zip(places, SHAPE, PERIODIC):
            apart = abs(axis - draw.integers(count))
            square = square + (np.minimum(apart, count - apart) if periodic else apart) ** 2
        inside |= square <= 25
    return inside


def main() -> None:
    draw = np.random.default_rng(1)
    inside = balls(draw)
    tiled = np.tile(inside, [3 if periodic else 1 for periodic in PERIODIC])
    seconds = best(lambda: [distance_transform_edt(labels, sampling=STEPS) for labels in (tiled, ~tiled)], 1)
    print(f"scipy distance_transform_edt, both signs, angles laid out three times: {seconds:.2f} s")
    try:
        import skfmm
    except ImportError:
        print("scikit-fmm is not installed (make bench-peers)")
    else:
        seconds = best(lambda: skfmm.distance(0.5 - inside, dx=1.0, order=2, periodic=PERIODIC), 1)
        print(f"scikit-fmm, second order: {seconds:.2f} s")
    field = draw.standard_normal(SHAPE).astype("f4")
    # One more cell on periodic axes, so that no lookup has to wrap.
    padded = np.pad(field, [(0, int(periodic)) for periodic in PERIODIC], mode="wrap")
    places = draw.random((POSES, 6)) * (np.array(padded.shape) - 1)
    seconds = best(lambda: map_coordinates(padded, places.T, order=1))
    print(f"scipy map_coordinates: {1e9 * seconds / POSES:.0f} ns a value")
    look_up = RegularGridInterpolator([np.arange(float(count)) for count in padded.shape], padded)
    print(f"scipy RegularGridInterpolator: {1e9 * best(lambda: look_up(places)) / POSES:.0f} ns a value")


main()
