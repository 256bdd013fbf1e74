"""Grasps as arrays: which are good, how good they are where they were tried, and where to send the hand.

python python/examples/grasps.py datasets/grasps-quick
"""

import argparse

import numpy as np
from graspmill import VERDICTS, Dataset, GraspSample, object_meshes

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("dataset")
folder = parser.parse_args().dataset
data = Dataset(folder, GraspSample)
meshes = object_meshes(folder)
names = data.column("object")

for name in sorted(set(names)):
    runs = data.gather(np.flatnonzero(names == name).tolist())
    grasps = np.concatenate(
        [run.grasps[["verdict", "epsilon_wrench", "object_from_approach", "posture"]] for run in runs]
    )
    kept = grasps[grasps["verdict"] == VERDICTS.index("kept")]
    print(f"{name}: {len(meshes[name].triangles)} triangles, {len(runs)} runs, {len(grasps)} grasps, {len(kept)} kept")
    if len(kept):
        best = kept[np.argmax(kept["epsilon_wrench"])]
        # The hand comes along the approach's z axis, from `stand_off` back.
        approach = best["object_from_approach"]
        start = approach[:3, 3] - runs[0].run["stand_off"] * approach[:3, 2]
        end = np.round(approach[:3, 3], 3)
        print(f"  best epsilon {best['epsilon_wrench']:.3f}: from {np.round(start, 3)} to {end} m")
    if runs[0].has("trials"):
        trials = np.concatenate([run.trials["verdict"] for run in runs])
        print(f"  {np.sum(trials == 0)} of {len(trials)} held when lifted and shaken")
