//! The straight parts of a grasp: approach to the object, and the lift.

use nalgebra::{IsometryMatrix3, Translation3, Unit, Vector3};

use super::{
    certificate::CertificateWork,
    inverse::{Branch, InverseArm},
    scene::{ArmScene, Checks, Touch},
};
use kernel::geom::{EndEffector, Pose, World};
use robot::grasp::STAND_OFF;

/// Settings of approach and lift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ApproachSettings {
    /// Length of the approach [m].
    pub back: f64,
    /// Height of the lift, along the world's z [m].
    pub lift: f64,
    /// Length of a step of the end effector [m].
    pub step: f64,
    /// Largest motion of a joint per step [rad or m].
    pub joint_step: f64,
    /// Manipulability below which a line is given up (see [`InverseArm::manipulability`]).
    pub manipulability: f64,
    /// Solutions of the grasp's pose that are followed.
    pub branches: usize,
}

impl Default for ApproachSettings {
    fn default() -> Self {
        Self { back: STAND_OFF, lift: 0.1, step: 0.002, joint_step: 0.1, manipulability: 1e-4, branches: 64 }
    }
}

/// A grasp's pose with the direction in which the hand comes.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspPose {
    /// Pose of the end effector.
    pub grasp: Pose<World, EndEffector>,
    /// Direction of the approach in the frame of the end effector.
    pub approach: Unit<Vector3<f64>>,
}

/// Scenes of the parts of a motion, of the same arm.
///
/// On the way to the pregrasp nothing may touch anything. During the approach the fingers may touch the target: leave out
/// those pairs. During the lift the target belongs to the hand: let the last link carry it
/// (see [`PlacedObstacle`](robot::collision::PlacedObstacle)).
#[derive(Clone, Copy)]
pub struct GraspScenes<'a> {
    /// On the way to the pregrasp.
    pub way: &'a ArmScene,
    /// During the approach, and at the grasp.
    pub approach: &'a ArmScene,
    /// During the lift.
    pub lift: &'a ArmScene,
}

/// Joint values along both lines of one branch, certified free of contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Lines {
    /// From the pregrasp to the grasp [rad or m].
    pub approach: Vec<Vec<f64>>,
    /// From the grasp upwards [rad or m].
    pub lift: Vec<Vec<f64>>,
}

/// Why a line along a branch ends early.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LineBreak {
    /// Two bodies touch, or come too near each other.
    Blocked(Touch),
    /// The branch ends, a joint would jump, or manipulability falls below the bound.
    Branch,
}

/// Follows one branch of a grasp's pose back to the pregrasp and up, and certifies both lines.
///
/// # Errors
/// Reason why a line ends early.
pub fn follow_lines(
    arm: &InverseArm,
    scenes: &GraspScenes<'_>,
    pose: &GraspPose,
    grasp: &Branch,
    settings: &ApproachSettings,
    work: (&mut CertificateWork, &mut Checks),
) -> Result<Lines, LineBreak> {
    let (certificate, checks) = work;
    let back = pose.grasp.rotation() * -pose.approach.into_inner() * settings.back;
    let mut lines = Vec::with_capacity(2);
    for (scene, whole) in [(scenes.approach, back), (scenes.lift, Vector3::z() * settings.lift)] {
        if let Some(touch) = scene.touch(&grasp.q, checks) {
            return Err(LineBreak::Blocked(touch));
        }
        let mut line = follow_line(arm, scene, &pose.grasp, grasp, whole, settings, checks)?;
        scene.space().unwind(&mut line);
        let certified = scene.certify_path(&line, certificate);
        certified.map_err(|(_, refused)| LineBreak::Blocked(refused.by))?;
        lines.push(line);
    }
    let lift = lines.pop().unwrap_or_default();
    let mut approach = lines.pop().unwrap_or_default();
    approach.reverse();
    Ok(Lines { approach, lift })
}

/// Joint values along a straight line of the end effector from a grasp's pose, by `whole` [m].
fn follow_line(
    arm: &InverseArm,
    scene: &ArmScene,
    from: &Pose<World, EndEffector>,
    grasp: &Branch,
    whole: Vector3<f64>,
    settings: &ApproachSettings,
    checks: &mut Checks,
) -> Result<Vec<Vec<f64>>, LineBreak> {
    let steps = (whole.norm() / settings.step - 1e-9).ceil().max(1.0);
    let (mut line, mut branch) = (vec![grasp.q.clone()], grasp.clone());
    for step in 1..=steps as usize {
        let shift = Translation3::from(whole * (step as f64 / steps));
        let moved = IsometryMatrix3::from_parts(shift, nalgebra::Rotation3::identity()) * from.isometry();
        let next = arm.follow(&branch, &Pose::from_isometry(moved), settings.joint_step).ok_or(LineBreak::Branch)?;
        if arm.manipulability(&next.q) < settings.manipulability {
            return Err(LineBreak::Branch);
        }
        if let Some(touch) = scene.touch(&next.q, checks) {
            return Err(LineBreak::Blocked(touch));
        }
        line.push(next.q.clone());
        branch = next;
    }
    Ok(line)
}
