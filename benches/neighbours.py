"""Plans among neighbours as a camera sees them, and as a network completes them (Varley 2018, section 5.4.5, figure 5.8).

    neighbours.py DATA --model MODEL [--graspmill PROGRAM]

DATA is the folder of the set benches/studies/jobs/neighbours.toml: heaps on a table, one view of each, pairs of every body in it, and picks. For
each body of a heap the grasps are taken that neither the table nor the body itself forbids. A hand, wide open, comes 10 cm straight along its
axis. With coal, which is not ours, its boxes are tested among the true meshes of the neighbours and among what is believed of them: nothing,
the seen parts, several completions, and both: the seen parts and what the network makes of them. A neighbour of which no pair could be made
is not believed to be there, whatever completes the others.

A plan is one of the grasps that are believed to be free, any of them with equal chance. Printed, each with a 95 % interval by bootstrap of scenes:
  collide  share of plans that hit a neighbour in truth
  found    share of the truly free grasps that are believed to be free
  bodies   share of the bodies with a truly free grasp for which one of those believed to be free is
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "python"))
sys.path.insert(0, str(ROOT / "tests" / "peers"))

import coal
import mujoco
import numpy as np
import trimesh
from passage import model_of

import graspmill

METHODS = ("partial", "hull", "extrude", "mirror-far")
"""Ways without a network to make a closed mesh of what is seen."""
NEIGHBOUR = graspmill.PICK_OBSTACLES.index("neighbour")
CANDIDATES = 32
"""Grasps of a body that are tried, at most: taken evenly."""
STAND_OFF, STEPS = 0.10, 6
"""Way of the hand [m], and where on it it is tested."""
RESAMPLES = 2000


class Hand:
    """Boxes of a hand that is wide open, in its base's frame."""

    def __init__(self, path: Path) -> None:
        model = mujoco.MjModel.from_xml_path(str(path))
        data = mujoco.MjData(model)
        data.qpos[:] = model.jnt_range[:, 1]
        mujoco.mj_kinematics(model, data)
        assert np.all(model.geom_type == mujoco.mjtGeom.mjGEOM_BOX), "a hand out of boxes"
        self.boxes = [coal.Box(*(2 * size)) for size in model.geom_size]
        self.poses = np.tile(np.eye(4), (model.ngeom, 1, 1))
        self.poses[:, :3, :3], self.poses[:, :3, 3] = data.geom_xmat.reshape(-1, 3, 3), data.geom_xpos
        self.reach = np.linalg.norm(model.geom_size, axis=1)
        """Distance from each box's middle to its corners [m]."""


class Thing:
    """A mesh fixed in the world."""

    def __init__(self, mesh: trimesh.Trimesh, world_from_mesh: np.ndarray) -> None:
        mesh = mesh.copy()
        mesh.apply_transform(world_from_mesh)
        self.model = model_of(np.asarray(mesh.vertices), np.asarray(mesh.faces))
        self.bounds = mesh.bounds

    def is_hit(self, hand: Hand, path: np.ndarray) -> bool:
        """Whether a box of the hand touches a triangle at one of the poses (poses, 4, 4) of its base."""
        placed = path[:, None] @ hand.poses
        middles = placed[..., :3, 3]
        outside = np.maximum(np.maximum(self.bounds[0] - middles, middles - self.bounds[1]), 0.0)
        for pose, box in zip(*np.nonzero(np.linalg.norm(outside, axis=2) <= hand.reach)):
            at = coal.Transform3s(placed[pose, box, :3, :3], placed[pose, box, :3, 3])
            request, result = coal.CollisionRequest(), coal.CollisionResult()
            if coal.collide(hand.boxes[box], at, self.model, coal.Transform3s(), request, result):
                return True
        return False


def path_of(world_from_base: np.ndarray) -> np.ndarray:
    """Poses of the hand's base along its z axis, from the pregrasp to the grasp."""
    path = np.tile(world_from_base, (STEPS, 1, 1))
    path[:, :3, 3] -= np.linspace(STAND_OFF, 0.0, STEPS)[:, None] * world_from_base[:3, 2]
    return path


def completed(program: str, pairs: Path, method: list[str], folder: Path) -> dict[str, trimesh.Trimesh]:
    """Meshes of the pairs in the camera's frame, by the samples' names."""
    subprocess.run([program, "complete", str(pairs), *method, "--out", str(folder)], check=True, stdout=subprocess.DEVNULL)
    samples = json.loads((folder / "samples.json").read_text())["samples"]
    return {row["sample"]: trimesh.load(folder / row["mesh"], process=False) for row in samples if row["mesh"]}


def name_of(sample: graspmill.SampleId) -> str:
    """Name of a sample, as `graspmill complete` lists it."""
    return f"{sample.subject[:16]}.{sample.item}.{sample.instance}.{sample.camera}"


def ratios(rows: np.ndarray) -> np.ndarray:
    """Ratio of the sums of the two columns of `rows` (scenes, 2), and the same of bootstrap samples of the scenes."""
    draws = np.random.default_rng(0).integers(0, len(rows), (RESAMPLES, len(rows)))
    sums = np.concatenate([rows.sum(0)[None], rows[draws].sum(1)])
    return sums[:, 0] / sums[:, 1]


def words(values: np.ndarray, sign: str = "") -> str:
    """A value, followed by those of bootstrap samples: with its interval."""
    low, high = np.quantile(values[1:], (0.025, 0.975))
    return f"{values[0]:{sign}.3f} [{low:{sign}.3f}, {high:{sign}.3f}]"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--model", type=Path, required=True, help="folder of a model that completes pairs in clutter")
    parser.add_argument("--hand", type=Path, default=ROOT / "scenes" / "panda_hand.xml")
    parser.add_argument("--graspmill", default=str(ROOT / "target" / "release" / "graspmill"))
    arguments = parser.parse_args()
    hand = Hand(arguments.hand)
    views = list(graspmill.Dataset(arguments.data / "views", graspmill.ViewSample))
    pairs = {
        (pair.id.subject, pair.id.instance): (name_of(pair.id), pair.pair.world_from_camera)
        for pair in graspmill.Dataset(arguments.data / "amodal", graspmill.AmodalSample)
    }
    meshes = {
        mesh.object: trimesh.Trimesh(mesh.vertices.astype(float), mesh.triangles, process=False)
        for mesh in graspmill.object_meshes(arguments.data / "views").values()
    }
    scenes: dict[str, list[graspmill.PickSample]] = {}
    for pick in graspmill.Dataset(arguments.data / "picks", graspmill.PickSample):
        scenes.setdefault(pick.id.subject, []).append(pick)
    with tempfile.TemporaryDirectory() as temporary:
        beliefs = {
            name: completed(arguments.graspmill, arguments.data / "amodal", option, Path(temporary) / name)
            for name, option in {
                **{method: ["--method", method] for method in METHODS},
                "network": ["--model", str(arguments.model)],
            }.items()
        }
    names = ["nothing", *beliefs, "both"]
    collide, found, bodies = ({name: [] for name in names} for _ in range(3))
    tried, agreed, unseen, known = 0, 0, 0, 0
    for view in views:
        subject = view.id.subject
        truth = [Thing(meshes[digest], pose) for digest, pose in zip(view.objects, view.world_from_object)]
        believed: dict[str, dict[int, list[Thing]]] = {"nothing": {}}
        for name, parts in beliefs.items():
            believed[name] = {}
            for body in range(1, len(truth) + 1):
                sample, world_from_camera = pairs.get((subject, body), ("", None))
                if sample in parts:
                    believed[name][body] = [Thing(parts[sample], world_from_camera)]
        seen, added = believed["partial"], believed["network"]
        believed["both"] = {body: seen.get(body, []) + added.get(body, []) for body in seen.keys() | added.keys()}
        known += len(believed["partial"])
        unseen += len(truth) - len(believed["partial"])
        sums = {name: np.zeros((3, 2)) for name in names}
        for pick in scenes.get(subject, []):
            clear = np.nonzero((pick.verdicts == 0) | (pick.verdicts == NEIGHBOUR))[0]
            if not len(clear):
                continue
            chosen = clear[np.unique(np.linspace(0, len(clear) - 1, min(CANDIDATES, len(clear))).round().astype(int))]
            paths = [path_of(pose) for pose in pick.world_from_base[chosen]]
            others = [thing for body, thing in enumerate(truth, 1) if body != pick.body]
            free = np.array([not any(thing.is_hit(hand, path) for thing in others) for path in paths])
            tried += len(free)
            agreed += int((free == (pick.verdicts[chosen] == 0)).sum())
            for name in names:
                around = [thing for body, things in believed[name].items() if body != pick.body for thing in things]
                clear_of = np.array([not any(thing.is_hit(hand, path) for thing in around) for path in paths])
                if clear_of.any():
                    sums[name][0] += (~free[clear_of]).mean(), 1
                if free.any():
                    sums[name][1] += (free & clear_of).sum(), free.sum()
                    sums[name][2] += (free & clear_of).any(), 1
        for name in names:
            for rows, counts in zip((collide, found, bodies), sums[name]):
                rows[name].append(counts)
    print(f"{len(views)} heaps, {known} bodies believed to be there, {unseen} not; {tried} grasps of them")
    print(f"picks and coal agree on {agreed / tried:.3f} of these grasps (picks opens the hand no wider than it must)")
    print(f"{'believed':12} {'plans':>5}  {'collide':24} {'found':24} {'bodies':24}")
    measured = {name: [ratios(np.array(rows[name])) for rows in (collide, found, bodies)] for name in names}
    for name, values in measured.items():
        plans = int(np.array(collide[name])[:, 1].sum())
        print(f"{name:12} {plans:5}  " + " ".join(f"{words(value):24}" for value in values))
    print("beside the seen parts alone, heap by heap")
    for name in names[2:]:
        differences = [value - seen for value, seen in zip(measured[name], measured["partial"])]
        print(f"{name:12} {'':5}  " + " ".join(f"{words(value, '+'):24}" for value in differences))


main()
