"""Gain of touch over sight: how many hidden cells a hand or rays found, and how deep the shape is then known to be.

python python/examples/touch.py datasets/half-shapes
"""

import argparse

import numpy as np
from graspmill import CompletionSample, Dataset

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("dataset")
data = Dataset(parser.parse_args().dataset, CompletionSample)

for sample, name in zip(data, data.column("object")):
    complete, seen, felt = sample.complete, sample.partial, sample.tactile
    network_input = np.stack([seen, felt])  # (2, n, n, n): or one channel, `sample.seen_or_touched`
    hidden = complete & ~seen
    contacts = sum(len(touch.probe) for touch in sample.touch.values())
    # How far the shape is known to reach, in cells along the camera's axis.
    known = [np.ptp(np.nonzero(cells)[2]) + 1 for cells in (seen, seen | felt, complete)]
    found = (felt & hidden).sum()
    print(f"{name}: {seen.sum()} cells seen, {contacts} contacts in {felt.sum()} cells, {found} of them hidden")
    print(f"  depth {known[0]} cells seen, {known[1]} with touch, {known[2]} in truth; input {network_input.shape}")
