"""How much of a published set of grasps do ours cover, and do its labels agree with a trial in plain MuJoCo?

ACRONYM (Eppner, Mousavian and Fox 2021, "ACRONYM: a large-scale grasp dataset based on simulation") has 2,000 grasps of
each object with Panda's hand, each with the outcome of a trial in the simulator Flex. Its examples hold one mug with its
mesh; set GRASPMILL_SAMPLES to a folder with `acronym/*.h5` and `acronym/*.obj` of it (data CC BY-NC 4.0, no part of this
repository).

The sampler of pads on pairs of points makes grasps of the same mesh in the air, with the mass and friction that the file
names, and tries them. A grasp of ACRONYM's that holds is covered when a held one of ours is within 2 cm and 15 degrees of
its gripper's frame, or of that frame turned by 180 degrees about the approach, which is the same gripper. For comparison,
as many of ACRONYM's own successful grasps are drawn at random: a set of that size can cover as much. Then some of
ACRONYM's grasps, as many of either label, are closed, lifted and shaken by `replay.py` of an export, in plain MuJoCo.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import h5py
import mujoco
import numpy as np

from coverage import CLOSE_ANGLE, CLOSE_DISTANCE, closeness
from stability import import_replay, wilson

ROOT = Path(__file__).parent.parent
COUNTS = [25, 50, 100, 200, 400, 800, 1600, 3200]
# Each of these numbers is drawn this many times.
DRAWS = 8


class Published:
    """Grasps, labels and facts of the object of one file of ACRONYM's."""

    def __init__(self, samples: Path) -> None:
        files = [sorted(samples.glob(f"acronym/*.{ending}")) for ending in ("h5", "obj")]
        if not all(files):
            raise SystemExit(f"no acronym/*.h5 and acronym/*.obj below {samples}: see --help")
        self.mesh = files[1][0]
        with h5py.File(files[0][0]) as file:
            self.transforms = file["grasps/transforms"][:]
            self.holds = file["grasps/qualities/flex/object_in_gripper"][:] > 0
            self.scale, self.mass, self.friction = (float(file[f"object/{name}"][()]) for name in ("scale", "mass", "friction"))


def make_ours(program: Path, published: Published, runs: int, folder: Path) -> Path:
    """A dataset of grasps of the mug."""
    job = folder / "acronym.toml"
    job.write_text(f"""product = "grasps"
name = "acronym-mug"
seed = 1
hand = {{ model = "{(ROOT / "scenes/panda_hand.xml").resolve()}" }}
grasps = {{ seeds = {runs}, sampler = "antipodal" }}
antipodal = {{ support = "none" }}
keep = {{ torsion = 0.002, friction = {published.friction} }}
physics = {{ friction = {published.friction}, mass = {published.mass}, table = false }}
split = {{ validation_objects = 0, test_objects = 0 }}
[[objects]]
list = ["{published.mesh.resolve()}"]
scale = {published.scale!r}
""")
    out = folder / "data"
    run = [program, "run", job, "--out", out, "--threads", "1", "--progress", "none"]
    subprocess.run(run, check=True, stdout=subprocess.DEVNULL)
    return out


def read_ours(program: Path, data: Path, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Frames of the gripper in the object's frame, as ACRONYM has them, and whether each holds."""
    export = [program, "export", data, "--to", "acronym", "--out", folder]
    subprocess.run(export, check=True, stdout=subprocess.DEVNULL)
    with h5py.File(next(folder.glob("grasps/*.h5"))) as file:
        return file["grasps/transforms"][:], file["grasps/qualities/flex/object_in_gripper"][:] > 0


def coverage(near: np.ndarray, count: int, rng: np.random.Generator) -> float:
    """Mean share of the rows that one of `count` columns, drawn at random, is near to."""
    return float(np.mean([near[:, rng.permutation(near.shape[1])[:count]].any(axis=1).mean() for _ in range(DRAWS)]))


def print_coverage(published: Published, ours: np.ndarray) -> None:
    theirs = published.transforms[published.holds]
    near = closeness(theirs, ours, True)
    own = closeness(theirs, theirs, True)
    np.fill_diagonal(own, False)
    rng = np.random.default_rng(1)
    print(f"\n{len(theirs)} grasps of ACRONYM's mug hold; covered: within {CLOSE_DISTANCE * 100:.0f} cm and "
          f"{np.degrees(CLOSE_ANGLE):.0f} degrees")
    print(f"{'held grasps':>12}{'ours cover':>12}{'as many of ACRONYM':>20}")
    for count in [*(count for count in COUNTS if count < len(ours)), len(ours)]:
        other = f"{coverage(own, count, rng):.1%}" if count < len(theirs) else ""
        print(f"{count:>12}{coverage(near, count, rng):>12.1%}{other:>20}")
    print(f"of our {len(ours)}, {near.any(axis=0).mean():.1%} have one of ACRONYM's {len(theirs)} within that")


def print_labels(published: Published, folder: Path, each: int) -> None:
    """ACRONYM's labels beside trials of its grasps in plain MuJoCo."""
    replay, drive = import_replay(folder), json.loads((folder / "drive.json").read_text())
    told = next(folder.glob("*/grasps.json"))
    model = mujoco.MjSpec.from_file(str(told.parent / "scene.xml")).compile()
    opened = [motor["opened"] for motor in drive["motors"]]
    rng = np.random.default_rng(2)
    print(f"\nACRONYM's grasps in plain MuJoCo, {each} of either label, drawn at random")
    print(f"{'its label':<12}{'hold here':>12}{'95 %':>18}   what became of the others")
    agreed = 0
    for label in (True, False):
        verdicts = []
        for index in rng.permutation(np.flatnonzero(published.holds == label))[:each]:
            grasp = {"object_from_base": published.transforms[index][:3].ravel().tolist(), "posture": opened}
            verdicts.append(replay.Trial(model, drive, "lifted", grasp).run())
        hold = verdicts.count("held")
        agreed += hold if label else len(verdicts) - hold
        low, high = wilson(hold, len(verdicts))
        others = ", ".join(f"{verdicts.count(name)} {name}" for name in sorted(set(verdicts) - {"held"}))
        share = f"{hold} of {len(verdicts)}"
        print(f"{'holds' if label else 'fails':<12}{share:>12}{f'{low:.1%} to {high:.1%}':>18}   {others}", flush=True)
    share = published.holds.mean()
    print(f"labels agree on {agreed} of {2 * each} drawn so; {share:.1%} of all 2,000 hold in ACRONYM".replace("2,000", f"{len(published.holds):,}"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--graspmill", type=Path, required=True)
    parser.add_argument("--runs", type=int, default=100, help="runs of twenty states")
    parser.add_argument("--labels", type=int, default=100, help="grasps of either label that are tried in MuJoCo")
    arguments = parser.parse_args()
    samples = os.environ.get("GRASPMILL_SAMPLES")
    if not samples:
        print("SKIPPED: GRASPMILL_SAMPLES names no folder with ACRONYM's example (see --help)", file=sys.stderr)
        return
    program, published = arguments.graspmill.resolve(), Published(Path(samples))
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        begun = time.perf_counter()
        data = make_ours(program, published, arguments.runs, folder)
        ours, holds = read_ours(program, data, folder / "acronym")
        print(f"{arguments.runs} runs: {len(ours)} states tried, {holds.sum()} hold ({time.perf_counter() - begun:.0f} s)")
        print_coverage(published, ours[holds])
        export = [program, "export", data, "--to", "mujoco", "--out", folder / "replay", "--limit", "1"]
        subprocess.run(export, check=True, stdout=subprocess.DEVNULL)
        print_labels(published, folder / "replay", arguments.labels)


if __name__ == "__main__":
    main()
