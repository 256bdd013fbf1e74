//! One pose of an arm with a handful of solutions: each is evaluated.

use super::collisions::{Collisions, Free, LastPair};
use kernel::geom::{EndEffector, Pose, PoseLabel, Proof, World};
use robot::{collision::CollisionVerdict, kinematics::SixJointArm};

/// An arm of six joints and what it may collide with.
pub(super) struct FiniteArm {
    arm: SixJointArm,
    collisions: Option<Collisions>,
}

impl FiniteArm {
    pub fn new(arm: SixJointArm, collisions: Option<Collisions>) -> Self {
        Self { arm, collisions }
    }

    /// The label of a pose; the witness of a reachable one is appended. `contacts` decides what is free where it is there.
    pub fn solve(
        &self,
        target: &Pose<World, EndEffector>,
        last: &mut LastPair,
        mut contacts: Option<Free>,
        witness: &mut Vec<f64>,
    ) -> (PoseLabel, Proof) {
        let found = self.arm.solutions(target);
        // Of a family only one member was seen.
        let proof = if found.singular { Proof::Searched } else { Proof::IntervalEnds };
        if found.solutions.is_empty() {
            return (PoseLabel::NoSolution, proof);
        }
        let free = found.solutions.iter().find(|solution| match (&mut contacts, &self.collisions) {
            (Some(free), _) => free(solution.as_slice()),
            (None, Some(collisions)) => {
                collisions.check_all(&collisions.links(solution.as_slice()), last) == CollisionVerdict::Free
            }
            (None, None) => true,
        });
        match free {
            Some(solution) => {
                witness.extend(solution);
                (PoseLabel::Reachable, Proof::Witness)
            }
            None => (PoseLabel::Colliding, proof),
        }
    }
}
