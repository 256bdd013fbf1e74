//! Motions of an arm that are proven free of contact.
//!
//! [`plan_path`] finds a joint path among obstacles and certifies it continuously; [`ArmScene::certify`] certifies any edge;
//! [`plan_grasp`] adds the straight approach and the lift of a grasp. Work is bounded by counts and nothing reads a clock:
//! the same input gives the same path on any machine.

mod approach;
mod certificate;
mod grasp_motion;
mod inverse;
mod path;
mod scene;
mod search;
mod settings;
mod space;
mod tree;

pub use approach::{ApproachSettings, GraspPose, GraspScenes, LineBreak, Lines, follow_lines};
pub use certificate::{CertificateWork, Uncertified};
pub use grasp_motion::{GraspMotion, MotionLevel, MotionReport, MotionSettings, MotionVerdict, plan_grasp};
pub use inverse::{Branch, InverseArm};
pub use path::{JointPath, MAX_GOALS, PathVerdict, plan_path};
pub use scene::{ArmScene, Checks, Touch};
pub use settings::{PathKey, PathSettings, PathWork};
pub use space::{JointSpace, RADIANS_PER_METRE};

#[cfg(test)]
mod tests;
