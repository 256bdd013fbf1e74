//! Decides the labels of poses.

use nalgebra::{Rotation3, Vector3};

use super::sweep::{Arm, SweepScratch};
use crate::{
    collision::{Bodies, CollisionChecker},
    geom::{EndEffector, NoSurface, Pose, PoseLabel, Proof, World, rotation_from_rpy},
    job::{Collisions, ReachabilityJob, Robot},
    kinematics::{NoClosedForm, PlanningGroup, SelfMotion, Wrist},
    produce::ProduceError,
};

/// Labels poses of one robot; shared by all threads. A label depends on the robot, the settings and the pose alone.
pub struct PoseLabeller {
    arm: Arm,
    orientations: Vec<Orientation>,
    /// Orientations that ask the same of the wrist share a place here; their first one's.
    wrists: Vec<Wrist>,
}

/// One orientation of every position.
struct Orientation {
    rotation: Rotation3<f64>,
    /// The first orientation with the same rotation.
    twin: usize,
    /// Its place in `wrists`.
    wrist: usize,
}

/// What one thread works in.
#[derive(Debug, Default)]
pub struct Scratch {
    ends: Vec<f64>,
    reached: Vec<Reached>,
    /// Where the witness of each orientation begins.
    begins: Vec<usize>,
    sweep: SweepScratch,
}

/// What is known of a wrist without collisions.
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
    /// One label an orientation.
    pub labels: Vec<PoseLabel>,
    /// How each is known.
    pub proofs: Vec<Proof>,
    /// Joint values [rad or m] of each reachable one, in order.
    pub witnesses: Vec<f64>,
}

/// Why poses of a robot cannot be labelled.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoLabeller {
    /// Its arm has no closed form.
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
    /// When the robot cannot be read, its arm cannot be solved as the job asks, or it collides at rest.
    pub fn new(job: &ReachabilityJob, _seed: u64) -> Result<Self, ProduceError> {
        let refused = |why: String| ProduceError::NoLabeller { name: job.robot.scene.display().to_string(), why };
        let (group, bodies) = read_robot(&job.robot)?;
        let rotation = |cell: u32| {
            let [_, _, _, roll, pitch, yaw] = job.poses.pose(cell as usize);
            rotation_from_rpy(roll, pitch, yaw)
        };
        let rotations: Vec<_> = (0..job.orientations()).map(rotation).collect();
        let bodies = match job.collisions {
            Collisions::None => None,
            Collisions::Exact => Some(&bodies),
            Collisions::Mujoco => return Err(refused("`collisions = \"mujoco\"` is not there yet".to_owned())),
        };
        let labeller = Self::of_parts(&group, bodies, &rotations).map_err(|error| refused(error.to_string()))?;
        match labeller.arm.collision_at_rest(bodies) {
            Some(pair) => Err(refused(format!(
                "{pair} touch at rest, with every joint at 0 or its nearest limit; move them apart, or let them touch: \
                 <contact><exclude body1=... body2=.../></contact>"
            ))),
            None => Ok(labeller),
        }
    }

    /// For an arm and what it may collide with; `bodies` is `None` where collisions don't count.
    ///
    /// # Errors
    /// Says why the arm has no closed form, or which shape has no surface.
    pub fn of_parts(
        group: &PlanningGroup,
        bodies: Option<&Bodies>,
        rotations: &[Rotation3<f64>],
    ) -> Result<Self, NoLabeller> {
        let motion = SelfMotion::new(group)?;
        let mut orientations: Vec<Orientation> = Vec::with_capacity(rotations.len());
        let mut wrists: Vec<Wrist> = Vec::new();
        for (place, rotation) in rotations.iter().enumerate() {
            let same = |other: &Orientation| (other.rotation.matrix() - rotation.matrix()).amax() < SAME;
            let twin = orientations.iter().position(same).unwrap_or(place);
            let wrist = motion.wrist(&Pose::new(*rotation, Vector3::zeros()));
            let alike = |other: &Wrist| {
                (other.centre - wrist.centre).amax() < SAME && (other.ahead - wrist.ahead).amax() < SAME
            };
            let wrist = wrists.iter().position(alike).unwrap_or_else(|| {
                wrists.push(wrist);
                wrists.len() - 1
            });
            orientations.push(Orientation { rotation: *rotation, twin, wrist });
        }
        let arm = Arm::new(motion, bodies.map(CollisionChecker::new).transpose()?);
        Ok(Self { arm, orientations, wrists })
    }

    /// Joints of the planning group: values of a witness.
    pub fn joints(&self) -> usize {
        self.arm.joints()
    }

    /// Labels every orientation at one position [m]; `out` is emptied first.
    pub fn label(&self, scratch: &mut Scratch, position: [f64; 3], out: &mut LabelledPosition) {
        let LabelledPosition { labels, proofs, witnesses } = out;
        labels.clear();
        proofs.clear();
        witnesses.clear();
        // What is remembered of one position must not reach the next.
        scratch.sweep = SweepScratch::default();
        let position = Vector3::from(position);
        let motion = self.arm.motion();
        let placed = |wrist: &Wrist| Wrist { centre: wrist.centre + position, ahead: wrist.ahead };
        scratch.reached.clear();
        for wrist in &self.wrists {
            let wrist = placed(wrist);
            scratch.reached.push(if motion.too_far(&wrist) {
                Reached::TooFar
            } else {
                motion.first_value(&wrist, &mut scratch.ends).map_or(Reached::No, Reached::Yes)
            });
        }
        scratch.begins.clear();
        for (place, orientation) in self.orientations.iter().enumerate() {
            let begin = witnesses.len();
            scratch.begins.push(begin);
            if orientation.twin < place {
                labels.push(labels[orientation.twin]);
                proofs.push(proofs[orientation.twin]);
                if labels[place] == PoseLabel::Reachable {
                    let from = scratch.begins[orientation.twin];
                    witnesses.extend_from_within(from..from + self.joints());
                }
                continue;
            }
            let (label, proof) = match scratch.reached[orientation.wrist] {
                Reached::TooFar => (PoseLabel::NoSolution, Proof::Bound),
                Reached::No => (PoseLabel::NoSolution, Proof::IntervalEnds),
                Reached::Yes(first) => {
                    let target: Pose<World, EndEffector> = Pose::new(orientation.rotation, position);
                    let wrist = placed(&self.wrists[orientation.wrist]);
                    let found = self.arm.solve(&target, &wrist, first, &mut scratch.ends, &mut scratch.sweep);
                    witnesses.extend(found.witness.iter().flatten());
                    (found.label, found.proof)
                }
            };
            labels.push(label);
            proofs.push(proof);
        }
    }
}

#[cfg(feature = "sim")]
fn read_robot(robot: &Robot) -> Result<(PlanningGroup, Bodies), ProduceError> {
    let joints: Vec<&str> = robot.joints.iter().map(String::as_str).collect();
    crate::sim::RobotModel::open(&robot.scene)
        .and_then(|model| {
            let group = model.planning_group(&joints, &robot.target, &robot.fixed)?;
            Ok((group, model.bodies(&joints, &robot.fixed)?))
        })
        .map_err(|error| ProduceError::NoLabeller { name: robot.name.clone(), why: error.to_string() })
}

#[cfg(not(feature = "sim"))]
fn read_robot(robot: &Robot) -> Result<(PlanningGroup, Bodies), ProduceError> {
    let why = "this build has no simulator to read a robot with (feature `sim`)".to_owned();
    Err(ProduceError::NoLabeller { name: robot.name.clone(), why })
}
