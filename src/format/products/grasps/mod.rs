//! Grasps: runs that searched for grasps of a hand on an object, and physical trials of these grasps.

mod check;
mod facts;
mod ladder;
mod ladder_codec;
#[cfg(test)]
mod ladder_tests;
mod levels;
mod outcome;
mod row;
mod run;
#[cfg(test)]
mod run_tests;
mod series;
mod shapes;
mod trial;
#[cfg(test)]
mod trial_tests;
mod tried;
mod waypoints;

pub(super) use check::CHECKS;
pub use facts::{GraspFacts, LadderFacts, TrialFacts};
pub use ladder::{GraspLadder, GraspLadders, HELD_SHARE, LadderLabel, LadderMethod, LevelResult, LevelTrial};
pub use levels::{FailureReason, LadderLevel};
pub use outcome::TrialOutcome;
pub(crate) use row::RUN_SCHEMAS;
pub use row::{FORMAT, SHAPES};
pub use run::{FORCE, Grasp, GraspMethod, GraspRun, HandNames, HeldContact, RunInterval, Seed, WRENCH, WayObstacles};
pub use series::{SeriesMoment, TrialSeries, trial_phases};
pub use shapes::{HandJoint, HandShape, LinkSolid, ObjectShape, TrialHand};
pub use trial::{ClosedHand, GraspTrial, GraspTrials, PerturbedTrial, PressedContact, TableTrial, TrialMethod};
pub use tried::{GraspLabel, TrialVerdict, TriedStates};
pub use waypoints::Waypoint;

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Grasps of a hand on objects, by search or sampling, with their quality.
    pub const GRASPS: Self = Self::named("grasps");
}

impl Channel {
    /// [`GraspRun`]: one run of the search and the grasps that it found; every sample of grasps has one.
    pub const GRASP_RUN: Self = Self::at("/grasps/run");
    /// [`GraspTrials`]: physical trials of grasps of a run.
    pub const GRASP_TRIALS: Self = Self::at(facts::TRIALS);
    /// [`GraspLadders`]: graded labels of grasps of a run.
    pub const GRASP_LADDERS: Self = Self::at(facts::LADDER);
}

impl Record for GraspRun {
    const CHANNEL: Channel = Channel::GRASP_RUN;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for GraspTrials {
    const CHANNEL: Channel = Channel::GRASP_TRIALS;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for GraspLadders {
    const CHANNEL: Channel = Channel::GRASP_LADDERS;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
