"""Do labels by physics teach a network more than labels by an analytic gate? By what its best grasp does in plain MuJoCo.

A small network (points into features, their maximum, after Qi, Su, Mo and Guibas 2017, "PointNet") rates grasps: it sees the
object's points around the hand, expressed in the hand's approach frame, and the posture in which the hand begins to close.
It learns twice from the same grasps of the training objects, with the same first weights, order and number of steps:

  gate      positive is what the analytic verdict keeps, negative everything else, as in datasets before physics judged
  trials    positive is the label held, negative the label failed; borderline and untested grasps are left out. In datasets
            without labels: the trial in the air, or with --table that on the table

Each network then rates all states of each held-out object (split test). Its choice and the best five (with --runs also the
best of each run) are tried in plain MuJoCo by the export's own `replay.py`, with MuJoCo's contacts. Success is compared object by object, the
mean of the seeds; the interval is a bootstrap over objects. Beside them: the lowest energy, the highest epsilon, and grasps
drawn at random.

PyTorch on the CPU. Run by `make bench-grasp-classifier`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import nn

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))
from graspmill import Dataset, GraspSample, object_meshes  # noqa: E402

# Points of each object, points of each grasp's crop, and how many of these a network sees at a time.
CLOUD, CROP, SEEN = 8192, 256, 128
# Half the sides of the box that is cropped around the hand, and its ends along the approach [m].
ACROSS, BEHIND, BEFORE = 0.11, 0.06, 0.15
PEAK_RATE = 3e-3
TOP = 5
# Numbers of labels, as trials.proto has them.
HELD, FAILED = 2, 3
# Choices at random, for their mean.
DRAWS = 2
LABELS = ("gate", "trials")
GRIPPERS = ("panda_hand", "fetch_gripper", "parallel_gripper")


@dataclass
class Grasps:
    """States of a split, row by row."""

    objects: np.ndarray
    runs: np.ndarray
    crops: np.ndarray
    """(n, CROP, 6): points [0.1 m] and normals in the approach frame."""
    postures: np.ndarray
    bases: np.ndarray
    """(n, 12): the hand's base in the object's frame."""
    gate: np.ndarray
    trials: np.ndarray
    """1 held, 0 failed, -1 not tried."""
    energies: np.ndarray
    epsilons: np.ndarray

    def label(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Rows that have this label, and the labels."""
        labels = getattr(self, name)
        rows = np.flatnonzero(labels >= 0)
        return rows, labels[rows]


def cloud_of(mesh, seed: int) -> np.ndarray:
    """Points drawn uniformly by area, with their normals: (CLOUD, 6)."""
    rng = np.random.default_rng(seed)
    corners = mesh.vertices[mesh.triangles].astype(np.float64)
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(crosses, axis=1)
    chosen = rng.choice(len(areas), CLOUD, p=areas / areas.sum())
    first, second = rng.random((2, CLOUD, 1))
    over = first + second > 1.0
    first, second = np.where(over, 1.0 - first, first), np.where(over, 1.0 - second, second)
    base, one, two = (corners[chosen, index] for index in range(3))
    points = base + first * (one - base) + second * (two - base)
    return np.hstack([points, crosses[chosen] / areas[chosen, None]])


def crop(cloud: np.ndarray, object_from_approach: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Points around the hand, in its approach frame; zeros where there are none."""
    rotation, origin = object_from_approach[:3, :3], object_from_approach[:3, 3]
    points = (cloud[:, :3] - origin) @ rotation
    inside = (np.abs(points[:, :2]) < ACROSS).all(axis=1) & (points[:, 2] > -BEHIND) & (points[:, 2] < BEFORE)
    near = np.flatnonzero(inside)
    if not len(near):
        return np.zeros((CROP, 6), np.float32)
    some = rng.choice(near, CROP, replace=len(near) < CROP)
    return np.hstack([10.0 * points[some], cloud[some, 3:] @ rotation]).astype(np.float32)


def read(folder: Path, split: str, clouds: dict[str, np.ndarray], on_table: bool) -> Grasps:
    data = Dataset(folder, GraspSample, split=split)
    names = data.column("object")
    parts: dict[str, list] = {name: [] for name in Grasps.__dataclass_fields__}
    for number, (name, sample) in enumerate(zip(names, data)):
        rng = np.random.default_rng(number)
        grasps, trials = sample.grasps, sample.trials
        outcome = np.full(len(grasps), -1)
        labels = np.array([trial.get("label", 0) for trial in sample.message("trials")["trials"]], int)
        if labels.any() and not on_table:
            # In datasets with labels: the label from all trials of a grasp; borderline and untested ones are left out.
            outcome[trials["grasp"][labels == HELD]], outcome[trials["grasp"][labels == FAILED]] = 1, 0
        elif on_table:
            tried = trials[trials["table_pose"] >= 0]
            outcome[tried["grasp"]] = tried["held_on_table"]
        else:
            outcome[trials["grasp"]] = trials["verdict"] == 0
        for row, grasp in enumerate(grasps):
            parts["objects"].append(str(name))
            parts["runs"].append(number)
            parts["crops"].append(crop(clouds[str(name)], grasp["object_from_approach"], rng))
            parts["postures"].append(grasp["posture"])
            parts["bases"].append(grasp["object_from_base"][:3].ravel())
            parts["gate"].append(int(grasp["verdict"] == 0))
            parts["trials"].append(int(outcome[row]))
            parts["energies"].append(grasp["energy"])
            parts["epsilons"].append(grasp["epsilon_wrench"])
    return Grasps(**{name: np.array(values) for name, values in parts.items()})


class Classifier(nn.Module):
    """Logit of success from points around the hand and its posture."""

    def __init__(self, joints: int) -> None:
        super().__init__()
        self.point = nn.Sequential(nn.Linear(6, 48), nn.ReLU(), nn.Linear(48, 96), nn.ReLU(), nn.Linear(96, 128))
        self.head = nn.Sequential(nn.Linear(128 + joints, 64), nn.ReLU(), nn.Dropout(0.2), nn.Linear(64, 1))

    def forward(self, points: torch.Tensor, posture: torch.Tensor) -> torch.Tensor:
        """(n, points, 6) and (n, joints) to (n)."""
        return self.head(torch.cat([self.point(points).amax(dim=1), posture], dim=1)).squeeze(1)


def learn(grasps: Grasps, label: str, is_gripper: bool, steps: int, batch: int, seed: int) -> Classifier:
    """A network trained on those labels; first weights and order follow from the seed alone."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    rows, labels = grasps.label(label)
    network = Classifier(grasps.postures.shape[1])
    optimiser = torch.optim.Adam(network.parameters(), weight_decay=1e-4, fused=True)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, PEAK_RATE, total_steps=steps)
    crops, postures = torch.from_numpy(grasps.crops[rows]), torch.from_numpy(grasps.postures[rows].astype(np.float32))
    targets = torch.from_numpy(labels.astype(np.float32))
    # Either answer counts as much as the other, whatever its share.
    share = float(targets.mean())
    weights = torch.where(targets > 0.5, 0.5 / max(share, 1e-3), 0.5 / max(1.0 - share, 1e-3))
    for _ in range(steps):
        some = torch.from_numpy(rng.integers(len(rows), size=batch))
        points = crops[some][:, torch.from_numpy(rng.permutation(CROP)[:SEEN])]
        if is_gripper:
            # Turned about its approach by 180 degrees it is the same gripper.
            turned = torch.from_numpy(rng.random(batch) < 0.5)
            signs = torch.tensor([-1.0, -1.0, 1.0, -1.0, -1.0, 1.0])
            points = torch.where(turned[:, None, None], points * signs, points)
        points = points + torch.from_numpy(rng.normal(0.0, [0.01] * 3 + [0.0] * 3, (batch, SEEN, 6)).astype(np.float32))
        loss = nn.functional.binary_cross_entropy_with_logits(network(points, postures[some]), targets[some], weights[some])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        schedule.step()
    return network.eval()


@torch.no_grad()
def rate(network: Classifier, grasps: Grasps) -> np.ndarray:
    crops, postures = torch.from_numpy(grasps.crops), torch.from_numpy(grasps.postures.astype(np.float32))
    return network(crops, postures).numpy()


def area_under_curve(scores: np.ndarray, labels: np.ndarray) -> float:
    ranks = np.argsort(np.argsort(scores)) + 1.0
    positive = labels == 1
    count = positive.sum()
    return float((ranks[positive].sum() - count * (count + 1) / 2) / max(count * (len(labels) - count), 1))


@dataclass
class Picks:
    """Rows that a rater chooses of each object."""

    best: dict[str, np.ndarray]
    five: dict[str, np.ndarray]
    by_run: dict[str, np.ndarray]

    @classmethod
    def of(cls, scores: np.ndarray, grasps: Grasps) -> Picks:
        best, five, by_run = {}, {}, {}
        for name in np.unique(grasps.objects):
            rows = np.flatnonzero(grasps.objects == name)
            order = rows[np.argsort(-scores[rows], kind="stable")]
            best[name], five[name] = order[:1], order[:TOP]
            runs = grasps.runs[order]
            by_run[name] = order[np.unique(runs, return_index=True)[1]]
        return cls(best, five, by_run)

    def rows(self, by_run: bool, top: int = TOP) -> set[int]:
        rows = {int(row) for some in self.five.values() for row in some[:top]}
        return rows | {int(row) for some in self.by_run.values() for row in some if by_run}


def bootstrap(differences: np.ndarray) -> tuple[float, float]:
    """95 % interval of a mean, over objects."""
    rng = np.random.default_rng(0)
    means = differences[rng.integers(len(differences), size=(10_000, len(differences)))].mean(axis=1)
    return float(np.quantile(means, 0.025)), float(np.quantile(means, 0.975))


def successes(raters: list[Picks], what: str, held: dict[int, bool]) -> np.ndarray:
    """Share of the chosen that hold, by object; the mean of the raters."""
    by_rater = [[np.mean([held[int(row)] for row in rows]) for _, rows in sorted(getattr(rater, what).items())] for rater in raters]
    return np.mean(by_rater, axis=0)


def try_rows(program: Path, python: Path, folder: Path, grasps: Grasps, rows: list[int]) -> dict[int, bool]:
    """Whether each holds in plain MuJoCo."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "replay"
        export = [program, "export", folder, "--to", "mujoco", "--out", out, "--split", "test"]
        subprocess.run(export, check=True, stdout=subprocess.DEVNULL)
        chosen = [{"object": grasps.objects[row], "object_from_base": grasps.bases[row].tolist(),
                   "posture": grasps.postures[row].tolist()} for row in rows]
        tried = subprocess.run([python, Path(__file__).parent / "replay_chosen.py", out], input=json.dumps(chosen),
                               check=True, stdout=subprocess.PIPE, text=True)
    return {row: verdict == "held" for row, verdict in zip(rows, json.loads(tried.stdout))}


def compare(folder: Path, arguments: argparse.Namespace) -> None:
    clouds = {name: cloud_of(mesh, number) for number, (name, mesh) in enumerate(sorted(object_meshes(folder).items()))}
    training, test = (read(folder, split, clouds, arguments.table) for split in ("training", "test"))
    hand = Dataset(folder, GraspSample)[0].run["hand"]
    print(f"\n{hand}: {len(np.unique(training.objects))} objects with {len(training.gate)} states to learn from, "
          f"{len(np.unique(test.objects))} with {len(test.gate)} to choose from")
    raters: dict[str, list[Picks]] = {}
    for label in LABELS:
        rows, labels = training.label(label)
        begun, curves = time.process_time(), []
        raters[label] = []
        for seed in range(arguments.seeds):
            network = learn(training, label, hand in GRIPPERS, arguments.steps, arguments.batch, seed)
            scores = rate(network, test)
            raters[label].append(Picks.of(scores, test))
            known, truth = test.label("trials")
            curves.append(area_under_curve(scores[known], truth))
        print(f"  {label}: {labels.mean():.1%} of {len(rows)} labels are positive; area under the curve of stored trials "
              f"{np.mean(curves):.3f} ({time.process_time() - begun:.0f} CPU s)", flush=True)
    # The best alone of the choices that do not learn is tried.
    plain = {}
    plain["lowest energy"] = [Picks.of(-test.energies, test)]
    plain["highest epsilon"] = [Picks.of(test.epsilons, test)]
    draws = [np.random.default_rng(seed).random(len(test.gate)) for seed in range(DRAWS)]
    plain["at random"] = [Picks.of(scores, test) for scores in draws]
    chosen = [picks.rows(arguments.runs) for some in raters.values() for picks in some]
    chosen += [picks.rows(False, 1) for some in plain.values() for picks in some]
    rows = sorted(set().union(*chosen))
    held = try_rows(arguments.graspmill.resolve(), arguments.python.absolute(), folder, test, rows)
    print(f"  {len(rows)} chosen grasps tried in plain MuJoCo, {sum(held.values())} hold")
    kinds = {"best": "its best", "five": f"best {TOP}", "by_run": "best of each run"}
    if not arguments.runs:
        del kinds["by_run"]
    print(f"  {'chosen by':<18}" + "".join(f"{told:>18}" for told in kinds.values()))
    for name, some in {**raters, **plain}.items():
        shares = [f"{successes(some, what, held).mean():.1%}" for what in (kinds if name in raters else ["best"])]
        print(f"  {name:<18}" + "".join(f"{share:>18}" for share in shares))
    for what, told in kinds.items():
        differences = successes(raters["trials"], what, held) - successes(raters["gate"], what, held)
        low, high = bootstrap(differences)
        better, worse = int((differences > 0).sum()), int((differences < 0).sum())
        print(f"  trials - gate, {told}: {differences.mean():+.3f} [{low:+.3f}, {high:+.3f}]; better on {better} objects, "
              f"worse on {worse} of {len(differences)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("datasets", nargs="+", type=Path, help="datasets of grasps with trials and a test split")
    parser.add_argument("--graspmill", type=Path, required=True)
    parser.add_argument("--python", type=Path, default=ROOT / ".deps/venv/bin/python", help="a Python that has MuJoCo")
    parser.add_argument("--table", action="store_true", help="learn from trials on the table instead of in the air")
    parser.add_argument("--runs", action="store_true", help="also try the best grasp of each run")
    parser.add_argument("--steps", type=int, default=1500)
    parser.add_argument("--batch", type=int, default=64)
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    torch.set_num_threads(1)
    for folder in arguments.datasets:
        compare(folder, arguments)


if __name__ == "__main__":
    main()
