//! Grasps: runs that searched for grasps of a hand on an object, and physical trials of these grasps.

mod check;
mod facts;
mod outcome;
mod resting;
mod row;
mod run;
#[cfg(test)]
mod run_tests;
mod series;
mod shapes;
mod shapes_file;
mod trial;
#[cfg(test)]
mod trial_tests;
mod tried;
mod waypoints;

pub(super) use check::CHECKS;
pub use facts::{GraspFacts, TrialFacts};
pub use outcome::TrialOutcome;
pub use resting::{InvalidResting, add_resting};
pub use row::{FORMAT, SHAPES};
pub use run::{FORCE, Grasp, GraspMethod, GraspRun, HandNames, HeldContact, RunStretch, Seed, WRENCH, WayObstacles};
pub use series::{SeriesMoment, TrialSeries, trial_phases};
pub use shapes::{HandJoint, HandShape, LinkSolid, ObjectShape, TrialHand};
pub(in crate::products) use shapes_file::SHAPES_CHECK;
pub use shapes_file::{Shapes, ShapesWriter};
pub use trial::{ClosedHand, GraspTrial, GraspTrials, PerturbedTrial, PressedContact, TableTrial, TrialMethod};
pub use tried::{GraspLabel, TrialVerdict, TriedStates};
pub use waypoints::Waypoint;

use crate::{
    Channel, Product,
    dataset::{DatasetError, Sample},
};

impl Product {
    /// Grasps of a hand on objects, by search or sampling, with their quality.
    pub const GRASPS: Self = Self::named("grasps");
}

impl Channel {
    /// [`GraspRun`]: one run of the search and the grasps that it found; every sample of grasps has one.
    pub const GRASP_RUN: Self = Self::at("/grasps/run");
    /// [`GraspTrials`]: physical trials of grasps of a run.
    pub const GRASP_TRIALS: Self = Self::at(facts::TRIALS);
}

impl Sample {
    /// One run of the search and its grasps.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn grasp_run(&self) -> Result<GraspRun, DatasetError> {
        self.leading(Channel::GRASP_RUN, GraspRun::decode)
    }

    /// Trials of grasps of the run; `None` where the dataset has none.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn grasp_trials(&self) -> Result<Option<GraspTrials>, DatasetError> {
        self.decoded(Channel::GRASP_TRIALS, GraspTrials::decode)
    }
}
