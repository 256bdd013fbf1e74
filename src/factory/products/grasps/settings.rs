//! A job for grasps, checked.

use crate::sections::{JobHand, JobObjects};
use format::{Channel, TriedStates};
use robot::grasp::{Annealing, Keeping, Sampler};
use sim::Variant;

/// Settings, hand and objects of a job for grasps.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspJob {
    /// The objects and their split.
    pub objects: JobObjects,
    /// The hand.
    pub hand: JobHand,
    /// Settings of the search and of its judgement.
    pub settings: GraspSettings,
}

/// Settings of the search for grasps and of its judgement.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspSettings {
    /// Runs per object, at least 1.
    pub seeds: u32,
    /// Source of states of the hand.
    pub sampler: Sampler,
    /// The search; for the other samplers, the rating of states.
    pub annealing: Annealing,
    /// Conditions under which a grasp is kept.
    pub keeping: Keeping,
    /// Physical trials; `None` without.
    pub physics: Option<Physics>,
}

impl GraspSettings {
    /// Whether trials depend on the known mass of each object.
    pub fn asks_for_masses(&self) -> bool {
        self.physics.is_some_and(|physics| physics.mass.is_none())
    }
}

/// Physical trials of the states that a run found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Physics {
    /// States that are tried.
    pub tried: TriedStates,
    /// Coefficient of friction.
    pub friction: f64,
    /// Mass of every object [kg]; `None`: that of the job, otherwise by its convex hull.
    pub mass: Option<f64>,
    /// Perturbed runs of each grasp.
    pub perturbed_runs: u32,
    /// Share of the grasps that are rolled out, 0 to 1.
    pub rollout_share: f64,
    /// Runs of each grasp that is rolled out, at least 1.
    pub rollouts: u32,
    /// Share of the held grasps that are tried under every variant, 0 to 1.
    pub variant_share: f64,
    /// Share of the tried grasps whose trials are stored over time, 0 to 1.
    pub series_share: f64,
    /// Trials that are made again before their outcome is a label.
    pub confirm: Confirm,
    /// Most grasps of a run that are labelled failed, for each that is labelled held: 0 or positive.
    pub failed_per_held: f64,
    /// Gravity from six directions, without lift and shake.
    pub six_directions: bool,
    /// Friction of the object against the table on which grasps are tried as well; `None` where they are not.
    pub table_friction: Option<f64>,
    /// Method of the labels.
    pub labels: Labels,
}

/// Method by which trials become labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Labels {
    /// Trials in the air, on a table, perturbed and confirmed that agree.
    Agreement,
    /// A share of levels of rising difficulty.
    Ladder,
}

/// Choice of the trials that are made again before their outcome is a label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Confirm {
    /// None.
    None,
    /// Trials that failed.
    Failed,
    /// Trials that failed, and trials that held, once.
    Both,
    /// Both, and trials that held by MuJoCo's default settings too.
    Strict,
}

impl Confirm {
    /// Harder conditions, under which a grasp that held is tried again, one after another.
    pub fn harder(self) -> &'static [Variant] {
        match self {
            Self::None | Self::Failed => &[],
            Self::Both => &Variant::HARDER[..1],
            Self::Strict => &Variant::HARDER,
        }
    }

    /// Easier conditions, under which a grasp that failed is tried again.
    pub fn easier(self) -> &'static [Variant] {
        if self == Self::None { &[] } else { &Variant::EASIER }
    }
}

impl Labels {
    /// The channel that holds the labels.
    pub fn channel(self) -> Channel {
        match self {
            Self::Agreement => Channel::GRASP_TRIALS,
            Self::Ladder => Channel::GRASP_LADDERS,
        }
    }
}

impl Physics {
    /// Largest number of grasps labelled failed in a run with this number labelled held: at least one, unless set to zero.
    pub fn negatives(&self, held: usize) -> usize {
        let least = usize::from(self.failed_per_held > 0.0);
        ((self.failed_per_held * held as f64).ceil() as usize).max(least)
    }
}

impl GraspSettings {
    /// Steps of a run: steps of annealing, approaches or pairs.
    pub fn steps(&self) -> u32 {
        match &self.sampler {
            Sampler::Annealing => self.annealing.steps,
            Sampler::Uniform(uniform) => uniform.grasps,
            Sampler::Antipodal(antipodal) => antipodal.pairs,
            Sampler::Approach(approach) => approach.draws,
        }
    }
}
