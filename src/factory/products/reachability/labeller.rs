//! Decides the labels of poses.

use nalgebra::{Rotation3, Vector3};

use super::{
    collisions::{Collisions, Free, LastPair},
    contacts::{Contacts, IsFree},
    finite::FiniteArm,
    search::SearchedArm,
    settings::{CollisionTest, IkSolver, ReachabilityJob, Robot, WORLD},
    sweep::{RedundantArm, SweepScratch},
};
use crate::ProduceError;
use kernel::geom::{EndEffector, NoSurface, Pose, PoseLabel, Proof, SimdLevel, World};
use robot::{
    collision::Bodies,
    kinematics::{ClosedForm, NoClosedForm, PlanningGroup, SelfMotion, Wrist},
};
use sim::{Collidable, RobotError, RobotModel};

/// Labels poses of one robot; shared by all threads. A label depends on the robot, the settings and the pose alone.
pub struct PoseLabeller {
    arm: Arm,
    joints: usize,
    orientations: Vec<Orientation>,
    /// `Some` where MuJoCo decides what collides.
    contacts: Option<Contacts>,
}

/// Method that finds solutions of a pose.
enum Arm {
    /// On curves, in closed form.
    Redundant {
        arm: Box<RedundantArm>,
        /// Orientations with the same requirement for the wrist share an index here, that of the first one.
        wrists: Vec<Wrist>,
        /// Index of each orientation.
        wrist_of: Vec<usize>,
    },
    /// A handful, in closed form.
    Finite(Box<FiniteArm>),
    /// By descent from many starts.
    Searched(Box<SearchedArm>),
}

/// One orientation of every position.
struct Orientation {
    rotation: Rotation3<f64>,
    /// The first orientation with the same rotation.
    twin: usize,
}

/// Working memory of one thread, for one labeller.
#[derive(Default)]
pub struct Scratch {
    /// MuJoCo's check, from the first position on.
    free: Option<IsFree>,
    last: LastPair,
    reached: Vec<Reached>,
    /// Where the witness of each orientation begins.
    begins: Vec<usize>,
    sweep: SweepScratch,
}

/// Knowledge of a wrist without collisions.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Reached {
    TooFar,
    No,
    /// With this value of the first joint [rad].
    Yes(f64),
}

/// The orientations of one position, labelled; keeps its memory from position to position.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelledPosition {
    /// One label per orientation.
    pub labels: Vec<PoseLabel>,
    /// Proof behind each label.
    pub proofs: Vec<Proof>,
    /// Joint values [rad or m] of each reachable one, in order.
    pub witnesses: Vec<f64>,
}

/// Why poses of a robot cannot be labelled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoLabeller {
    /// The arm has no closed form.
    #[error(transparent)]
    Arm(#[from] NoClosedForm),
    /// A shape has no surface.
    #[error(transparent)]
    Shape(#[from] NoSurface),
}

/// Rotations closer than this are the same: grids give each rotation twice, up to rounding.
const SAME: f64 = 1e-9;

impl PoseLabeller {
    /// Reads the robot of a job and prepares everything that all poses share.
    ///
    /// # Errors
    /// When the robot cannot be read, its arm has no solver of the requested kind, or it collides at rest.
    pub fn new(job: &ReachabilityJob, seed: u64, level: SimdLevel) -> Result<Self, ProduceError> {
        let refused = |error: RobotError| ProduceError::unusable(&job.robot.name, error);
        let ReadRobot { model, group, collidable } = ReadRobot::new(&job.robot, job.collisions).map_err(refused)?;
        let scene = || job.robot.file.display().to_string();
        let no_labeller = |error: NoLabeller| ProduceError::unusable(scene(), error);
        let mut collisions = None;
        if let Some(Collidable { bodies, rest, .. }) = &collidable {
            let own = Collisions::new(&group, bodies, level).map_err(|error| no_labeller(error.into()))?;
            if let Some(pair) = own.touching(rest) {
                return Err(refused(model.touching_at_rest(bodies, pair)));
            }
            collisions = Some(own);
        }
        let rotations: Vec<_> = (0..job.poses.orientations()).map(|index| job.poses.rotation(index)).collect();
        let labeller = Self::with_collisions(&group, collisions, &rotations, job.solver, seed).map_err(no_labeller)?;
        let contacts = (job.collisions == CollisionTest::Mujoco).then(|| Contacts::new(model, &job.robot));
        Ok(Self { contacts, ..labeller })
    }

    /// For an arm and what it may collide with, and the instructions to check that with; `bodies` is `None` where collisions
    /// don't count. `seed` is that of the numeric solver's starts.
    ///
    /// # Errors
    /// Reports why the arm has no closed form, or which shape has no surface.
    pub fn of_parts(
        group: &PlanningGroup,
        bodies: Option<(&Bodies, SimdLevel)>,
        rotations: &[Rotation3<f64>],
        solver: IkSolver,
        seed: u64,
    ) -> Result<Self, NoLabeller> {
        let collisions = bodies.map(|(bodies, level)| Collisions::new(group, bodies, level)).transpose()?;
        Self::with_collisions(group, collisions, rotations, solver, seed)
    }

    fn with_collisions(
        group: &PlanningGroup,
        collisions: Option<Collisions>,
        rotations: &[Rotation3<f64>],
        solver: IkSolver,
        seed: u64,
    ) -> Result<Self, NoLabeller> {
        let mut orientations: Vec<Orientation> = Vec::with_capacity(rotations.len());
        for (index, rotation) in rotations.iter().enumerate() {
            let same = |other: &Orientation| (other.rotation.matrix() - rotation.matrix()).amax() < SAME;
            let twin = orientations.iter().position(same).unwrap_or(index);
            orientations.push(Orientation { rotation: *rotation, twin });
        }
        let arm = match closed_form(group, solver)? {
            Some(ClosedForm::Seven(motion)) => {
                let (wrists, wrist_of) = wrists(&motion, rotations);
                Arm::Redundant { arm: Box::new(RedundantArm::new(*motion, collisions)), wrists, wrist_of }
            }
            Some(ClosedForm::Six(arm)) => Arm::Finite(Box::new(FiniteArm::new(*arm, collisions))),
            None => Arm::Searched(Box::new(SearchedArm::new(group, collisions, seed))),
        };
        Ok(Self { arm, joints: group.len(), orientations, contacts: None })
    }

    /// Joints of the planning group: values of a witness.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Labels every orientation at one position [m]; `out` is emptied first.
    pub fn label(&self, scratch: &mut Scratch, position: [f64; 3], out: &mut LabelledPosition) {
        let LabelledPosition { labels, proofs, witnesses } = out;
        labels.clear();
        proofs.clear();
        witnesses.clear();
        // What is remembered of one position must not reach the next.
        scratch.last = LastPair::default();
        let position = Vector3::from(position);
        if let Arm::Redundant { arm, wrists, .. } = &self.arm {
            let reach = |wrist: &Wrist| Reached::of(arm.motion(), &placed(wrist, position), &mut scratch.sweep.ends);
            scratch.reached.clear();
            scratch.reached.extend(wrists.iter().map(reach));
        }
        if let (Some(contacts), None) = (&self.contacts, &scratch.free) {
            scratch.free = Some(contacts.worker());
        }
        scratch.begins.clear();
        for (index, orientation) in self.orientations.iter().enumerate() {
            scratch.begins.push(witnesses.len());
            if orientation.twin < index {
                labels.push(labels[orientation.twin]);
                proofs.push(proofs[orientation.twin]);
                if labels[index] == PoseLabel::Reachable {
                    let from = scratch.begins[orientation.twin];
                    witnesses.extend_from_within(from..from + self.joints);
                }
                continue;
            }
            let target: Pose<World, EndEffector> = Pose::new(orientation.rotation, position);
            let free: Option<Free> = scratch.free.as_mut().map(|free| &mut **free as Free);
            let (label, proof) = match &self.arm {
                Arm::Redundant { arm, wrists, wrist_of } => match scratch.reached[wrist_of[index]] {
                    Reached::TooFar => (PoseLabel::NoSolution, Proof::Bound),
                    Reached::No => (PoseLabel::NoSolution, Proof::IntervalEnds),
                    Reached::Yes(first) => {
                        let wrist = placed(&wrists[wrist_of[index]], position);
                        match free {
                            Some(free) => {
                                arm.solve_in_steps(&target, &wrist, first, free, &mut scratch.sweep.ends, witnesses)
                            }
                            None => arm.solve(&target, &wrist, first, &mut scratch.last, &mut scratch.sweep, witnesses),
                        }
                    }
                },
                Arm::Finite(arm) => arm.solve(&target, &mut scratch.last, free, witnesses),
                Arm::Searched(arm) => arm.solve(&target, &mut scratch.last, free, witnesses),
            };
            labels.push(label);
            proofs.push(proof);
        }
    }
}

impl Reached {
    fn of(motion: &SelfMotion, wrist: &Wrist, ends: &mut Vec<f64>) -> Self {
        if motion.too_far(wrist) { Self::TooFar } else { motion.first_value(wrist, ends).map_or(Self::No, Self::Yes) }
    }
}

/// A wrist at the origin, moved to a position [m].
fn placed(wrist: &Wrist, position: Vector3<f64>) -> Wrist {
    Wrist { centre: wrist.centre + position, ahead: wrist.ahead }
}

/// Demands of the rotations on the wrist at the origin, each once, and the index of each rotation among them.
fn wrists(motion: &SelfMotion, rotations: &[Rotation3<f64>]) -> (Vec<Wrist>, Vec<usize>) {
    let mut wrists: Vec<Wrist> = Vec::new();
    let index = |rotation: &Rotation3<f64>| {
        let wrist = motion.wrist(&Pose::new(*rotation, Vector3::zeros()));
        let alike =
            |other: &Wrist| (other.centre - wrist.centre).amax() < SAME && (other.ahead - wrist.ahead).amax() < SAME;
        wrists.iter().position(alike).unwrap_or_else(|| {
            wrists.push(wrist);
            wrists.len() - 1
        })
    };
    let wrist_of = rotations.iter().map(index).collect();
    (wrists, wrist_of)
}

/// The closed form that a job selects; `None` for the numeric solver.
fn closed_form(group: &PlanningGroup, solver: IkSolver) -> Result<Option<ClosedForm>, NoClosedForm> {
    match solver {
        IkSolver::Numeric => Ok(None),
        IkSolver::Auto => Ok(ClosedForm::recognise(group).ok()),
        IkSolver::ClosedForm => ClosedForm::recognise(group).map(Some),
    }
}

/// A robot as a job has it, in the frame of the job's poses.
struct ReadRobot {
    model: RobotModel,
    group: PlanningGroup,
    /// Bodies that can collide, where our own test decides that.
    collidable: Option<Collidable>,
}

impl ReadRobot {
    fn new(robot: &Robot, collisions: CollisionTest) -> Result<Self, RobotError> {
        let joints: Vec<&str> = robot.joints.iter().map(String::as_str).collect();
        let model = RobotModel::open(&robot.file)?;
        let group = model.planning_group(&joints, &robot.target, &robot.fixed)?;
        let frame = model.resting_frame(&robot.frame, &joints, &robot.fixed)?;
        // Where the poses are in the world's frame, every bit stays as it is.
        let elsewhere = (robot.frame != WORLD).then_some(frame);
        let group = elsewhere.iter().fold(group, PlanningGroup::seen_from);
        let collidable = match collisions {
            CollisionTest::Exact => {
                let found = model.collidable(&joints, &robot.fixed)?;
                Some(Collidable { bodies: elsewhere.iter().fold(found.bodies, Bodies::seen_from), ..found })
            }
            CollisionTest::Mujoco => {
                model.check_rest_by_contacts(&joints, &robot.fixed)?;
                None
            }
            CollisionTest::None => None,
        };
        Ok(Self { model, group, collidable })
    }
}
