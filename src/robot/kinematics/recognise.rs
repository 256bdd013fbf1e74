//! Which closed form an arm has.

use super::{NoClosedForm, PlanningGroup, SelfMotion, SixJointArm};

/// A closed form of inverse kinematics that misses no way to a pose.
#[derive(Clone, Debug, PartialEq)]
pub enum ClosedForm {
    /// Seven joints: ways are curves over the first one.
    Seven(Box<SelfMotion>),
    /// Six joints: ways are a handful.
    Six(Box<SixJointArm>),
}

impl ClosedForm {
    /// Looks at the axes with all joints at 0.
    ///
    /// # Errors
    /// Says which axes are in the way of a closed form.
    pub fn recognise(group: &PlanningGroup) -> Result<Self, NoClosedForm> {
        if group.len() == 6 {
            return SixJointArm::recognise(group).map(|arm| Self::Six(Box::new(arm)));
        }
        SelfMotion::new(group).map(|motion| Self::Seven(Box::new(motion)))
    }
}
