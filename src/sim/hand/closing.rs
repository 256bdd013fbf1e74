//! Stepping of a hand: motors limited by torque, clutches that open, contacts with the object.

use std::sync::Arc;

use mujoco_rs::wrappers::{mj_data::MjData, mj_model::MjModel};
use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use crate::{
    convert::{isometry, quaternion},
    error::HandError,
    hand::{
        effort::{Effort, MotorCommand, MotorLaw},
        link_touch::LinkTouch,
        moved::{Moved, moved},
        pressing::press,
        sim::{HandSim, Hold, Servo, is_finite},
    },
    objects::true_mesh::{ColliderLoan, TrueMeshCollider},
    physics::{Numerics, STEP, Unstable, instability},
};
use robot::hand::{Driven, Hand, Motor};

/// Share of a motor's stopping torque with which it accelerates: an instant start would count its gears as an obstacle.
pub(crate) const START: f64 = 0.2;

/// Share of its torque below which the load lets a stopped motor start again.
pub(crate) const HOLDS: f64 = 0.95;

/// Steps at rest after which a clutch opens: an impact is over by then.
pub(crate) const STEPS_TO_OPEN: u32 = 10;

/// A joint is at rest when it moves by less than its motor would in this time [s]: contacts never cease to creep.
pub(crate) const STANDING: f64 = 0.0005;

/// Steps without motion after which the hand is at rest.
pub(crate) const STEPS_AT_REST: u32 = 25;

/// Share of its torque that a motor keeps per step while a contact of its fingers presses too hard, and the smallest
/// share: slow enough for the servos to follow, and large enough to keep the contact.
const EASED_PER_STEP: f64 = 0.95;
const EASED_MOST: f64 = 0.01;

/// End of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RunEnd {
    /// Every motor has arrived or is stopped, and nothing moves.
    AtRest,
    /// The steps were used up.
    TimedOut,
    /// The numbers blew up.
    Unstable(Unstable),
}

/// Result of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// End of the run.
    pub end: RunEnd,
    /// Steps since the start.
    pub steps: u32,
    /// Values of all joints [rad or m], in the order of the hand's tree.
    pub joints: Vec<f64>,
    /// The motors, one per driven joint.
    pub motors: Vec<Motor>,
    /// Touches that press on the object.
    pub touches: Vec<LinkTouch>,
    /// Pairs of links that press on each other, the lower first.
    pub self_touches: Vec<[usize; 2]>,
}

/// A motor in motion.
#[derive(Clone, Copy, Debug)]
struct Drive {
    motor: Motor,
    /// Present speed, with sign.
    speed: f64,
    /// Last direction: 1, -1, or 0 at the start.
    direction: f64,
    /// Number of steps at rest: it has arrived and its joints with it, or its torque holds it.
    stood: u32,
    /// Steps since it was last at rest.
    since_stood: u32,
    /// Share of its torque that it uses: below 1 after its fingers have pressed too hard.
    share: f64,
    /// Number of steps in which a contact of its fingers has pressed too hard.
    pressed: u32,
}

/// Working memory of one thread that moves a hand; its state is its own.
pub struct HandWorker {
    pub(crate) sim: Arc<HandSim>,
    /// Data with a separate model: other threads do not see what the simulation sets in it.
    pub(crate) data: MjData<Box<MjModel>>,
    drives: Vec<Drive>,
    /// Targets of the servos, one per joint of the tree.
    wanted: Vec<f64>,
    /// Torques or forces of the servos in the last step [N m or N].
    torques: Vec<f64>,
    effort: Effort,
    law: MotorLaw,
    /// Contacts with true meshes: the object's first.
    colliders: Vec<TrueMeshCollider>,
    /// Commands of the object's slides, along the axes of its pose [m].
    pub(crate) slid: Vector3<f64>,
    /// The object's pose, expressed in the hand's base frame.
    pub(crate) base_from_mount: IsometryMatrix3<f64>,
    /// Position of the hand's base in MuJoCo's world, in which it does not turn [m]: 0 but where it moves through a scene.
    pub(crate) carried: Vector3<f64>,
    /// Touches of the object that stopped the last guarded move, expressed in the object's frame.
    pub(crate) stopped_by: Vec<LinkTouch>,
    steps: u32,
    /// Steps of MuJoCo in each of ours.
    substeps: u32,
    /// Joint values at the last motion of one of them.
    stood_at: Vec<f64>,
    /// Number of steps without motion of the joints.
    steps_at_rest: u32,
}

impl HandWorker {
    /// A worker whose hand is opened, the object at the hand's base until [`HandWorker::start`].
    pub fn new(sim: &Arc<HandSim>) -> Self {
        let data = MjData::new(Box::new(MjModel::clone(&sim.model)));
        let [wanted, torques, stood_at] = [(); 3].map(|()| vec![0.0; sim.servos.len()]);
        // Keeps the bits of touch by hands on a fixed object.
        let remembers = matches!(sim.hold, Hold::Free(_));
        let collider = |mesh| TrueMeshCollider::new(mesh, sim.table.as_ref(), remembers);
        let colliders = sim.true_mesh.iter().chain(&sim.neighbours).map(collider).collect();
        let mut worker = Self {
            sim: Arc::clone(sim),
            data,
            drives: Vec::new(),
            wanted,
            torques,
            effort: Effort::GRASP,
            law: MotorLaw::Position,
            colliders,
            slid: Vector3::zeros(),
            base_from_mount: IsometryMatrix3::identity(),
            carried: Vector3::zeros(),
            stopped_by: Vec::new(),
            steps: 0,
            substeps: 1,
            stood_at,
            steps_at_rest: 0,
        };
        worker.set_poses(&worker.sim.hand.opened(), &IsometryMatrix3::identity());
        worker
    }

    /// The hand.
    pub fn hand(&self) -> &Arc<Hand> {
        &self.sim.hand
    }

    /// Begins a run in the state of a new worker: the hand at rest in a posture, the object at a pose expressed in the
    /// hand's base frame.
    ///
    /// # Errors
    /// When the posture has another length or is out of range, or the pose is not finite.
    pub fn start(&mut self, posture: &[f64], base_from_object: &IsometryMatrix3<f64>) -> Result<(), HandError> {
        let ranges: Vec<[f64; 2]> = self.sim.hand.driven().iter().map(Driven::range).collect();
        let fits = |(value, [low, high]): (&f64, &[f64; 2])| (low..=high).contains(&value);
        if posture.len() != ranges.len() || !posture.iter().zip(&ranges).all(fits) {
            return Err(HandError::Posture { posture: posture.to_vec(), ranges });
        }
        if !is_finite(base_from_object) {
            return Err(HandError::Object { reason: "its pose is not finite".into() });
        }
        self.set_poses(posture, base_from_object);
        Ok(())
    }

    fn set_poses(&mut self, posture: &[f64], base_from_object: &IsometryMatrix3<f64>) {
        self.data.reset();
        (self.steps, self.steps_at_rest) = (0, 0);
        self.drives.clear();
        let at = |angle: &f64| {
            let motor = Motor::engaged(*angle);
            Drive { motor, speed: 0.0, direction: 0.0, stood: STEPS_AT_REST, since_stood: 0, share: 1.0, pressed: 0 }
        };
        self.drives.extend(posture.iter().map(at));
        self.tell_servos();
        for (servo, value) in self.sim.servos.iter().zip(&self.wanted) {
            self.data.qpos_mut()[servo.address] = *value;
        }
        self.torques.fill(0.0);
        (self.effort, self.law) = (Effort::GRASP, MotorLaw::Position);
        self.slid = Vector3::zeros();
        self.base_from_mount = *base_from_object;
        self.carried = Vector3::zeros();
        self.stood_at = self.joints();
        let (position, rotation) = (base_from_object.translation.vector.into(), quaternion(base_from_object));
        match self.sim.hold {
            Hold::Slides(_) => (self.data.mocap_pos_mut()[0], self.data.mocap_quat_mut()[0]) = (position, rotation),
            Hold::Free(object) => {
                let coordinates = &mut self.data.qpos_mut()[object.address..][..7];
                coordinates[..3].copy_from_slice(&position);
                coordinates[3..].copy_from_slice(&rotation);
            }
        }
        self.look();
    }

    /// Finds the contacts of the current state, without history.
    pub(crate) fn look(&mut self) {
        self.colliders.iter_mut().for_each(TrueMeshCollider::forget);
        let _loan = ColliderLoan::new(&mut self.colliders);
        self.data.forward();
    }

    /// Touches that would press on the object with all joints at values [rad or m], in the order of the hand's tree,
    /// and the object at a pose; the only step that may follow is [`HandWorker::start`].
    ///
    /// # Panics
    /// When there is not one value per joint.
    pub fn touches_at(&mut self, joints: &[f64], base_from_object: &IsometryMatrix3<f64>) -> Vec<LinkTouch> {
        assert_eq!(joints.len(), self.sim.servos.len(), "one value per joint");
        self.set_poses(&self.sim.hand.opened(), base_from_object);
        for (servo, value) in self.sim.servos.iter().zip(joints) {
            self.data.qpos_mut()[servo.address] = *value;
        }
        self.look();
        self.touches()
    }

    /// Sets how the simulation is computed from now on.
    pub fn set_numerics(&mut self, numerics: Numerics) {
        self.substeps = numerics.substeps();
        numerics.set(self.data.model_opt_mut());
    }

    /// Sets whether the faces of the hand's boxes and cylinders reach to their edges where they touch a true mesh, from now on:
    /// before a start.
    pub(crate) fn set_edges(&mut self, are_sharp: bool) {
        let meshes = self.sim.true_mesh.iter().chain(&self.sim.neighbours);
        self.colliders.iter_mut().zip(meshes).for_each(|(collider, mesh)| collider.set_edges(mesh, are_sharp));
    }

    /// Sets the effort of the motors from now on, until the next [`HandWorker::start`].
    pub fn set_effort(&mut self, effort: Effort) {
        self.effort = effort;
    }

    /// Sets the law of the motors from now on, until the next [`HandWorker::start`].
    pub(crate) fn set_motor_law(&mut self, law: MotorLaw) {
        self.law = law;
    }

    /// Present pose of the object, expressed in the hand's base frame.
    pub fn base_from_object(&self) -> IsometryMatrix3<f64> {
        match self.sim.hold {
            Hold::Slides(slides) => {
                let slid = slides.map(|slide| self.data.qpos()[slide.address]);
                self.base_from_mount * Translation3::from(slid)
            }
            Hold::Free(object) => {
                let [x, y, z, rotation @ ..] =
                    std::array::from_fn::<f64, 7, _>(|at| self.data.qpos()[object.address + at]);
                let [at_x, at_y, at_z] = self.carried.into();
                isometry(&[x - at_x, y - at_y, z - at_z], &rotation)
            }
        }
    }

    /// One step of 2 ms.
    ///
    /// # Errors
    /// When MuJoCo warns: the state is invalid until the next [`HandWorker::start`].
    ///
    /// # Panics
    /// When there is not one command per driven joint.
    pub fn step(&mut self, commands: &[MotorCommand]) -> Result<(), Unstable> {
        assert_eq!(commands.len(), self.drives.len(), "one command per driven joint");
        let sim = Arc::clone(&self.sim);
        match self.law {
            MotorLaw::Position => self.drive(&sim, commands),
            MotorLaw::Torque => self.press(&sim, commands),
        }
        for (torque, (servo, wanted)) in self.torques.iter_mut().zip(sim.servos.iter().zip(&self.wanted)) {
            let (at, speed) = (self.data.qpos()[servo.address], self.data.qvel()[servo.dof]);
            *torque = servo.stiffness * (wanted - at) - servo.damping * speed;
        }
        if let Hold::Slides(slides) = sim.hold {
            for (slide, slid) in slides.iter().zip(&self.slid) {
                self.data.ctrl_mut()[slide.control] = *slid;
            }
        }
        let loan = ColliderLoan::new(&mut self.colliders);
        for _ in 0..self.substeps {
            self.data.step();
        }
        drop(loan);
        self.steps += 1;
        if let Some(kind) = instability(&self.data) {
            return Err(Unstable { step: self.steps, kind });
        }
        self.watch_for_rest();
        self.ease_motors();
        Ok(())
    }

    /// Drives the motors for a step, and tells their servos.
    fn drive(&mut self, sim: &HandSim, commands: &[MotorCommand]) {
        for ((index, driven), command) in sim.hand.driven().iter().enumerate().zip(commands) {
            let before = self.drives[index];
            let after = self.driven_to(driven, before, *command);
            let since_stood = if after.stood > 0 { 0 } else { before.since_stood.saturating_add(1) };
            self.drives[index] = Drive { since_stood, ..after };
        }
        self.tell_servos();
    }

    /// Lets the motors that are to close press with their torque; the others stay.
    fn press(&mut self, sim: &HandSim, commands: &[MotorCommand]) {
        let values = self.joints();
        for ((drive, driven), command) in self.drives.iter_mut().zip(sim.hand.driven()).zip(commands) {
            if *command == MotorCommand::Close {
                drive.motor = Motor::engaged(press(driven, self.effort, &sim.servos, &values, &mut self.wanted));
            }
        }
        for (servo, value) in sim.servos.iter().zip(&self.wanted) {
            self.data.ctrl_mut()[servo.control] = *value;
        }
    }

    /// Takes torque from motors whose links press too hard for a while; all motors share the contacts of the base.
    fn ease_motors(&mut self) {
        let max_force = self.effort.max_force;
        if max_force.is_infinite() {
            return;
        }
        let mut hardest = vec![0.0f64; self.drives.len()];
        let touches = self.touches().into_iter().chain(self.thing_touches().into_iter().map(|(_, touch)| touch));
        for touch in touches.filter(|touch| touch.force > max_force) {
            for (hardest, moves) in hardest.iter_mut().zip(&self.sim.links_moved) {
                if touch.link == 0 || moves[touch.link] {
                    *hardest = hardest.max(touch.force);
                }
            }
        }
        for (drive, force) in self.drives.iter_mut().zip(hardest) {
            drive.pressed = if force > max_force { drive.pressed.saturating_add(1) } else { 0 };
            // An impact is over by then.
            if drive.pressed >= STEPS_TO_OPEN && drive.share > EASED_MOST {
                drive.share = (drive.share * (max_force / force).max(EASED_PER_STEP)).max(EASED_MOST);
                self.steps_at_rest = 0;
            }
        }
    }

    /// Counts the steps in which no joint has moved.
    fn watch_for_rest(&mut self) {
        let at = |joint: usize| self.data.qpos()[self.sim.servos[joint].address];
        let stands = |driven: &Driven| {
            let followers = driven.followers.iter().map(|follower| follower.joint);
            let min = STANDING * self.effort.speed * driven.speed;
            followers.chain([driven.joint]).all(|joint| (at(joint) - self.stood_at[joint]).abs() < min)
        };
        if self.sim.hand.driven().iter().all(stands) {
            self.steps_at_rest = self.steps_at_rest.saturating_add(1);
        } else {
            self.stood_at = self.joints();
            self.steps_at_rest = 0;
        }
    }

    /// Restarts the count of steps at rest: other commands follow.
    pub(crate) fn begin_to_move(&mut self) {
        self.steps_at_rest = 0;
    }

    /// Steps with the same commands until the hand comes to rest, at most `steps` steps.
    ///
    /// # Panics
    /// When there is not one command per driven joint.
    pub fn run(&mut self, commands: &[MotorCommand], max_steps: u32) -> Run {
        self.begin_to_move();
        let mut end = RunEnd::TimedOut;
        for _ in 0..max_steps {
            if let Err(unstable) = self.step(commands) {
                end = RunEnd::Unstable(unstable);
                break;
            }
            if self.is_at_rest() {
                end = RunEnd::AtRest;
                break;
            }
        }
        Run {
            end,
            steps: self.steps,
            joints: self.joints(),
            motors: self.motors(),
            touches: self.touches(),
            self_touches: self.self_touches(),
        }
    }

    /// Closes the hand: drives every closing joint until it is closed or stopped.
    pub fn close(&mut self, max_steps: u32) -> Run {
        self.run(&vec![MotorCommand::Close; self.drives.len()], max_steps)
    }

    /// Whether every motor has arrived or is stopped, and nothing has moved for 50 ms.
    pub fn is_at_rest(&self) -> bool {
        self.steps_at_rest >= STEPS_AT_REST && self.drives.iter().all(|drive| drive.since_stood < STEPS_AT_REST)
    }

    /// Values of all joints [rad or m], in the order of the hand's tree.
    pub fn joints(&self) -> Vec<f64> {
        self.sim.servos.iter().map(|servo| self.data.qpos()[servo.address]).collect()
    }

    /// Steps since the start.
    pub fn steps(&self) -> u32 {
        self.steps
    }

    /// The motors, one per driven joint.
    pub fn motors(&self) -> Vec<Motor> {
        self.drives.iter().map(|drive| drive.motor).collect()
    }

    /// Torque of each joint's servo in the last step [N m or N], in the order of the hand's tree.
    pub fn torques(&self) -> &[f64] {
        &self.torques
    }

    /// The description's touch sensors by name, and the normal force that each feels [N].
    pub fn touch_sensors(&self) -> impl Iterator<Item = (&str, f64)> {
        self.sim.touch_sensors.iter().map(|(name, address)| (name.as_str(), self.data.sensordata()[*address]))
    }

    /// Where a motor is after another step, before the joints move.
    fn driven_to(&self, driven: &Driven, drive: Drive, command: MotorCommand) -> Drive {
        // An eased motor gives way at any angle.
        let drive = if drive.share < 1.0 { Drive { motor: self.slipped(driven, drive), ..drive } } else { drive };
        let motor = drive.motor;
        // Target angle of the command.
        let [low, high] = driven.range();
        let target = match command {
            MotorCommand::Hold => motor.angle,
            MotorCommand::Close => driven.closed_angle(motor),
            MotorCommand::Open => driven.opened,
            MotorCommand::To(angle) => angle.max(low).min(high),
        };
        // Arrived and settled: the motor keeps still.
        let left = target - motor.angle;
        let arrived = left == 0.0 || left.is_nan();
        // Arrived, but its fingers press too hard: it gives way.
        if arrived
            && drive.share < 1.0
            && let Some(angle) = self.eased(driven, drive, 0.0)
        {
            return Drive { motor: driven.driven_to(motor, angle), speed: 0.0, stood: STEPS_AT_REST, ..drive };
        }
        if arrived && drive.stood >= STEPS_AT_REST {
            return Drive { speed: 0.0, ..drive };
        }
        // Number of steps at rest; a change of direction restarts it.
        let direction = if arrived { drive.direction } else { left.signum() };
        let stood = if direction == drive.direction { drive.stood } else { 0 };
        let motor = self.slipped(driven, drive);
        // Stopped by the torque of a joint: the motor stops, or its clutch opens after a while.
        if let Some(angle) = self.stop(driven, Drive { stood, ..drive }, direction) {
            let motor = driven.driven_to(motor, angle);
            // The clutch opens only towards the closed hand.
            let closes = direction == driven.closing_sign();
            let max = HOLDS * drive.share * self.effort.torque * driven.torque;
            let stopped = direction * self.torques[driven.joint] >= max && stood >= STEPS_TO_OPEN;
            let opens =
                self.effort.clutches && closes && stopped && driven.breakaway.is_some() && motor.released.is_none();
            return if opens {
                Drive { motor: driven.stopped(motor), speed: 0.0, direction, stood: 0, ..drive }
            } else {
                Drive { motor, speed: 0.0, direction, stood: stood.saturating_add(1), ..drive }
            };
        }
        // Arrived: it settles once the joints have followed.
        if arrived {
            let stood = if self.have_followed(driven, motor) { stood + 1 } else { 0 };
            return Drive { motor, speed: 0.0, direction, stood, ..drive };
        }
        // Speed approaches the commanded one with limited acceleration; there is no ramp down before the target.
        let change = STEP * self.acceleration(driven, motor);
        let speed = (direction * self.effort.speed * driven.speed).max(drive.speed - change).min(drive.speed + change);
        let step = speed * STEP;
        let arrives = step * direction >= left.abs();
        let motor = driven.driven_to(motor, if arrives { target } else { motor.angle + step });
        Drive { motor, speed: if arrives { 0.0 } else { speed }, direction, stood: 0, ..drive }
    }

    /// Angle of a motor that a joint's torque has stopped on its way; `None` while it moves freely.
    ///
    /// A servo that lags while it moves would be wound up by the lag when it is stopped. The motor is set to the angle
    /// where its spring bears exactly the torque, until it has been at rest for a while: from then on its gears hold
    /// the reached angle, and give way to loads above their holding torque.
    fn stop(&self, driven: &Driven, drive: Drive, left: f64) -> Option<f64> {
        let Drive { motor, stood, share, .. } = drive;
        if share < 1.0 {
            return self.eased(driven, drive, left);
        }
        let stops = moved(driven, motor).filter_map(|Moved { joint, rate, torque, holding_torque }| {
            let torque = self.effort.torque * torque;
            let pushes = self.torques[joint] * left * rate.signum();
            let most = if stood < STEPS_AT_REST { torque } else { holding_torque };
            if pushes >= most {
                let command = self.command_for(joint, left * rate.signum() * most);
                return Some(motor.angle + (command - self.wanted[joint]) / rate);
            }
            (stood > 0 && pushes >= HOLDS * torque).then_some(motor.angle)
        });
        // The follower that holds the motor back most.
        stops.min_by(|a, b| (left * a).total_cmp(&(left * b)))
    }

    /// A motor whose joint, left behind by an open clutch, gives way above the load that its gears hold.
    fn slipped(&self, driven: &Driven, Drive { motor, share, .. }: Drive) -> Motor {
        let (closes, most) = (driven.closing_sign(), share * driven.holding_torque);
        if motor.released.is_some() && closes * self.torques[driven.joint] > most {
            Motor { released: Some(self.command_for(driven.joint, closes * most)), ..motor }
        } else {
            motor
        }
    }

    /// Angle of a motor whose contacts have pressed too hard, from the load of all its joints together; `None` while it
    /// moves freely.
    ///
    /// Joint by joint it would oscillate: relief of one loads the other.
    fn eased(&self, driven: &Driven, Drive { motor, stood, share, .. }: Drive, left: f64) -> Option<f64> {
        let (mut pushes, mut stiffness, mut most) = (0.0, 0.0, 0.0f64);
        for Moved { joint, rate, torque, .. } in moved(driven, motor) {
            pushes += rate * self.torques[joint];
            stiffness += rate * rate * self.sim.servos[joint].stiffness;
            most = most.max(share * self.effort.torque * torque * rate.abs());
        }
        if pushes.abs() > most {
            return Some(motor.angle + (pushes.signum() * most - pushes) / stiffness);
        }
        (stood > 0 && pushes * left >= HOLDS * most).then_some(motor.angle)
    }

    /// Command of a servo whose spring has a torque at the joint's value.
    fn command_for(&self, joint: usize, torque: f64) -> f64 {
        let Servo { stiffness, address, .. } = self.sim.servos[joint];
        self.data.qpos()[address] + torque / stiffness
    }

    /// Largest acceleration of a motor.
    fn acceleration(&self, driven: &Driven, motor: Motor) -> f64 {
        let of = |Moved { joint, rate, torque, .. }: Moved| {
            START * self.effort.torque * torque / (self.sim.servos[joint].inertia * rate.abs())
        };
        moved(driven, motor).map(of).fold(f64::INFINITY, f64::min)
    }

    /// Whether the joints that a motor moves are at their commanded values, within the deflection of the servos at
    /// their torque.
    fn have_followed(&self, driven: &Driven, motor: Motor) -> bool {
        moved(driven, motor).all(|Moved { joint, torque, .. }| {
            let Servo { stiffness, address, .. } = self.sim.servos[joint];
            (self.wanted[joint] - self.data.qpos()[address]).abs() * stiffness < torque
        })
    }

    /// Joint values of the motors, as the servos' controls.
    fn tell_servos(&mut self) {
        let motors: Vec<Motor> = self.drives.iter().map(|drive| drive.motor).collect();
        self.sim.hand.joint_values(&motors, &mut self.wanted);
        for (servo, value) in self.sim.servos.iter().zip(&self.wanted) {
            self.data.ctrl_mut()[servo.control] = *value;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::{HandModel, physics::Instability};
    use kernel::geom::Shape;
    use robot::collision::Geometry;

    /// Joints of a gripper that only open from 0 on do not make slides that do.
    #[test]
    fn an_object_on_slides_goes_to_either_side_of_its_place() {
        let scene = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/parallel_gripper.xml"));
        let model = HandModel::open(scene).expect("the hand");
        let ball = Geometry { shape: Shape::Sphere { radius: 0.01 }, link_from_shape: IsometryMatrix3::identity() };
        let mut worker = HandWorker::new(&Arc::new(HandSim::new(&model, &[ball]).expect("a simulation")));
        let pose = IsometryMatrix3::translation(0.0, 0.0, 0.3);
        for slid in [Vector3::new(0.01, -0.02, 0.03), Vector3::new(-0.01, 0.02, -0.03)] {
            worker.start(&worker.hand().opened(), &pose).expect("a posture");
            worker.slid = slid;
            for _ in 0..200 {
                worker.step(&[MotorCommand::Hold]).expect("stable");
            }
            let moved = worker.base_from_object().translation.vector - pose.translation.vector;
            assert!((moved - slid).norm() < 1e-4, "{moved} for {slid}");
        }
    }

    /// Unstable numbers are reported, and the next run is unaffected.
    #[test]
    fn instability_is_caught_and_forgotten() {
        let model =
            HandModel::open(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/barrett_bh8_280.xml")))
                .expect("the hand");
        let ball = Geometry { shape: Shape::Sphere { radius: 0.03 }, link_from_shape: IsometryMatrix3::identity() };
        let sim = Arc::new(HandSim::new(&model, &[ball]).expect("a simulation"));
        let pose = IsometryMatrix3::translation(0.0, 0.0, 0.13);
        let close = |worker: &mut HandWorker| {
            worker.start(&[0.0; 4], &pose).expect("a posture");
            worker.close(3000)
        };
        let mut worker = HandWorker::new(&sim);
        let before = close(&mut worker);
        assert_eq!(before.end, RunEnd::AtRest);
        for (velocity, kind) in [(f64::NAN, Instability::Velocity), (1e12, Instability::Velocity)] {
            worker.start(&[0.0; 4], &pose).expect("a posture");
            worker.step(&[MotorCommand::Close; 4]).expect("stable");
            worker.data.qvel_mut()[1] = velocity;
            let run = worker.close(100);
            assert_eq!(run.end, RunEnd::Unstable(Unstable { step: 2, kind }));
            assert_eq!(close(&mut worker), before);
        }
    }
}
