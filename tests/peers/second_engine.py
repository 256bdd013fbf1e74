"""Tries grasps of `graspmill export --to mujoco` in a second physics engine: Drake.

    python second_engine.py FOLDER [--each 50] [--by-success] [--json]

Nothing of MuJoCo's physics is used: MuJoCo reads `hand.xml` (bodies, axes, primitives) and steps nothing. Drake solves
contacts as pressure fields over surfaces (hydroelastic contact) of the true, not convex, mesh with slightly soft
primitives of the hand, by its own convex solver (SAP). The hand closes by position drives whose forces are limited:
each motor moves its joints at its speed until one of them resists with its torque; from then on the drives bear the
holding torque. Where a motor's clutch opens, its leading joint stays and only the follower moves on.

There is no table here: the object floats without gravity and is braked while the hand closes; then the hand
lets go of the brake, gravity comes on along -z of the mesh, the hand lifts by 10 cm and shakes. A grasp holds when the
object stays within the protocol's distance and angle of where it was in the closed hand, with two links on it at the end.
"""

import argparse
import json
import math
import sys
import xml.etree.ElementTree
from pathlib import Path

import mujoco
import numpy as np
from pydrake.common.value import Value
from pydrake.geometry import (
    AddCompliantHydroelasticProperties,
    AddContactMaterial,
    AddRigidHydroelasticProperties,
    Box,
    Capsule,
    CollisionFilterDeclaration,
    Cylinder,
    Ellipsoid,
    GeometrySet,
    HydroelasticContactRepresentation,
    Mesh,
    ProximityProperties,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce, SpatialVelocity
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    CoulombFriction,
    DiscreteContactApproximation,
    ExternallyAppliedSpatialForce,
)
from pydrake.multibody.tree import (
    FixedOffsetFrame,
    PdControllerGains,
    PrismaticJoint,
    RevoluteJoint,
    RotationalInertia,
    SpatialInertia,
)
from pydrake.common.eigen_geometry import Quaternion
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

GRAVITY = 9.81
STEP = 2e-3
# Hard rubber: 70 N on a pad of 5 cm^2 press it in by some hundredths of a millimetre.
MODULUS = 5e7
DISSIPATION = 1.0
# Length of the edges by which round primitives become meshes [m].
EDGE = 0.004
# The object's centre has left the hand while that closes [m].
PUSHED_AWAY = 0.1
# A leading joint that resists for this long opens its clutch, and a hand whose motors all rest for this long is closed [s].
OPENS, RESTS = 0.02, 0.05
# A motor starts with this part of its torque, so that its own inertia is not taken for resistance.
STARTS = 0.2


class Joint:
    """A joint of the hand, its drive, and what the drive is told."""

    def __init__(self, joint, actuator, gains, inertia):
        self.joint, self.actuator, self.inertia = joint, actuator, inertia
        self.stiffness, self.damping = gains.p, gains.d
        self.told = self.speed = 0.0

    def resistance(self, position, speed):
        """Force that its drive would give, were it not limited."""
        return self.stiffness * (self.told - position) + self.damping * (self.speed - speed)


class Hand:
    """The hand of `hand.xml` in a plant, with a force-limited position drive for each joint."""

    def __init__(self, plant, folder, drive, friction):
        model = mujoco.MjModel.from_xml_path(str(folder / "hand.xml"))
        limits = {}
        for motor in drive["motors"]:
            limits[motor["joint"]] = motor.get("holding_torque") or motor["torque"]
            for follower in motor["followers"]:
                law = follower["alone"] or motor
                limits[follower["joint"]] = law.get("holding_torque") or law["torque"]
        self.plant, self.instance = plant, plant.AddModelInstance("hand")
        self.bodies, self.joints, self.link = {}, {}, {}
        for body in range(1, model.nbody):
            self.add_body(model, body, limits)
        for geom in range(model.ngeom):
            self.add_geom(model, geom, friction)
        for motor in drive["motors"]:
            for follower in motor["followers"]:
                # What has no clutch is one gear train.
                if not follower["alone"]:
                    own, leads = (self.joints[part["joint"]].joint for part in (follower, motor))
                    plant.AddCouplerConstraint(own, leads, follower["ratio"], follower["offset"])

    def add_body(self, model, body, limits):
        plant, name = self.plant, model.body(body).name
        mass = max(float(model.body_mass[body]), 1e-6)
        turn = RotationMatrix(Quaternion(model.body_iquat[body])).matrix()
        inertia = turn @ np.diag(np.maximum(model.body_inertia[body], 1e-10)) @ turn.T
        about = RotationalInertia(*inertia.diagonal(), inertia[0, 1], inertia[0, 2], inertia[1, 2])
        spatial = SpatialInertia.MakeFromCentralInertia(mass, model.body_ipos[body], about)
        added = plant.AddRigidBody(name, self.instance, spatial)
        self.bodies[body], self.link[added.index()] = added, int(model.body_weldid[body])
        parent = int(model.body_parentid[body])
        frame = self.bodies[parent].body_frame() if parent else plant.world_frame()
        place = RigidTransform(Quaternion(model.body_quat[body]), model.body_pos[body])
        if not model.body_jntnum[body]:
            plant.WeldFrames(frame, added.body_frame(), place)
            return
        number = int(model.body_jntadr[body])
        joint_name = model.joint(number).name
        mount = plant.AddFrame(FixedOffsetFrame(f"mount {joint_name}", frame, place))
        own = FixedOffsetFrame(f"own {joint_name}", added.body_frame(), RigidTransform(model.jnt_pos[number]))
        mount = plant.AddFrame(FixedOffsetFrame(f"axis {joint_name}", mount, RigidTransform(model.jnt_pos[number])))
        slides = model.jnt_type[number] == mujoco.mjtJoint.mjJNT_SLIDE
        kind, dof = PrismaticJoint if slides else RevoluteJoint, model.jnt_dofadr[number]
        lower, upper = model.jnt_range[number] if model.jnt_limited[number] else (-math.inf, math.inf)
        made = kind(joint_name, mount, plant.AddFrame(own), model.jnt_axis[number], lower, upper, model.dof_damping[dof])
        joint = plant.AddJoint(made)
        drive = next(number_of for number_of in range(model.nu) if model.actuator_trnid[number_of, 0] == number
                     and model.actuator(number_of).name.startswith("graspmill"))
        actuator = plant.AddJointActuator(joint_name, joint, float(limits[joint_name]))
        inertia = float(model.dof_armature[dof])
        actuator.set_default_rotor_inertia(inertia)
        actuator.set_default_gear_ratio(1.0)
        gains = PdControllerGains(p=float(model.actuator_gainprm[drive, 0]), d=-float(model.actuator_biasprm[drive, 2]))
        actuator.set_controller_gains(gains)
        self.joints[joint_name] = Joint(joint, actuator, gains, inertia)

    def add_geom(self, model, geom, friction):
        if not model.geom_contype[geom] and not model.geom_conaffinity[geom]:
            return
        kinds, size = mujoco.mjtGeom, model.geom_size[geom]
        shapes = {
            kinds.mjGEOM_BOX: lambda: Box(*(2.0 * size)),
            kinds.mjGEOM_SPHERE: lambda: Sphere(size[0]),
            kinds.mjGEOM_CAPSULE: lambda: Capsule(size[0], 2.0 * size[1]),
            kinds.mjGEOM_CYLINDER: lambda: Cylinder(size[0], 2.0 * size[1]),
            kinds.mjGEOM_ELLIPSOID: lambda: Ellipsoid(*size),
        }
        shape = shapes.get(mujoco.mjtGeom(model.geom_type[geom]))
        if shape is None:
            raise SystemExit(f"{model.geom(geom).name or geom}: links that touch with meshes are not read here")
        material = ProximityProperties()
        AddCompliantHydroelasticProperties(EDGE, MODULUS, material)
        AddContactMaterial(dissipation=DISSIPATION, friction=CoulombFriction(friction, friction), properties=material)
        place = RigidTransform(Quaternion(model.geom_quat[geom]), model.geom_pos[geom])
        self.plant.RegisterCollisionGeometry(self.bodies[int(model.geom_bodyid[geom])], place, shape(), f"geom {geom}", material)


class Motor:
    """A motor's value, as it turns its joints at its speed until one resists with its torque."""

    def __init__(self, told, hand, value):
        self.told, self.hand, self.value = told, hand, value
        self.released, self.speed, self.resisted, self.rested = None, 0.0, 0.0, 0.0
        closes = 0.0 if told["closed"] is None else told["closed"] - told["opened"]
        self.way = math.copysign(1.0, closes) if closes else 0.0
        self.alone = next((follower for follower in told["followers"] if follower["alone"]), None)

    def commands(self, value):
        """Joints that move with the motor: their values, and the torques that stop them."""
        if self.released is None:
            yield self.told["joint"], value, self.told["torque"]
            for follower in self.told["followers"]:
                torque = (follower["alone"] or self.told)["torque"]
                yield follower["joint"], follower["offset"] + follower["ratio"] * value, torque
        else:
            start = self.alone["offset"] + self.alone["ratio"] * self.released
            alone = start + self.alone["alone"]["ratio"] * (value - self.released)
            yield self.alone["joint"], min(max(alone, self.alone["limits"][0]), self.alone["limits"][1]), self.alone["alone"]["torque"]

    def tell(self):
        for name, value, _ in self.commands(self.value):
            self.hand.joints[name].told = value

    def turn(self, state):
        """The next step towards the closed hand; `state` has position and speed of each joint."""
        end = self.told["closed"] if self.released is None else math.inf * self.way
        left = self.way * (end - self.value) if self.way else 0.0
        moved = [(self.hand.joints[name], *state[name], torque) for name, _, torque in self.commands(self.value)]
        before = {name: value for name, value, _ in self.commands(self.value)}
        after = {name: value for name, value, _ in self.commands(self.value + self.way * min(self.told["speed"] * STEP, left))}
        ways = {name: np.sign(after[name] - before[name]) for name in before}
        if not any(ways.values()):
            self.stop(state)
            return
        resisting = [joint.joint.name() for joint, position, speed, torque in moved
                     if ways[joint.joint.name()] * joint.resistance(position, speed) >= torque]
        if resisting:
            self.stop(state)
            # A leading joint that its own torque stops opens the clutch.
            if self.alone and self.released is None and self.told["joint"] in resisting:
                self.resisted += STEP
                if self.resisted >= OPENS:
                    self.released, self.rested = self.value, 0.0
            return
        ratios = {name: abs(after[name] - before[name]) / (self.told["speed"] * STEP) for name in before}
        change = min(STARTS * torque / (joint.inertia * max(ratios[joint.joint.name()], 1e-3)) for joint, _, _, torque in moved)
        self.speed = min(self.told["speed"], self.speed + change * STEP)
        self.value += self.way * min(self.speed * STEP, left)
        self.resisted = self.rested = 0.0
        self.drive()

    def stop(self, state):
        self.speed, self.rested = 0.0, self.rested + STEP
        self.drive()

    def drive(self):
        """Tells the joints where to be, and how fast that changes."""
        for name, value, _ in self.commands(self.value):
            joint = self.hand.joints[name]
            joint.speed, joint.told = (value - joint.told) / STEP, value


class World:
    """A hand and an object that floats before it."""

    def __init__(self, folder, name, drive):
        self.drive, self.protocol = drive, drive["protocol"]
        told = json.loads((folder / name / "grasps.json").read_text())
        friction = told["friction"]
        builder = DiagramBuilder()
        self.plant, scene = AddMultibodyPlantSceneGraph(builder, time_step=STEP)
        plant = self.plant
        plant.set_contact_model(ContactModel.kHydroelastic)
        plant.set_contact_surface_representation(HydroelasticContactRepresentation.kPolygon)
        plant.set_discrete_contact_approximation(DiscreteContactApproximation.kLagged)
        plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, 0.0])
        self.hand = Hand(plant, folder, drive, friction)
        self.add_object(folder / name, friction)
        plant.Finalize()
        # Links are kept apart by their drives, not by their shapes, which overlap where they are joined.
        links = GeometrySet([shape for body in self.hand.bodies.values() for shape in plant.GetCollisionGeometriesForBody(body)])
        scene.collision_filter_manager().Apply(CollisionFilterDeclaration().ExcludeWithin(links))
        diagram = builder.Build()
        self.simulator = Simulator(diagram)
        self.root = self.simulator.get_mutable_context()
        self.context = plant.GetMyMutableContextFromRoot(self.root)
        self.shape_of = {shape: body for body in self.hand.bodies.values() for shape in plant.GetCollisionGeometriesForBody(body)}
        self.bodies = [(body, body.default_mass(), body.default_com()) for body in [*self.hand.bodies.values(), self.object]]
        self.order = sorted(self.hand.joints.values(), key=lambda joint: joint.actuator.index())

    def add_object(self, folder, friction):
        inertial = xml.etree.ElementTree.parse(folder / "scene.xml").find(".//body[@name='object']/inertial")
        self.mass = float(inertial.get("mass"))
        self.centre = np.array(inertial.get("pos").split(), float)
        about = RotationalInertia(*map(float, inertial.get("fullinertia").split()))
        spatial = SpatialInertia.MakeFromCentralInertia(self.mass, self.centre, about)
        self.object = self.plant.AddRigidBody("object", self.plant.AddModelInstance("object"), spatial)
        material = ProximityProperties()
        AddRigidHydroelasticProperties(material)
        AddContactMaterial(dissipation=DISSIPATION, friction=CoulombFriction(friction, friction), properties=material)
        mesh = Mesh(str(folder / "object.obj"))
        self.plant.RegisterCollisionGeometry(self.object, RigidTransform(), mesh, "object", material)

    def place(self):
        """The object's rotation and its centre of mass, expressed in the hand's base."""
        pose = self.plant.EvalBodyPoseInWorld(self.context, self.object)
        return pose.rotation().matrix(), pose.multiply(self.centre)

    def accelerate(self, field):
        """Everything under a field of acceleration."""
        forces = []
        for body, mass, centre in self.bodies:
            force = ExternallyAppliedSpatialForce()
            force.body_index, force.p_BoBq_B = body.index(), centre
            force.F_Bq_W = SpatialForce(np.zeros(3), mass * field)
            forces.append(force)
        port = self.plant.get_applied_spatial_force_input_port()
        port.FixValue(self.context, Value[list[ExternallyAppliedSpatialForce]](forces))

    def step(self):
        positions, speeds = self.plant.GetPositions(self.context), self.plant.GetVelocities(self.context)
        state = {name: (positions[joint.joint.position_start()], speeds[joint.joint.velocity_start()])
                 for name, joint in self.hand.joints.items()}
        for motor in self.motors:
            motor.turn(state)
        self.command()
        self.simulator.AdvanceTo(self.root.get_time() + STEP)

    def command(self):
        told = [joint.told for joint in self.order] + [joint.speed for joint in self.order]
        self.plant.get_desired_state_input_port(self.hand.instance).FixValue(self.context, np.array(told))

    def links(self):
        """How many links press on the object."""
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        pressing = set()
        for number in range(results.num_hydroelastic_contacts()):
            surface = results.hydroelastic_contact_info(number).contact_surface()
            for shape in (surface.id_M(), surface.id_N()):
                if shape in self.shape_of:
                    pressing.add(self.hand.link[self.shape_of[shape].index()])
        return len(pressing)

    def steps(self, seconds):
        return range(round(seconds / STEP))

    def try_grasp(self, grasp):
        """How a trial ends: `held`, or for what it failed."""
        base = np.array(grasp["object_from_base"]).reshape(3, 4)
        pose = RigidTransform(RotationMatrix.ProjectToRotationMatrix(base[:, :3]), base[:, 3]).inverse()
        self.root.SetTime(0.0)
        for joint in self.hand.joints.values():
            joint.speed = 0.0
        self.motors = [Motor(told, self.hand, value) for told, value in zip(self.drive["motors"], grasp["posture"])]
        for motor in self.motors:
            motor.tell()
        self.plant.SetVelocities(self.context, np.zeros(self.plant.num_velocities()))
        positions = self.plant.GetPositions(self.context)
        for joint in self.hand.joints.values():
            positions[joint.joint.position_start()] = joint.told
        self.plant.SetPositions(self.context, positions)
        self.plant.SetFreeBodyPose(self.context, self.object, pose)
        self.command()
        self.accelerate(np.zeros(3))
        self.simulator.Initialize()
        upright, begun = self.place()
        for _ in self.steps(self.protocol["closing"]):
            self.step()
            self.plant.SetFreeBodySpatialVelocity(self.context, self.object, SpatialVelocity.Zero())
            if all(motor.rested >= RESTS for motor in self.motors):
                break
            if np.linalg.norm(self.place()[1] - begun) > PUSHED_AWAY:
                return "lost_closing"
        for _ in self.steps(self.protocol["settling"]):
            self.step()
            if np.linalg.norm(self.place()[1] - begun) > PUSHED_AWAY:
                return "lost_closing"
        if self.links() < 2:
            return "not_touching"
        self.closed_at = self.place()
        protocol, down = self.protocol, np.array([0.0, 0.0, -GRAVITY])
        rate, turns = protocol["lift"] / protocol["lift_time"] ** 2, 2.0 * math.pi * np.array(protocol["frequencies"])

        def lift(at):
            s = at / protocol["lift_time"]
            return down - np.array([0.0, 0.0, rate * s * (60.0 + s * (-180.0 + s * 120.0))])

        def shake(at):
            return down + protocol["shake"] * turns * turns * np.sin(turns * at)

        for name, seconds, field in (("lost_lifting", protocol["lift_time"], lift), ("lost_shaking", protocol["shake_time"], shake)):
            for step in self.steps(seconds):
                self.accelerate(upright @ field((step + 0.5) * STEP))
                self.step()
                if self.is_lost():
                    return name
        return "held" if self.links() >= 2 else "let_go"

    def is_lost(self):
        turn, centre = self.place()
        cosine = (np.trace(self.closed_at[0].T @ turn) - 1.0) / 2.0
        far = np.linalg.norm(centre - self.closed_at[1]) > self.protocol["lost_distance"]
        return far or math.acos(min(max(cosine, -1.0), 1.0)) > self.protocol["lost_angle"]


def label_of(grasp):
    """The label of a grasp: its trials together; in exports without labels, the trial in the air."""
    expected = grasp["expected"]
    if expected.get("label"):
        return expected["label"]
    return {"held": "held", "starts_too_deep": "untested"}.get(expected["verdict"], "failed")


def chosen(folder, each, side_of):
    """This many grasps of each side, evenly over the export, by object; `side_of` returns a grasp's side or None."""
    sides = {}
    for path in sorted(folder.glob("*/grasps.json")):
        for number, grasp in enumerate(json.loads(path.read_text())["grasps"]):
            if (side := side_of(grasp)) is not None:
                sides.setdefault(side, []).append((path.parent.name, number))
    by_object = {}
    for some in sides.values():
        count = min(each, len(some))
        for index in range(count):
            name, number = some[index * len(some) // count]
            by_object.setdefault(name, []).append(number)
    return by_object


def side_of_label(grasp):
    """Grasps that could not be tried there, or are on the edge, have no outcome to compare with."""
    label = label_of(grasp)
    return label if label in ("held", "failed") else None


def side_of_success(grasp):
    """Share of the levels that hold, of a grasp with a graded label that has been tried."""
    return grasp["expected"].get("success")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="what `graspmill export --to mujoco` wrote")
    parser.add_argument("--each", type=int, default=50, help="grasps stored as held, and as many stored as failed")
    parser.add_argument("--by-success", action="store_true", help="that many of each share of levels of graded labels, and a row for each share")
    parser.add_argument("--json", action="store_true", help="counts as JSON alone")
    arguments = parser.parse_args()
    drive = json.loads((arguments.folder / "drive.json").read_text())
    rows = []
    side_of = side_of_success if arguments.by_success else side_of_label
    for name, numbers in sorted(chosen(arguments.folder, arguments.each, side_of).items()):
        world = World(arguments.folder, name, drive)
        grasps = json.loads((arguments.folder / name / "grasps.json").read_text())["grasps"]
        for number in numbers:
            try:
                verdict = world.try_grasp(grasps[number])
            except RuntimeError as error:
                verdict = f"refused: {str(error).splitlines()[0]}"
            rows.append((name, number, side_of(grasps[number]), label_of(grasps[number]), verdict))
            print(*rows[-1], file=sys.stderr, flush=True)
    counts = {}
    for side in sorted({side for _, _, side, _, _ in rows}) if arguments.by_success else ("held", "failed"):
        some = [verdict for _, _, stored, _, verdict in rows if stored == side]
        counts[side] = {"tried": len(some), "hold": sum(verdict == "held" for verdict in some)}
        counts[side]["refused"] = sum(verdict.startswith("refused") for verdict in some)
    if arguments.json:
        print(json.dumps({"hand": drive["hand"], "engine": "Drake", **counts}))
        return
    for side, count in counts.items():
        print(f"{drive['hand']}, stored as {side}: {count['hold']} of {count['tried']} hold in Drake ({count['refused']} not simulated)")


if __name__ == "__main__":
    main()
