//! A job for grasps, checked.

use super::{JobHand, JobObject, SplitSettings};
use crate::{
    assets::MeshRefusal,
    grasp::{Annealing, Keeping},
};

/// Which grasps of which hand are searched for on which objects.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspJob {
    /// The objects, sorted by name; no two have the same content.
    pub objects: Vec<JobObject>,
    /// Meshes that cannot be used; the run goes on without them and ends with exit code 3.
    pub refused: Vec<MeshRefusal>,
    /// The hand.
    pub hand: JobHand,
    /// How grasps are searched for and judged.
    pub settings: GraspSettings,
    /// Who trains and who tests.
    pub split: SplitSettings,
}

/// How grasps are searched for and judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspSettings {
    /// Runs of annealing an object, at least 1.
    pub seeds: u32,
    /// The search.
    pub annealing: Annealing,
    /// What is kept.
    pub keeping: Keeping,
}
