//! Arms without a simulator: planning groups, forward and inverse kinematics.

mod group;
mod numeric;

pub use group::{InvalidGroup, Joint, JointKind, JointLimits, PlanningGroup, PlanningGroupParts};
pub use numeric::{Solution, SolverSettings, solve_numeric};
