//! A job for grasps, checked.

use super::{JobHand, JobObject, SplitSettings};
use crate::{
    assets::MeshRefusal,
    grasp::{Annealing, Keeping, Sampler},
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
#[derive(Clone, Debug, PartialEq)]
pub struct GraspSettings {
    /// Runs an object, at least 1.
    pub seeds: u32,
    /// How states of the hand are come by.
    pub sampler: Sampler,
    /// The search; where there is none, how states are rated.
    pub annealing: Annealing,
    /// What is kept.
    pub keeping: Keeping,
    /// How what is kept is tried; `None` where it is not.
    pub physics: Option<Physics>,
}

impl GraspSettings {
    /// Whether trials depend on what each object weighs by itself.
    pub fn asks_for_masses(&self) -> bool {
        self.physics.is_some_and(|physics| physics.mass.is_none())
    }
}

/// Physical trials of the kept grasps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physics {
    /// Coefficient of friction.
    pub friction: f64,
    /// What each object weighs [kg]; `None` as the job knows of it, else by its volume.
    pub mass: Option<f64>,
    /// Perturbed runs of each grasp.
    pub perturbed: u32,
    /// Share of the grasps that are rolled out, 0 to 1.
    pub roll_out_share: f64,
    /// Runs of each of these, at least 1.
    pub roll_outs: u32,
    /// Gravity from six directions, without lift and shake.
    pub six_directions: bool,
}

impl GraspSettings {
    /// Steps of a run: of annealing, or how many states or pairs it looks at.
    pub fn steps(&self) -> u32 {
        match &self.sampler {
            Sampler::Annealing => self.annealing.steps,
            Sampler::Uniform(uniform) => uniform.grasps,
            Sampler::Antipodal(antipodal) => antipodal.pairs,
        }
    }

    /// Grasps of a run, at most.
    pub fn best(&self) -> u32 {
        match &self.sampler {
            Sampler::Annealing => self.annealing.best,
            Sampler::Uniform(uniform) => uniform.grasps,
            Sampler::Antipodal(antipodal) => antipodal.best,
        }
    }
}

impl Physics {
    /// Trials of a kept grasp, on average.
    pub fn trials(&self) -> f64 {
        1.0 + f64::from(self.perturbed) + self.roll_out_share * f64::from(self.roll_outs)
    }
}
