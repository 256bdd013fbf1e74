"""Energies of the planner by NumPy, from contacts, shapes, points and maps that a test leaves in files.

planner_energies.py STATES TYPES MAPS: rows of 247 numbers (f64): 16 contacts (point, normal, closest point, outward normal, inside,
on the palm), the camera, a shape (spread, three flexions, roll), palm and three tips expressed in the camera, potential, contact energy and
reachability distance of one more state; the shapes of the canonical types (f64, five each); maps of 32 x 52 x 72 (f32). Prints a line per
state: contact energies by gamma, visibility, form and direction; heatmap energy, type and points without a value; the combined energy;
three forms with reachability.
"""

import itertools
import sys

import numpy as np

MAX = 1e5
REACH_MAX = 10.55
FOCAL = 320 / np.tan(1.047 / 2)

states = np.fromfile(sys.argv[1], "<f8").reshape(-1, 247)
types = np.fromfile(sys.argv[2], "<f8").reshape(-1, 5)
maps = np.fromfile(sys.argv[3], "<f4").reshape(-1, 52, 72).astype(float)


def contact(contacts, camera, gamma, visible, form, printed):
    point, normal, closest, outward = (contacts[:, 3 * part:3 * part + 3] for part in range(4))
    inside, on_palm = contacts[:, 12] == 1, contacts[:, 13] == 1
    offset = closest - point
    distance = np.linalg.norm(offset, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        direction = offset / distance[:, None]
    if form == "standard":
        direction = np.where(inside[:, None], -direction, direction)
    direction = np.where((distance < 1e-6)[:, None], -outward, direction)
    if printed:
        direction = outward
    seen = {
        "off": np.ones(len(contacts), bool),
        "palm": on_palm,
        "facing": (direction * (closest - camera)).sum(axis=1) > 0,
    }[visible]
    if not seen.any():
        return MAX
    energies = 1e3 * distance + gamma * (1 - (normal * direction).sum(axis=1))
    if form == "thesis":
        return energies[seen].mean()
    return np.where(seen, energies, 50 + gamma).mean()


def bilinear(image, u, v):
    column, row = (u - 36) / 8, (v - 36) / 8
    if not (0 <= column <= 71 and 0 <= row <= 51):
        return None
    left, top = min(int(column), 70), min(int(row), 50)
    x, y = column - left, row - top
    square = image[top:top + 2, left:left + 2]
    return np.array([1 - y, y]) @ square @ np.array([1 - x, x])


def heatmap(shape, points):
    bins = np.array([np.pi / 5] + 3 * [2.44 / 5] + [2 * np.pi / 5])
    apart = (shape - types) / bins
    apart[:, 4] = (apart[:, 4] + 2.5) % 5 - 2.5
    distances = np.linalg.norm(apart, axis=1)
    kind = int(distances.argmin())
    total, missing = 0.0, 0
    for index, (x, y, z) in enumerate(points.reshape(4, 3)):
        value = bilinear(maps[4 * kind + index], FOCAL * x / z + 320, FOCAL * y / z + 240) if z >= 0.05 else None
        total, missing = (total, missing + 1) if value is None else (total + value, missing)
    energy = MAX if distances[kind] > 2.5 else 100 * total + 10 * distances[kind]
    return energy, kind, missing


def reachability(potential, energy, d):
    if np.isnan(d):
        return [np.inf] * 3
    s = max(d, -0.5)
    if potential < 0 and d < 0:
        return [100 * potential + 0.1 * s, potential + 0.1 * d, potential - 0.1 * d]
    printed = energy + (REACH_MAX - d) if d < 0 else energy - 10 * d
    return [energy + 10 * s, energy + 10 * d, printed]


for state in states:
    contacts, camera, shape, points, last = np.split(state, [224, 227, 232, 244])
    kinds = itertools.product([50.0, 500.0], ["off", "palm", "facing"], ["standard", "thesis"], [False, True])
    energies = [contact(contacts.reshape(16, 14), camera, *kind) for kind in kinds]
    found = heatmap(shape, points)
    combined = 0.1 * found[0] + 0.9 * energies[0]
    print(*(f"{value:.17g}" for value in [*energies, *found, combined, *reachability(*last)]))
