//! Arms without a simulator: planning groups, forward and inverse kinematics.

mod closed_form;
mod group;
mod numeric;
mod reach;
mod travel;

pub use closed_form::{BRANCHES, NoClosedForm, SphericalWristArm};
pub use group::{InvalidGroup, Joint, JointKind, JointLimits, PlanningGroup, PlanningGroupParts};
pub use numeric::{Solution, SolverSettings, solve_numeric};
pub use reach::{SelfMotion, Wrist};
pub use travel::{Extents, Travel};
