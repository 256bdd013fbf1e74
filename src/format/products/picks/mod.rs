//! Picks: grasps of the bodies of settled scenes, which of them the hand can reach without touching anything else, and the
//! outcome of trials among the neighbours.

mod candidates;
mod check;
mod facts;
mod row;
#[cfg(test)]
mod tests;
mod trials;
mod words;

pub use candidates::{Blocked, PickCandidate, PickCandidates, PickPassage};
pub(super) use check::CHECKS;
pub use facts::{PickFacts, PickTrialFacts};
pub use row::FORMAT;
pub use trials::{AwakeNeighbour, PickProtocol, PickTrial, PickTrials, PressedThing};
pub use words::{AwakeBodies, PickObstacle, PickPhase, PickState, PickVerdict, TakenGrasps};

use crate::{
    Channel, Product,
    dataset::{DatasetError, Sample},
};

impl Product {
    /// Grasps of the bodies of settled scenes, free of obstacles or not, and trials among the neighbours.
    pub const PICKS: Self = Self::named("picks");
}

impl Channel {
    /// [`PickCandidates`]: grasps of one body, and their obstacles; every sample of picks has one.
    pub const PICK_CANDIDATES: Self = Self::at("/picks/grasps");

    /// [`PickTrials`]: physical trials of some of these grasps, among the neighbours.
    pub const PICK_TRIALS: Self = Self::at(facts::TRIALS);
}

impl Sample {
    /// Grasps of one body of a scene, and their obstacles.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn pick_candidates(&self) -> Result<PickCandidates, DatasetError> {
        self.leading(Channel::PICK_CANDIDATES, PickCandidates::decode)
    }

    /// Physical trials of some of these grasps; `None` where the dataset has none.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn pick_trials(&self) -> Result<Option<PickTrials>, DatasetError> {
        self.decoded(Channel::PICK_TRIALS, PickTrials::decode)
    }
}
