//! Which closed form an arm has.

use super::{NoClosedForm, PlanningGroup, SelfMotion, SixJointArm};

/// A closed form of inverse kinematics that misses no solution of a pose.
#[derive(Clone, Debug, PartialEq)]
pub enum ClosedForm {
    /// Seven joints: solutions are curves over the first one.
    Seven(Box<SelfMotion>),
    /// Six joints: a handful of solutions.
    Six(Box<SixJointArm>),
}

impl ClosedForm {
    /// Analyses the axes with all joints at 0.
    ///
    /// # Errors
    /// Names the axes that prevent a closed form.
    pub fn recognise(group: &PlanningGroup) -> Result<Self, NoClosedForm> {
        if group.len() == 6 {
            return SixJointArm::recognise(group).map(|arm| Self::Six(Box::new(arm)));
        }
        SelfMotion::new(group).map(|motion| Self::Seven(Box::new(motion)))
    }
}
