"""MotionBenchMaker's problems for the Fetch (C. Chamzas et al., 2022): certified paths, and coal's verdict on them.

    .deps/peers/bin/python benches/motion.py FOLDER [--each 6] [--coal 1]

FOLDER has a folder of MoveIt scenes and requests (YAML) per family. Builds the bench `motion` and prints, per family: problems,
those whose start and goal are free of contact, solved ones, median and 95th percentile of the planning time, median length and
checks. `--each` limits the problems per family; `--coal` checks the paths of that many problems per family at 1 mrad by coal, an
independent collision library: every contact is an error (exit code 1).
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import coal
import mujoco
import numpy as np
import yaml

ROOT = Path(__file__).parent.parent
SCENE = ROOT / "scenes/fetch_meshes.xml"
sys.path.insert(0, str(ROOT / "tests/peers"))
from collision import bodies  # noqa: E402

JOINTS = ["torso_lift_joint", "shoulder_pan_joint", "shoulder_lift_joint", "upperarm_roll_joint", "elbow_flex_joint",
          "forearm_roll_joint", "wrist_flex_joint", "wrist_roll_joint"]
FINGERS = ["l_gripper_finger_joint", "r_gripper_finger_joint"]
STEP = 1e-3


def rotation(quaternion):
    """The matrix of a quaternion x y z w."""
    x, y, z, w = np.array(quaternion, float) / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])


def read_problem(family: Path, number: str) -> dict:
    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    scene = yaml.load((family / f"scene{number}.yaml").read_text(), loader)
    request = yaml.load((family / f"request{number}.yaml").read_text(), loader)
    state = request["start_state"]["joint_state"]
    start = dict(zip(state["name"], state["position"]))
    goal = {row["joint_name"]: row["position"] for row in request["goal_constraints"][0]["joint_constraints"]}
    assert all(abs(start[name] - 0.05) < 1e-9 for name in FINGERS), start
    obstacles = []
    for thing in scene["world"]["collision_objects"]:
        assert not set(thing) & {"meshes", "planes"}, thing
        for shape, pose in zip(thing["primitives"], thing["primitive_poses"]):
            obstacles.append({"kind": shape["type"], "size": shape["dimensions"], "position": pose["position"],
                              "rotation": rotation(pose["orientation"]).ravel().tolist()})
    return {"family": family.name, "name": number, "obstacles": obstacles,
            "start": [start[name] for name in JOINTS], "goal": [goal[name] for name in JOINTS]}


def shape_of(obstacle):
    size = obstacle["size"]
    if obstacle["kind"] == "box":
        return coal.Box(*size)
    return coal.Cylinder(size[1], size[0]) if obstacle["kind"] == "cylinder" else coal.Sphere(size[0])


def radius_of(obstacle):
    size = np.array(obstacle["size"])
    if obstacle["kind"] == "box":
        return np.linalg.norm(size) / 2
    return np.hypot(size[0] / 2, size[1]) if obstacle["kind"] == "cylinder" else size[0]


class Coal:
    """The mesh Fetch in coal, posed by MuJoCo's kinematics."""

    def __init__(self, answer: dict):
        self.model = mujoco.MjModel.from_xml_path(str(SCENE))
        self.data = mujoco.MjData(self.model)
        self.shapes = bodies(SCENE)
        self.pairs = [tuple(pair) for pair in answer["pairs"]]
        self.moving = answer["moving"]
        self.names = sorted(self.shapes)
        self.ids = [self.model.body(name).id for name in self.names]
        self.index = {name: index for index, name in enumerate(self.names)}
        address = {name: self.model.jnt_qposadr[self.model.joint(name).id] for name in JOINTS + FINGERS}
        self.data.qpos[[address[name] for name in FINGERS]] = 0.05
        self.address = [address[name] for name in JOINTS]
        # A ball around each body, about the middle of its corners, in the body's frame.
        centre = {name: (self.shapes[name][1].min(0) + self.shapes[name][1].max(0)) / 2 for name in self.names}
        self.centres = np.array([centre[name] + self.shapes[name][2] for name in self.names])
        self.radii = np.array([np.linalg.norm(self.shapes[name][1] - centre[name], axis=1).max() for name in self.names])

    def poses(self, values):
        places, turns = np.empty((len(values), len(self.ids), 3)), np.empty((len(values), len(self.ids), 3, 3))
        for row, q in enumerate(values):
            self.data.qpos[self.address] = q
            mujoco.mj_kinematics(self.model, self.data)
            places[row], turns[row] = self.data.xpos[self.ids], self.data.xmat[self.ids].reshape(-1, 3, 3)
        return places, turns

    def contacts(self, problem: dict, path: list) -> tuple[int, int]:
        """Contacts along a path, and the configurations checked."""
        values = [np.array(path[0])]
        for start, end in zip(map(np.array, path), map(np.array, path[1:])):
            count = max(1, int(np.ceil(np.linalg.norm(end - start) / STEP)))
            values.extend(start + (end - start) * share for share in np.linspace(0, 1, count + 1)[1:])
        places, turns = self.poses(values)
        centres = places + np.einsum("nbij,bj->nbi", turns, self.centres)
        request, found = coal.CollisionRequest(), 0

        def place(name, row):
            body = self.index[name]
            return coal.Transform3s(turns[row, body], places[row, body] + turns[row, body] @ self.shapes[name][2])

        for one, two in self.pairs:
            apart = np.linalg.norm(centres[:, self.index[one]] - centres[:, self.index[two]], axis=1)
            for row in np.flatnonzero(apart <= self.radii[self.index[one]] + self.radii[self.index[two]]):
                result = coal.CollisionResult()
                found += coal.collide(self.shapes[one][0], place(one, row), self.shapes[two][0], place(two, row),
                                      request, result) > 0
        for obstacle in problem["obstacles"]:
            shape, at = shape_of(obstacle), np.array(obstacle["position"])
            pose = coal.Transform3s(np.array(obstacle["rotation"]).reshape(3, 3), at)
            for name in self.moving:
                apart = np.linalg.norm(centres[:, self.index[name]] - at, axis=1)
                for row in np.flatnonzero(apart <= self.radii[self.index[name]] + radius_of(obstacle)):
                    result = coal.CollisionResult()
                    found += coal.collide(self.shapes[name][0], place(name, row), shape, pose, request, result) > 0
        return found, len(values)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cargo", default="cargo", help="command that builds and runs the bench")
    parser.add_argument("--each", type=int, default=100, help="largest number of problems per family")
    parser.add_argument("--coal", type=int, default=1, help="problems per family that coal checks")
    parser.add_argument("--rows", type=Path, help="file for the rows of all problems")
    arguments = parser.parse_args()
    families = sorted({file.parent for file in arguments.folder.rglob("scene*.yaml")})
    problems = []
    for family in families:
        numbers = sorted(file.stem[len("scene"):] for file in family.glob("scene*.yaml"))
        problems += [read_problem(family, number) for number in numbers[:arguments.each]]
    with tempfile.TemporaryDirectory() as folder:
        question, answer = Path(folder, "problems.json"), Path(folder, "paths.json")
        question.write_text(json.dumps(problems))
        run = [*shlex.split(arguments.cargo), "bench", "--locked", "--bench", "motion", "--", question, answer]
        subprocess.run(run, check=True, cwd=ROOT)
        answer = json.loads(answer.read_text())
    if arguments.rows:
        arguments.rows.write_text(json.dumps(answer))
    rows = answer["rows"]
    print("| family | problems | valid | solved | certified | median [ms] | p95 [ms] | scene [ms] | length [rad] | checks |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in [family.name for family in families] + ["all"]:
        part = [row for row in rows if name in ("all", row["family"])]
        valid = [row for row in part if row["verdict"] not in ("StartInCollision", "GoalInCollision")]
        solved = [row for row in valid if row["verdict"] == "Found"]
        times = [row["plan_ms"] for row in valid] or [np.nan]
        median = {key: np.median([row[key] for row in solved] or [np.nan]) for key in ("length", "checks", "build_ms")}
        print(f"| {name} | {len(part)} | {len(valid)} | {len(solved)} | {sum(row['certified'] for row in solved)} "
              f"| {np.median(times):.1f} | {np.percentile(times, 95):.0f} | {median['build_ms']:.2f} "
              f"| {median['length']:.1f} | {median['checks']:.0f} |")
    kinds = sorted({row["verdict"] for row in rows})
    print({kind: sum(row["verdict"] == kind for row in rows) for kind in kinds},
          "repaired", sum(row["repairs"] > 0 for row in rows), "restarted", sum(row["restarts"] > 0 for row in rows))
    oracle, contacts, configurations, paths = Coal(answer), 0, 0, 0
    seen = {}
    for problem, row in zip(problems, rows):
        if row["verdict"] == "Found" and seen.setdefault(row["family"], 0) < arguments.coal:
            seen[row["family"]] += 1
            found, checked = oracle.contacts(problem, row["path"])
            contacts, configurations, paths = contacts + found, configurations + checked, paths + 1
            if found:
                print(f"coal: {found} contacts in {row['family']} {row['name']}")
    print(f"coal: {contacts} contacts at {configurations} configurations of {paths} paths, 1 mrad apart")
    return int(contacts > 0)


if __name__ == "__main__":
    sys.exit(main())
