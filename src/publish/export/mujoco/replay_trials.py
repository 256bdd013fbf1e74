#!/usr/bin/env python3
"""Repeats the trials of grasps in plain MuJoCo, and counts how often the verdict matches the stored one.

    pip install mujoco==3.17.0 numpy
    python replay.py                      every grasp here; writes agreement.json
    python replay.py 025_mug --view       one object's, in MuJoCo's viewer
    python replay.py --stored held --variant defaults
                                          those labelled held, under MuJoCo's default solver settings

`hand.xml` is the hand with a servo for each joint, `<object>/scene.xml` that hand with the object: MuJoCo's own contacts,
with the triangles of the mesh as a rigid flex (`scene_sdf.xml`: with an octree of distances, some times slower). `drive.json`
has what drives the servos and how a trial goes on, `<object>/grasps.json` the grasps and what came of each when the dataset
was made. Lengths are metres, angles radians. The hand's base is fixed: its motions are fields of acceleration, which is equivalent for motions without rotation.
"""

import argparse
import json
import math
import multiprocessing
import sys
import time
from pathlib import Path

import mujoco
import numpy as np

HERE = Path(__file__).resolve().parent
GRAVITY = 9.81
# The object's centre has left the hand while that closes [m].
PUSHED_AWAY = 0.1
# Deeper starts are not told of boxes [m].
DEEPEST_START = 0.98e-3


class Motor:
    """State of a motor. `released` is its angle when the clutch opened."""

    def __init__(self, angle, at_rest):
        self.angle, self.released = angle, None
        self.speed, self.direction = 0.0, 0.0
        self.stood, self.since_stood = at_rest, 0


class Joint:
    """A joint, its servo, and what the servo was told and did last."""

    def __init__(self, model, name, servo):
        joint, control = model.joint(name).id, model.actuator(servo).id
        self.address, self.dof = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        self.control = control
        self.stiffness, self.damping = model.actuator_gainprm[control, 0], -model.actuator_biasprm[control, 2]
        self.inertia = model.dof_M0[self.dof]
        self.told = self.torque = 0.0


class Hand:
    """The closing law: motors turn at their speed until their torque stops them; a stopped joint opens its clutch, and what
    follows it goes on alone."""

    def __init__(self, model, data, drive, posture):
        self.model, self.data, self.law, self.motors = model, data, drive["law"], drive["motors"]
        self.speed, self.torque = drive["protocol"]["speed"], drive["protocol"]["torque"]
        self.joints, self.least = {}, []
        for motor in self.motors:
            for part in [motor, *motor["followers"]]:
                self.joints[part["joint"]] = Joint(model, part["joint"], part["servo"])
                self.least.append(self.law["standing"] * self.speed * motor["speed"])
        self.states = [Motor(angle, self.law["steps_at_rest"]) for angle in posture]
        self.tell()
        for joint in self.joints.values():
            data.qpos[joint.address] = joint.told
        self.stood_at, self.at_rest_for = self.values(), 0

    def values(self):
        return np.array([self.data.qpos[joint.address] for joint in self.joints.values()])

    def tell(self):
        """Joint values of the motors, as the servos' controls."""
        for motor, state in zip(self.motors, self.states):
            value = state.angle if state.released is None else state.released
            self.joints[motor["joint"]].told = value
            for follower in motor["followers"]:
                told = follower["offset"] + follower["ratio"] * value
                if follower["alone"] and state.released is not None:
                    told += follower["alone"]["ratio"] * (state.angle - state.released)
                self.joints[follower["joint"]].told = told
        for joint in self.joints.values():
            self.data.ctrl[joint.control] = joint.told

    def moved(self, motor, state):
        """Joints that a motor moves now: motion per unit, stopping torque, and holding torque once stopped."""
        engaged = state.released is None
        if engaged:
            yield self.joints[motor["joint"]], 1.0, self.torque * motor["torque"], holds(motor)
        for follower in motor["followers"]:
            alone = follower["alone"]
            if engaged or alone:
                ratio = follower["ratio"] if engaged else alone["ratio"]
                if ratio != 0.0:
                    law = alone or motor
                    yield self.joints[follower["joint"]], ratio, self.torque * law["torque"], holds(law)

    def closed(self, motor, state):
        """The motor's angle at which the hand is closed."""
        if motor["closed"] is None:
            return state.angle
        if state.released is None:
            return motor["closed"]
        follower = next(follower for follower in motor["followers"] if follower["alone"])
        ratio = follower["alone"]["ratio"]
        stop = follower["limits"][0 if closing_sign(motor) * ratio < 0.0 else 1]
        return state.released + (stop - follower["offset"] - follower["ratio"] * state.released) / ratio

    def stop(self, motor, state, way):
        """Where a joint's torque has stopped the motor; None while it moves freely."""
        found = None
        for joint, ratio, torque, holding_torque in self.moved(motor, state):
            sign = way * math.copysign(1.0, ratio)
            pushes, angle = joint.torque * sign, None
            most = torque if state.stood < self.law["steps_at_rest"] else holding_torque
            if pushes >= most:
                held = self.data.qpos[joint.address] + sign * most / joint.stiffness
                angle = state.angle + (held - joint.told) / ratio
            elif state.stood > 0 and pushes >= self.law["holds"] * torque:
                angle = state.angle
            if angle is not None and (found is None or way * angle < way * found):
                found = angle
        return found

    def give_way(self, motor, state):
        """A joint that an open clutch has left behind gives way to more than its gears hold."""
        if state.released is not None:
            joint, closes = self.joints[motor["joint"]], closing_sign(motor)
            if closes * joint.torque > holds(motor):
                state.released = self.data.qpos[joint.address] + closes * holds(motor) / joint.stiffness

    def turn(self, motor, state):
        """A motor's next step, towards the closed hand."""
        target = self.closed(motor, state)
        way = target - state.angle
        arrived = way == 0.0
        if arrived and state.stood >= self.law["steps_at_rest"]:
            state.speed = 0.0
            return
        direction = state.direction if arrived else math.copysign(1.0, way)
        state.stood = state.stood if direction == state.direction else 0
        state.direction = direction
        self.give_way(motor, state)
        stopped = self.stop(motor, state, direction)
        if stopped is not None:
            self.move(motor, state, stopped)
            state.speed = 0.0
            most = self.law["holds"] * self.torque * motor["torque"]
            own = direction * self.joints[motor["joint"]].torque >= most and state.stood >= self.law["steps_to_open"]
            clutch = any(follower["alone"] for follower in motor["followers"])
            if direction == closing_sign(motor) and own and clutch and state.released is None:
                state.released, state.stood = state.angle, 0
            else:
                state.stood += 1
        elif arrived:
            moved = list(self.moved(motor, state))
            followed = all(
                abs(joint.told - self.data.qpos[joint.address]) * joint.stiffness < torque / self.torque
                for joint, _, torque, _ in moved
            )
            state.stood, state.speed = (state.stood + 1 if followed else 0), 0.0
        else:
            step = self.model.opt.timestep
            change = step * min(
                self.law["start"] * torque / (joint.inertia * abs(ratio))
                for joint, ratio, torque, _ in self.moved(motor, state)
            )
            speed = min(max(direction * self.speed * motor["speed"], state.speed - change), state.speed + change)
            arrives = speed * step * direction >= abs(way)
            self.move(motor, state, target if arrives else state.angle + speed * step)
            state.speed, state.stood = (0.0 if arrives else speed), 0

    @staticmethod
    def move(motor, state, angle):
        """An open clutch shuts when the motor comes back to where it left the joint."""
        if state.released is not None and closing_sign(motor) * (angle - state.released) <= 0.0:
            state.released = None
        state.angle = angle

    def step(self):
        for motor, state in zip(self.motors, self.states):
            before = state.since_stood
            self.turn(motor, state)
            state.since_stood = 0 if state.stood > 0 else before + 1
        self.tell()
        for joint in self.joints.values():
            error, speed = joint.told - self.data.qpos[joint.address], self.data.qvel[joint.dof]
            joint.torque = joint.stiffness * error - joint.damping * speed
        mujoco.mj_step(self.model, self.data)
        now = self.values()
        if np.all(np.abs(now - self.stood_at) < self.least):
            self.at_rest_for += 1
        else:
            self.stood_at, self.at_rest_for = now, 0

    def is_at_rest(self):
        steps = self.law["steps_at_rest"]
        return self.at_rest_for >= steps and all(state.since_stood < steps for state in self.states)


def holds(joint):
    """Load at which a stopped joint gives way; datasets of earlier versions have joints that never do."""
    return joint.get("holding_torque", math.inf)


def closing_sign(motor):
    if motor["closed"] is None or motor["closed"] == motor["opened"]:
        return 0.0
    return math.copysign(1.0, motor["closed"] - motor["opened"])


VARIANTS = {
    "stored": "as the dataset has them",
    "free": "nothing brakes the object while the hand closes on it",
    "defaults": "MuJoCo's default solver settings: pyramidal cones, impratio 1, no iterations against slip",
}


class Trial:
    """One grasp: closed on the free object without gravity, lifted and shaken."""

    def __init__(self, model, drive, gravity, grasp, is_free=False, show=lambda: None):
        self.is_free = is_free
        self.model, self.data, self.protocol, self.gravity = model, mujoco.MjData(model), drive["protocol"], gravity
        self.body = model.body("object").id
        joint = model.joint("object").id
        self.address, self.dof = model.jnt_qposadr[joint], model.jnt_dofadr[joint]
        base = np.array(grasp["object_from_base"]).reshape(3, 4)
        turn, place = base[:, :3].T, -base[:, :3].T @ base[:, 3]
        self.hand = Hand(model, self.data, drive, grasp["posture"])
        self.data.qpos[self.address : self.address + 3] = place
        mujoco.mju_mat2Quat(self.data.qpos[self.address + 3 : self.address + 7], turn.ravel())
        self.model.opt.gravity[:] = 0.0
        mujoco.mj_forward(model, self.data)
        self.show = show

    def place(self):
        """The object's turn and its centre of mass, seen from the hand's base."""
        turn = np.zeros(9)
        mujoco.mju_quat2Mat(turn, self.data.qpos[self.address + 3 : self.address + 7])
        turn = turn.reshape(3, 3)
        return turn, self.data.qpos[self.address : self.address + 3] + turn @ self.model.body_ipos[self.body]

    def of_object(self):
        """Contacts of the object: their numbers, and the link of the hand."""
        for number, contact in enumerate(self.data.contact):
            links = {int(self.model.body_weldid[self.model.geom_bodyid[geom]]) for geom in contact.geom if geom >= 0}
            if contact.flex.max() >= 0 or self.body in links:
                for link in links - {self.body}:
                    yield number, link

    def links(self):
        """How many links press on the object."""
        force, pressing = np.zeros(6), set()
        for number, link in self.of_object():
            mujoco.mj_contactForce(self.model, self.data, number, force)
            if force[0] > 0.0:
                pressing.add(link)
        return len(pressing)

    def step(self):
        self.hand.step()
        self.show()

    def steps(self, seconds):
        return range(round(seconds / self.model.opt.timestep))

    def carry(self, seconds, field):
        """Whether the object stays under a field of acceleration, told in its own frame at the start."""
        for step in self.steps(seconds):
            self.model.opt.gravity[:] = self.upright @ field((step + 0.5) * self.model.opt.timestep)
            self.step()
            turn, centre = self.place()
            cosine = (np.trace(self.closed_at[0].T @ turn) - 1.0) / 2.0
            turned = math.acos(min(max(cosine, -1.0), 1.0))
            moved = np.linalg.norm(centre - self.closed_at[1])
            if moved > self.protocol["lost_distance"] or turned > self.protocol["lost_angle"]:
                return False
        return True

    def run(self):
        protocol = self.protocol
        deepest = max((-self.data.contact[number].dist for number, _ in self.of_object()), default=0.0)
        if deepest > min(protocol["start_depth"], DEEPEST_START):
            return "starts_too_deep"
        self.upright, begun = self.place()
        for _ in self.steps(protocol["closing"]):
            self.step()
            # It moves back under load, and stops as soon as there is none.
            if not self.is_free:
                self.data.qvel[self.dof : self.dof + 6] = 0.0
            if self.hand.is_at_rest():
                break
            if np.linalg.norm(self.place()[1] - begun) > PUSHED_AWAY:
                return "lost_closing"
        for settled in (False,) if self.is_free else (False, True):
            if settled:
                for _ in self.steps(protocol["settling"]):
                    self.step()
                    if np.linalg.norm(self.place()[1] - begun) > PUSHED_AWAY:
                        return "lost_closing"
            links = self.links()
            if links < 2:
                return ("not_touching", "one_link")[links]
        self.closed_at = self.place()
        lost = self.six() if self.gravity == "six" else self.lift_and_shake()
        if lost:
            return lost
        return "held" if self.links() >= 2 else "let_go"

    def lift_and_shake(self):
        protocol, down = self.protocol, np.array([0.0, 0.0, -GRAVITY])
        rate = protocol["lift"] / protocol["lift_time"] ** 2

        def lift(at):
            s = at / protocol["lift_time"]
            return down - np.array([0.0, 0.0, rate * s * (60.0 + s * (-180.0 + s * 120.0))])

        turns = 2.0 * math.pi * np.array(protocol["frequencies"])
        if not self.carry(protocol["lift_time"], lift):
            return "lost_lifting"
        shake = protocol["shake"] * turns * turns
        return None if self.carry(protocol["shake_time"], lambda at: down + shake * np.sin(turns * at)) else "lost_shaking"

    def six(self):
        for axis in (2, 1, 0):
            for sign in (-1.0, 1.0):
                down = np.zeros(3)
                down[axis] = sign * GRAVITY
                if not self.carry(self.protocol["turned_time"], lambda _: down):
                    return "lost_turned"
        return None


def replay(work):
    """All grasps of an object."""
    folder, contacts, starts, variant, stored, view = work
    drive, told = (json.loads((HERE / name).read_text()) for name in ("drive.json", f"{folder}/grasps.json"))
    spec = mujoco.MjSpec.from_file(str(HERE / folder / ("scene_sdf.xml" if contacts == "sdf" else "scene.xml")))
    for mesh in spec.meshes:
        # Finer than by default; no attribute of a file sets this.
        mesh.octree_maxdepth = 8
    spec.option.sdf_initpoints = starts
    if variant == "defaults":
        spec.option.cone, spec.option.impratio, spec.option.noslip_iterations = mujoco.mjtCone.mjCONE_PYRAMIDAL, 1.0, 0
    model = spec.compile()
    found = []
    for grasp in told["grasps"]:
        if stored and grasp["expected"]["label"] != stored:
            continue
        trial = Trial(model, drive, told["gravity"], grasp, variant == "free")
        if view:
            from mujoco import viewer

            with viewer.launch_passive(model, trial.data) as window:
                trial.show = lambda: (window.sync(), time.sleep(model.opt.timestep))
                verdict = trial.run()
        else:
            verdict = trial.run()
        if sum(warning.number for warning in trial.data.warning):
            verdict = "unstable"
        found.append({"object": told["name"], "item": grasp["item"], "grasp": grasp["grasp"],
                      "stored": grasp["expected"]["verdict"], "replayed": verdict, "perturbed": grasp["expected"]["perturbed"]})
    return found


def is_sure(one):
    """Whether the dataset's own simulation has the same verdict under perturbed conditions."""
    return all((verdict == "held") == (one["stored"] == "held") for verdict in one["perturbed"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("objects", nargs="*", help="folders of objects (default: all)")
    parser.add_argument("--contacts", choices=["surface", "sdf"], default="surface", help="MuJoCo's own contacts: triangles, or distances")
    parser.add_argument("--starts", type=int, default=40, help="with sdf: points that MuJoCo begins its descents to contacts from")
    variants = "; ".join(f"{name}: {what}" for name, what in VARIANTS.items())
    parser.add_argument("--variant", choices=VARIANTS, default="stored", help=f"conditions of the trials; {variants}")
    parser.add_argument("--stored", choices=["held", "failed", "borderline", "unconfirmed", "untested", "partial", "blocked"], help="only grasps with this label")
    parser.add_argument("--processes", type=int, default=1, help="objects at a time")
    parser.add_argument("--view", action="store_true", help="show the trials in MuJoCo's viewer")
    arguments = parser.parse_args()
    folders = arguments.objects or sorted(path.parent.name for path in HERE.glob("*/grasps.json"))
    chosen = (arguments.contacts, arguments.starts, arguments.variant, arguments.stored, arguments.view)
    work = [(folder, *chosen) for folder in folders]
    found = []
    with multiprocessing.Pool(arguments.processes) if arguments.processes > 1 else Serial() as pool:
        for place, some in enumerate(pool.imap(replay, work)):
            found += some
            agreed = sum((one["stored"] == "held") == (one["replayed"] == "held") for one in found)
            print(f"{place + 1}/{len(work)} objects, {agreed} of {len(found)} grasps as stored", file=sys.stderr)
    others = [one for one in found if (one["stored"] == "held") != (one["replayed"] == "held")]
    for one in others:
        off = "" if is_sure(one) else f" (there with conditions a little off: {', '.join(one['perturbed'])})"
        print("{object}, run {item}, grasp {grasp}: {stored} in the dataset, {replayed} here".format(**one) + off)
    print(f"{len(found) - len(others)} of {len(found)} grasps held or not as in the dataset")
    sure = [sum(is_sure(one) for one in some) for some in (found, others)]
    print(f"{sure[0] - sure[1]} of the {sure[0]} whose perturbed runs all ended as they did")
    if not arguments.objects and not arguments.stored and arguments.variant == "stored":
        facts = {"root": json.loads((HERE / "export.json").read_text())["root"], "mujoco": mujoco.__version__,
                 "contacts": arguments.contacts, "replayed": len(found), "agreed": len(found) - len(others),
                 "sure": sure[0], "sure_agreed": sure[0] - sure[1], "others": others}
        (HERE / "agreement.json").write_text(json.dumps(facts, indent=2) + "\n")


class Serial:
    """One process: its own pool."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    imap = staticmethod(map)


if __name__ == "__main__":
    main()
