"""Hands by MuJoCo, and states of grasps by their trials, for several comparisons."""

import mujoco
import numpy as np


class Hand:
    """Sites of a hand in the frame of its base."""

    def __init__(self, file, names):
        self.model = mujoco.MjModel.from_xml_path(file)
        self.data = mujoco.MjData(self.model)
        self.names = names
        # The first body below the world carries the hand.
        self.base = 1

    def frames(self, joints):
        """(names, 4, 4): each site at these joints by name, in the base's frame."""
        for name, value in joints.items():
            self.data.qpos[self.model.joint(name).qposadr[0]] = value
        mujoco.mj_kinematics(self.model, self.data)
        base = np.eye(4)
        base[:3, :3], base[:3, 3] = self.data.xmat[self.base].reshape(3, 3), self.data.xpos[self.base]
        found = np.tile(np.eye(4), (len(self.names), 1, 1))
        for row, name in enumerate(self.names):
            site = self.data.site(name)
            found[row, :3, :3], found[row, :3, 3] = site.xmat.reshape(3, 3), site.xpos
        return np.linalg.inv(base) @ found


def states_of(picks):
    """State of each candidate by its trial, by the rules in docs/format.md: 0 untried, 1 held, 2 failed."""
    states = np.zeros(len(picks.runs), int)
    if picks.has("trials"):
        for trial in picks.trials:
            if trial.verdict == "held":
                states[trial.candidate] = 1
            elif trial.verdict not in ("starts_too_deep", "unstable"):
                states[trial.candidate] = 2
    return states
