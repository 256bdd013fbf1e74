"""A reachability map as a filter of grasps: rank poses by signed distance, and climb into the reachable set.

python python/examples/reachability.py datasets/fetch-reachability
"""

import argparse

import numpy as np
from graspmill import LABELS, ReachabilityField

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("dataset")
field = ReachabilityField(parser.parse_args().dataset)

counts = np.bincount(field.labels.reshape(-1), minlength=len(LABELS))
print(f"{field.robot}, {field.target} in {field.frame}: " + ", ".join(f"{n} {name}" for n, name in zip(counts, LABELS)))

# A thousand poses in front of the robot, all from above at first: (poses, 6) x, y, z [m], roll, pitch, yaw [rad].
draws = np.random.default_rng(0)
low, high = [0.4, -0.4, 0.3, -np.pi, 0.5, -np.pi], [1.2, 0.4, 1.2, np.pi, 1.5, np.pi]
poses = draws.uniform(low, high, (1000, 6))
distance, gradient = field.distance_and_gradient(poses)
print(f"{np.mean(distance < 0):.0%} of {len(poses)} poses are reachable; deepest {distance.min():.3f} {field.unit}")

# Poses that are not: a few steps down the field, in metres and weighted radians alike.
weights = np.array([1.0] * 3 + [1.0 / max(field.radian_weight, 1e-3)] * 3)
moved = poses[distance > 0]
for _ in range(20):
    distance, gradient = field.distance_and_gradient(moved)
    slope = gradient * weights
    moved = moved - 0.02 * weights * slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-9)
print(f"of the others {np.mean(field.distance(moved) < 0):.0%} are so after 20 steps of 2 cm down the gradient")
labels = field.nearest(poses[:5]).names
print(f"nearest cells of the first five: {', '.join(labels)}")
