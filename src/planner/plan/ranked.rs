//! Results of a plan.

use nalgebra::IsometryMatrix3;

use super::{funnel::Funnel, inputs::MotionVerdict, member::Member, shares::MEMBERS};
use robot::grasp::{GraspContact, Quality};

/// Energies of a grasp, apart, by exact distances; lower is better.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankedEnergies {
    /// The contact energy with gamma = 50, of all contacts [mm].
    pub contact: f64,
    /// The potential, not scaled; 1 where fewer than three contacts count.
    pub potential: f64,
    /// Energy of the state in the search, by its lattice; infinite of a state that no search found.
    pub searched: f64,
    /// Distance from the border of the reachable set [cells], negative inside; `None` without a map.
    pub distance: Option<f64>,
}

/// A grasp of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct RankedGrasp {
    /// Member that proposed it.
    pub member: Member,
    /// The hand's base where it closes, expressed in the scene [m].
    pub scene_from_base: IsometryMatrix3<f64>,
    /// The approach frame there, expressed in the object's frame [m].
    pub object_from_approach: IsometryMatrix3<f64>,
    /// Posture before the hand closes, one value per driven joint [rad or m].
    pub posture: Vec<f64>,
    /// The base 10 cm back along the approach, expressed in the scene [m].
    pub scene_from_pregrasp: IsometryMatrix3<f64>,
    /// Posture of the pregrasp: opened, or that of the grasp where the opened hand is not free.
    pub pregrasp_posture: Vec<f64>,
    /// All joints of the closed hand [rad or m], in the order of its tree.
    pub joints: Vec<f64>,
    /// Where the closed hand touches.
    pub contacts: Vec<GraspContact>,
    /// Contacts on cells that the camera saw; `None` where these are not known.
    pub seen_contacts: Option<u32>,
    /// Energies apart.
    pub energies: RankedEnergies,
    /// Quality of the contacts of the closed hand.
    pub quality: Quality,
    /// Epsilon in the space of [`Keeping`](robot::grasp::Keeping).
    pub epsilon: f64,
    /// Probability that the grasp can be reached; 1 without a map.
    pub p_reach: f64,
    /// Probability that it holds.
    pub p_held: f64,
    /// Smallest distance of the hand from table and neighbours on its path, up to 10 mm [m].
    pub clearance: f64,
    /// Verdict of the motion stage.
    pub motion: MotionVerdict,
    /// Work of the plan until the grasp was kept, in steps of a search.
    pub work: u64,
}

/// One round of a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundReport {
    /// Shares of the members in the round, in the order of [`Member::ALL`].
    pub shares: [f64; MEMBERS],
    /// Work of each member, with the rating of its states.
    pub work: [u64; MEMBERS],
    /// Distinct grasps of each that were kept.
    pub kept: [u64; MEMBERS],
}

/// Grasps of a plan, the best first.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspPlan {
    /// Distinct grasps that passed every stage, at most as many as wanted.
    pub grasps: Vec<RankedGrasp>,
    /// Ends of all proposed states.
    pub funnel: Funnel,
    /// The rounds.
    pub rounds: Vec<RoundReport>,
    /// Seeds on the surface that were dropped before they cost a step: two cells and more outside of the reachable set.
    pub dropped_seeds: u32,
    /// Work in all, in steps of a search.
    pub work: u64,
}
