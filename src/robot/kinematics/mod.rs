//! Arms and hands without a simulator: planning groups, forward and inverse kinematics, trees of joints.

mod closed_form;
mod group;
mod numeric;
mod reach;
mod recognise;
mod six_joints;
mod travel;
mod tree;

pub use closed_form::{BRANCHES, NoClosedForm, SphericalWristArm};
pub use group::{InvalidGroup, Joint, JointKind, JointLimits, PlanningGroup, PlanningGroupParts};
pub use numeric::{Descent, MAX_JOINTS, Solution, SolverSettings, descend, solve_numeric};
pub use reach::{SelfMotion, Wrist};
pub use recognise::ClosedForm;
pub use six_joints::{SixJointArm, Solutions};
pub use travel::{Extents, Stance, Travel};
pub use tree::{JointTree, TreeJoint};
