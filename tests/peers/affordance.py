"""Grasps in volumes against another program: every row made anew out of volumes, picks and the hand's description.

    affordance.py VOLUMES PICKS HAND.xml LEFT RIGHT

The hand's description is read by MuJoCo: the pads LEFT and RIGHT are its sites at the closed joints, whose z axes are their outward normals,
and the approach is its site of that name. Prints counts as JSON.
"""

import json
import sys

import graspmill
import numpy as np
from handsites import Hand, states_of


def matrix_of(quaternion):
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def expected_grasp(volume, picks, candidate, hand):
    """Centre, rotation and width of a free candidate in the volume's frame."""
    joints = dict(zip(picks.joint_names, picks.closed_joints[candidate]))
    frames = np.linalg.inv(volume.world_from_volume) @ picks.world_from_base[candidate] @ hand.frames(joints)
    approach, left, right = frames
    z = approach[:3, 2]
    x = left[:3, 2] - z * (z @ left[:3, 2])
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z], axis=-1)
    width = (right[:3, 3] - left[:3, 3]) @ left[:3, 2]
    return (left[:3, 3] + right[:3, 3]) / 2, rotation, width


def main():
    volumes, picks, hand_file, left, right = sys.argv[1:]
    hand = Hand(hand_file, ["approach", left, right])
    picks_of = {}
    for sample in graspmill.Dataset(picks, graspmill.PickSample):
        picks_of.setdefault(sample.id.subject, {})[sample.body] = sample.copy()
    found = dict.fromkeys(("volumes", "untried", "held", "failed", "outside", "forbidden", "known_voxels"), 0)
    worst = 0.0
    for volume in graspmill.Dataset(volumes, graspmill.VolumeSample):
        rows = {key: row for row, key in enumerate(zip(volume.grasp_bodies.tolist(), volume.grasp_candidates.tolist()))}
        forbidden, outside, best = np.zeros(4, int), 0, {}
        for body, sample in picks_of.get(volume.id.subject, {}).items():
            states = states_of(sample)
            for candidate, verdict in enumerate(sample.verdicts):
                if verdict:
                    forbidden[verdict - 1] += 1
                    continue
                centre, rotation, width = expected_grasp(volume, sample, candidate, hand)
                if not ((centre >= 0) & (centre < volume.size)).all():
                    outside += 1
                    assert (body, candidate) not in rows
                    continue
                row = rows.pop((body, candidate))
                worst = max(worst, np.abs(volume.grasp_centres[row] - centre).max(), abs(volume.grasp_widths[row] - width))
                worst = max(worst, np.abs(matrix_of(volume.grasp_rotations[row]) - rotation).max())
                assert (volume.grasp_voxels[row] == np.floor(centre / volume.voxel)).all()
                assert volume.grasp_states[row] == states[candidate]
                found[graspmill.PICK_STATES[states[candidate]]] += 1
                if states[candidate]:
                    voxel = tuple(volume.grasp_voxels[row])
                    best[voxel] = max(best.get(voxel, 0.0), float(states[candidate] == 1))
        assert not rows and (forbidden == volume.forbidden).all(), (rows, forbidden)
        # Over the voxels: the best of the tried grasps, and nothing where none was tried.
        dense = volume.affordance
        assert {tuple(voxel) for voxel in np.argwhere(dense.known)} == best.keys()
        assert all(dense.quality[voxel] == value for voxel, value in best.items())
        assert dense.count.sum() == len(volume.grasp_bodies) and np.isnan(dense.quality[~dense.known]).all()
        assert np.isfinite(dense.rotation[dense.known]).all() and np.isfinite(dense.width[dense.known]).all()
        found["volumes"] += 1
        found["outside"] += outside
        found["forbidden"] += int(forbidden.sum())
        found["known_voxels"] += len(best)
    print(json.dumps({**found, "worst": float(worst)}))


main()
