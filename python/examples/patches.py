"""Patches around palm and fingertips as a training set: inputs, labels, and the best pixel of a heatmap.

python python/examples/patches.py datasets/everything-quick/patches
"""

import argparse

import numpy as np
from graspmill import Dataset, PatchSample

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("dataset")
data = Dataset(parser.parse_args().dataset, PatchSample)

samples = data.gather(range(min(64, len(data))))
# (samples, 4 points, side, side): depth relative to the middle of its own patch; no return counts as far away. Patches of one size in
# metres, where there are any, show an object as large from near as from far.
in_metres = samples[0].has("metric")
depth = np.stack([np.nan_to_num(sample.metric_depth if in_metres else sample.depth, nan=10.0) for sample in samples])
middle = depth.shape[-1] // 2
inputs = np.clip(depth - depth[..., middle : middle + 1, middle : middle + 1], -0.2, 0.2)
if samples[0].has("colour"):
    inputs = np.concatenate([inputs[..., None], np.stack([sample.metric_rgb if in_metres else sample.rgb for sample in samples]) / 255.0], axis=-1)
labels = np.stack([sample.labels for sample in samples])  # (samples, 4, 4 types), lower is better
print(f"inputs {inputs.shape}, labels {labels.shape}, from {labels.min():.3f} to {labels.max():.3f}")
kinds, counts = np.unique([sample.type_index for sample in samples], return_counts=True)
for kind, count in zip(kinds, counts):
    print(f"type {samples[0].types[kind]}: {count} patches, best label {labels[..., 4 * kind].min():.3f}")
if samples[0].has("trial"):
    # A loss takes the numbers that trials determine, and no others: the rest is untested, not bad.
    tested = np.stack([sample.tested for sample in samples])
    print(f"{tested.sum()} of {tested.size} numbers are known: {np.sum(labels[tested] < 0)} good, {np.sum(labels[tested] > 0)} bad")
if samples[0].has("visibility"):
    print(f"{np.mean([sample.visible for sample in samples]):.0%} of the points are visible")
if samples[0].has("heatmap"):
    # (4 types, height, width), NaN where no label is known: in views of grasps that trials leave open, perhaps everywhere.
    heatmaps = (sample.heatmap.image() for sample in samples)
    heatmap = next((heatmap for heatmap in heatmaps if not np.isnan(heatmap).all()), None)
    if heatmap is not None:
        channel, row, column = np.unravel_index(np.nanargmin(heatmap), heatmap.shape)
        print(f"in a view the best place for point {channel % 4} of a grasp is pixel ({column}, {row})")
