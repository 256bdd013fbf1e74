"""Tries chosen grasps in plain MuJoCo, by the `replay.py` of an export: `replay_chosen.py FOLDER < chosen.json`.

`chosen.json` is a list of {"object": name, "object_from_base": [12 numbers], "posture": [...]}; what became of each is printed
as a JSON list in its order. A program of its own, since the environment that learns has no MuJoCo.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import mujoco

from stability import import_replay


def main() -> None:
    folder, chosen = Path(sys.argv[1]), json.load(sys.stdin)
    replay, drive = import_replay(folder), json.loads((folder / "drive.json").read_text())
    told = {}
    for path in folder.glob("*/grasps.json"):
        facts = json.loads(path.read_text())
        told[facts["name"]] = (path.parent, facts["gravity"])
    models, verdicts = {}, []
    for number, grasp in enumerate(chosen):
        scene, gravity = told[grasp["object"]]
        if scene not in models:
            models = {scene: mujoco.MjSpec.from_file(str(scene / "scene.xml")).compile()}
        trial = replay.Trial(models[scene], drive, gravity, grasp)
        verdict = trial.run()
        verdicts.append("unstable" if sum(warning.number for warning in trial.data.warning) else verdict)
        if (number + 1) % 20 == 0:
            print(f"{number + 1} of {len(chosen)} trials", file=sys.stderr, flush=True)
    json.dump(verdicts, sys.stdout)


if __name__ == "__main__":
    main()
