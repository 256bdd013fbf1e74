"""Are graded labels calibrated? Replays in plain MuJoCo with another contact model and another motor law.

Each dataset of grasps with graded labels (`physics.labels = "ladder"`) is exported (`graspmill export --to mujoco`). A sample of its states,
spread evenly over each share of levels, is tried again with what graspmill does not use: convex parts of the object (CoACD) in place of its
triangles, MuJoCo's default contact parameters, and position servos of limited force that lead the joints, one clutch for each joint. The hand
approaches over 10 cm on its free way, the object rests free on its table under gravity from the start, and the hand's base moves on strong
slides: close, lift of 10 cm, shake. A grasp holds if the object followed the base within the limits of the dataset, and touches two links.

Prints for each hand the reliability table (share that holds by `success`, Wilson intervals), the Brier score, positives that fail and negatives
that hold. Also the Brier score of an isotonic fit on half of the
objects, tested on the other half. Needs benches/requirements.txt.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import coacd
import mujoco
import numpy as np
import numpy.typing as npt

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "python"))
import graspmill  # noqa: E402

Floats = npt.NDArray[np.float64]
GRAVITY = 9.81
TRAVEL, TRAVEL_TIME = 0.1, 1.0
CLOSING_TIME, SETTLING_TIME = 1.2, 0.2
LEAD = 1.0
"""Servos lead their joints by the deflection at this many times their largest force, so that they press with that force once stopped."""


@dataclass
class Replay:
    """A replayed state."""

    object: str
    success: float
    label: str
    lost: str
    """Phase in which the object was lost, or `""`."""

    @property
    def held(self) -> bool:
        return not self.lost


def convex_parts(path: Path, threshold: float) -> list[tuple[Floats, npt.NDArray[np.int32]]]:
    """Convex parts of an OBJ file: corners [m], triangles."""
    corners, triangles = [], []
    for line in path.read_text().splitlines():
        match line.split():
            case ["v", *numbers]:
                corners.append([float(number) for number in numbers[:3]])
            case ["f", *names]:
                triangles.append([int(name.split("/")[0]) - 1 for name in names])
    coacd.set_log_level("error")
    return list(coacd.run_coacd(coacd.Mesh(np.array(corners), np.array(triangles)), threshold=threshold, seed=1))


def scene(folder: Path, name: str, parts: list[Any], on_table: bool, friction: float) -> mujoco.MjModel:
    """Hand on three slides, the free object out of convex parts, and a table."""
    spec = mujoco.MjSpec.from_file(str(folder / "hand.xml"))
    source = mujoco.MjSpec.from_file(str(folder / name / "scene.xml"))
    spec.option.impratio, spec.option.noslip_iterations = 10.0, 3
    for equality in list(spec.equalities):
        spec.delete(equality)
    base = spec.worldbody.first_body()
    for axis, direction in zip("xyz", np.eye(3)):
        base.add_joint(name=f"base {axis}", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction, armature=10.0, damping=0.0)
        actuator = spec.add_actuator(name=f"base {axis}", target=f"base {axis}", trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.set_to_position(kp=4e5, kv=4e3)
    inertial = source.body("object")
    body = spec.worldbody.add_body(name="object", mass=inertial.mass, ipos=inertial.ipos, fullinertia=inertial.fullinertia)
    body.explicitinertial = True
    body.add_freejoint(name="object")
    for number, (corners, triangles) in enumerate(parts):
        mesh = spec.add_mesh(name=f"part {number}")
        mesh.uservert, mesh.userface = np.asarray(corners).ravel(), np.asarray(triangles).ravel()
        body.add_geom(
            name=f"part {number}", type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"part {number}", mass=0.0, priority=1, condim=4,
            friction=[friction, friction * 0.002, 0.0001], contype=2, conaffinity=5,
        )  # fmt: skip
    if on_table:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE, size=[1, 1, 0.1], priority=2, friction=[0.5, 0.001, 0.0001], condim=3, contype=4, conaffinity=2
        )
    for geom in spec.geoms:
        if geom.parent.name not in ("object", "world") and (geom.contype or geom.conaffinity):
            geom.contype, geom.conaffinity = 1, 2
            geom.solref, geom.solimp = [0.02, 1.0], [0.9, 0.95, 0.001, 0.5, 2.0]
    return spec.compile()


class Drive:
    """Servos of limited force: targets lead the joints and end at the closed hand; what blocks a joint opens its clutch."""

    def __init__(self, model: mujoco.MjModel, drive: dict, start: list[float], posture: list[float]):
        self.model, self.drive = model, drive
        self.motors = drive["motors"]
        self.now = list(start)
        self.posture = posture
        self.extra: dict[str, float] = defaultdict(float)
        self.limits: dict[str, float] = {}
        for motor in self.motors:
            self.limits[motor["joint"]] = motor["torque"]
            for follower in motor["followers"]:
                self.limits[follower["joint"]] = (follower["alone"] or motor)["torque"]
        for name, limit in self.limits.items():
            number = model.actuator(f"graspmill {name}").id
            model.actuator_forcelimited[number] = 1
            model.actuator_forcerange[number] = [-limit, limit]

    def joints(self) -> dict[str, float]:
        """Joint values at the motors' angles."""
        found = {}
        for motor, value in zip(self.motors, self.now):
            found[motor["joint"]] = value
            for follower in motor["followers"]:
                low, high = follower["limits"]
                wanted = follower["offset"] + follower["ratio"] * value + self.extra[follower["joint"]]
                found[follower["joint"]] = min(max(wanted, low), high)
        return found

    def place(self, data: mujoco.MjData) -> None:
        """Joints and servos at the motors' angles."""
        for name, value in self.joints().items():
            data.qpos[self.model.joint(name).qposadr[0]] = value
        self.tell(data)

    def tell(self, data: mujoco.MjData) -> None:
        for name, value in self.joints().items():
            data.ctrl[self.model.actuator(f"graspmill {name}").id] = value

    def lead(self, name: str) -> float:
        number = self.model.actuator(f"graspmill {name}").id
        return LEAD * self.limits[name] / float(self.model.actuator_gainprm[number, 0])

    def close(self, data: mujoco.MjData, step: float) -> None:
        """A step towards the closed hand."""
        for number, motor in enumerate(self.motors):
            if motor["closed"] is None:
                continue
            sign = math.copysign(1.0, motor["closed"] - motor["opened"])
            stride = sign * motor["speed"] * step
            at = float(data.qpos[self.model.joint(motor["joint"]).qposadr[0]])
            ahead = sign * (self.now[number] - at) >= self.lead(motor["joint"])
            if not ahead and sign * (motor["closed"] - self.now[number]) > 0.0:
                self.now[number] += stride
            for follower in motor["followers"]:
                if ahead and follower["alone"]:
                    name = follower["joint"]
                    here = float(data.qpos[self.model.joint(name).qposadr[0]])
                    stride_alone = stride * follower["alone"]["ratio"]
                    if abs(self.joints()[name] - here) < self.lead(name):
                        self.extra[name] += stride_alone
        self.tell(data)

    def hold(self) -> None:
        """Gears hold more than the motors give."""
        for motor in self.motors:
            parts = [(motor["joint"], motor), *((each["joint"], each["alone"] or motor) for each in motor["followers"])]
            for name, law in parts:
                number = self.model.actuator(f"graspmill {name}").id
                holding = law.get("holding_torque", law["torque"])
                self.model.actuator_forcerange[number] = [-holding, holding]


def pose_of(data: mujoco.MjData, model: mujoco.MjModel) -> tuple[Floats, Floats]:
    """Rotation of the object, and its centre of mass relative to the hand's base."""
    body, base = model.body("object").id, 1
    return data.xmat[body].reshape(3, 3).copy(), data.xipos[body] - data.xpos[base]


def links(model: mujoco.MjModel, data: mujoco.MjData) -> int:
    """Links of the hand that press on the object."""
    body, force, found = model.body("object").id, np.zeros(6), set()
    for number, contact in enumerate(data.contact):
        bodies = {int(model.geom_bodyid[geom]) for geom in contact.geom}
        if body in bodies and 0 not in bodies:
            mujoco.mj_contactForce(model, data, number, force)
            if force[0] > 0.0:
                found |= bodies - {body}
    return len(found)


class Trial:
    """One state: approach, close, lift and shake."""

    def __init__(self, model: mujoco.MjModel, drive: dict, grasp: dict, world_from_object: Floats | None):
        self.model, self.data, self.protocol = model, mujoco.MjData(model), drive["protocol"]
        self.on_table = world_from_object is not None
        world = np.eye(4) if world_from_object is None else world_from_object
        object_from_base, back = (
            np.vstack([np.array(grasp[key]).reshape(3, 4), [0, 0, 0, 1]]) for key in ("object_from_base", "object_from_base_pregrasp")
        )
        base = world @ object_from_base
        direction = (world @ object_from_base - world @ back)[:3, 3]
        self.start = -TRAVEL * direction / np.linalg.norm(direction)
        body = model.body(1)
        model.body_pos[body.id] = base[:3, 3]
        mujoco.mju_mat2Quat(model.body_quat[body.id], base[:3, :3].ravel())
        # Slides move along the axes of the base; targets are given in the world.
        self.world_from_base = base[:3, :3]
        address = model.joint("object").qposadr[0]
        self.data.qpos[address : address + 3] = world[:3, 3]
        mujoco.mju_mat2Quat(self.data.qpos[address + 3 : address + 7], world[:3, :3].ravel())
        self.dof = model.joint("object").dofadr[0]
        self.drive = Drive(model, drive, grasp["pregrasp"], grasp["posture"])
        self.drive.place(self.data)
        self.base(self.start, set_it=True)
        model.opt.gravity[:] = [0, 0, -GRAVITY if self.on_table else 0.0]
        model.opt.timestep = 0.002
        mujoco.mj_forward(model, self.data)

    def base(self, offset: Floats, set_it: bool = False) -> None:
        local = self.world_from_base.T @ offset
        for axis, value in zip("xyz", local):
            self.data.ctrl[self.model.actuator(f"base {axis}").id] = value
            if set_it:
                self.data.qpos[self.model.joint(f"base {axis}").qposadr[0]] = value

    def steps(self, seconds: float) -> range:
        return range(round(seconds / self.model.opt.timestep))

    def step(self) -> None:
        mujoco.mj_step(self.model, self.data)

    def followed(self) -> bool:
        rotation, centre = pose_of(self.data, self.model)
        angle = math.acos(min(max((np.trace(self.closed[0].T @ rotation) - 1.0) / 2.0, -1.0), 1.0))
        moved = float(np.linalg.norm(centre - self.closed[1]))
        return moved <= self.protocol["lost_distance"] and angle <= self.protocol["lost_angle"]

    def run(self) -> str:
        """Phase in which the object is lost, or `""` if it is held."""
        for number in self.steps(TRAVEL_TIME):
            self.base(self.start * (1.0 - (number + 1) * self.model.opt.timestep / TRAVEL_TIME))
            self.step()
        for number in self.steps(CLOSING_TIME + SETTLING_TIME):
            if number * self.model.opt.timestep < CLOSING_TIME:
                self.drive.close(self.data, self.model.opt.timestep)
            self.step()
            if not self.on_table:
                self.data.qvel[self.dof : self.dof + 6] = 0.0
        self.drive.hold()
        if links(self.model, self.data) < 2:
            return "close"
        self.model.opt.gravity[:] = [0, 0, -GRAVITY]
        self.closed = pose_of(self.data, self.model)
        protocol = self.protocol
        for number in self.steps(protocol["lift_time"]):
            s = (number + 1) * self.model.opt.timestep / protocol["lift_time"]
            self.base(np.array([0, 0, protocol["lift"] * s * s * s * (10.0 + s * (-15.0 + s * 6.0))]))
            self.step()
            if not self.followed():
                return "lift"
        turns = 2.0 * math.pi * np.array(protocol["frequencies"])
        for number in self.steps(protocol["shake_time"]):
            at = (number + 1) * self.model.opt.timestep
            # Grows from rest within a quarter of a second.
            grown = min(1.0, 4.0 * at)
            self.base(np.array([0, 0, protocol["lift"]]) + grown * protocol["shake"] * np.sin(turns * at))
            self.step()
            if not self.followed():
                return "shake"
        touches = links(self.model, self.data) >= 2 and not any(warning.number for warning in self.data.warning)
        return "" if touches else "end"


def chosen(grasps: list[dict], count: int) -> list[dict]:
    """A number of tried states, as evenly over the shares as there are some, evenly spread in each."""
    by_share: dict[float, list[dict]] = defaultdict(list)
    for grasp in grasps:
        if grasp["expected"]["success"] is not None and grasp["pregrasp"] is not None:
            by_share[grasp["expected"]["success"]].append(grasp)
    taken: list[dict] = []
    for left, some in zip(range(len(by_share), 0, -1), sorted(by_share.values(), key=len)):
        share = min(len(some), (count - len(taken)) // left)
        taken += [some[number * len(some) // share] for number in range(share)]
    return taken


def replays(dataset: Path, graspmill_program: Path, count: int, threshold: float) -> tuple[str, list[Replay]]:
    """Name of the hand, and the replayed states of a dataset."""
    poses = {}
    for name, resting in graspmill.resting_poses(dataset).items():
        poses[name] = [each.world_from_object for each in resting]
    found: list[Replay] = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "replay"
        subprocess.run([graspmill_program.resolve(), "export", dataset, "--to", "mujoco", "--out", folder], check=True, stdout=subprocess.DEVNULL)
        drive = json.loads((folder / "drive.json").read_text())
        everything = {path.parent.name: json.loads(path.read_text()) for path in sorted(folder.glob("*/grasps.json"))}
        pool = [{**grasp, "name": name} for name, told in everything.items() for grasp in told["grasps"]]
        wanted: dict[str, list[dict]] = defaultdict(list)
        for grasp in chosen(pool, count):
            wanted[grasp["name"]].append(grasp)
        for name, grasps in wanted.items():
            told = everything[name]
            parts = convex_parts(folder / name / "object.obj", threshold)
            for grasp in grasps:
                pose = grasp["expected"]["resting_pose"]
                world = None if pose is None else poses[told["name"]][pose]
                model = scene(folder, name, parts, world is not None, told["friction"])
                expected = grasp["expected"]
                replay = Replay(name, expected["success"], expected["label"], Trial(model, drive, grasp, world).run())
                found.append(replay)
                print(f"{name}: {len(parts)} parts, success {replay.success:.2f}, {replay.lost or 'held'}", file=sys.stderr, flush=True)
    return drive["hand"], found


def wilson(hits: int, count: int) -> str:
    if not count:
        return "-"
    z, share = 1.96, hits / count
    middle, spread = share + z * z / (2 * count), z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    low, high = ((middle + sign * spread) / (1 + z * z / count) for sign in (-1, 1))
    return f"{hits} of {count}, {share:.2f} [{low:.2f}, {high:.2f}]"


def isotonic(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Pool adjacent violators: distinct values, and the fitted share of each."""
    values, inverse = np.unique(x, return_inverse=True)
    blocks = [[float(y[inverse == number].sum()), int((inverse == number).sum()), 1] for number in range(len(values))]
    done: list[list[Any]] = []
    for block in blocks:
        done.append(block)
        while len(done) > 1 and done[-2][0] / done[-2][1] > done[-1][0] / done[-1][1]:
            last = done.pop()
            done[-1] = [done[-1][0] + last[0], done[-1][1] + last[1], done[-1][2] + last[2]]
    return values, np.repeat([block[0] / block[1] for block in done], [block[2] for block in done])


def summary(hand: str, found: list[Replay]) -> str:
    lines = [f"\n{hand}: {len(found)} states of {len({each.object for each in found})} objects", "| success | hold in the replay |", "| --- | --- |"]
    for share in sorted({each.success for each in found}):
        some = [each.held for each in found if each.success == share]
        lines.append(f"| {share:.2f} | {wilson(sum(some), len(some))} |")
    success, held = np.array([each.success for each in found]), np.array([float(each.held) for each in found])
    positives, negatives = ([each.held for each in found if each.label == label] for label in ("held", "failed"))
    lines.append(f"Brier {np.mean((success - held) ** 2):.3f}; positives that fail {wilson(len(positives) - sum(positives), len(positives))}; "
                 f"negatives that hold {wilson(sum(negatives), len(negatives))}")  # fmt: skip
    lost = Counter(each.lost for each in found if each.label == "held" and each.lost)
    lines.append("positives are lost in: " + (", ".join(f"{phase} {count}" for phase, count in lost.most_common()) or "none"))
    names = sorted({each.object for each in found})
    first = np.array([names.index(each.object) % 2 == 0 for each in found])
    if first.any() and not first.all():
        values, fitted = isotonic(success[first], held[first])
        told = np.interp(success[~first], values, fitted)
        lines.append(f"isotonic fit on half of the objects: Brier on the other half {np.mean((told - held[~first]) ** 2):.3f}, "
                     f"without {np.mean((success[~first] - held[~first]) ** 2):.3f}")  # fmt: skip
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("datasets", nargs="+", type=Path, help="datasets of grasps with graded labels")
    parser.add_argument("--graspmill", type=Path, default=Path("target/release/graspmill"))
    parser.add_argument("--states", type=int, default=300, help="states per dataset")
    parser.add_argument("--threshold", type=float, default=0.03, help="concavity of CoACD")
    given = parser.parse_args()
    for dataset in given.datasets:
        print(summary(*replays(dataset, given.graspmill, given.states, given.threshold)), flush=True)


if __name__ == "__main__":
    main()
