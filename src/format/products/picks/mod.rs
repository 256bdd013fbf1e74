//! Picks: grasps of the bodies of settled scenes, which of them the hand can reach without touching anything else, and the
//! outcome of trials among the neighbours.

mod candidates;
mod check;
mod facts;
mod row;
mod sampling;
#[cfg(test)]
mod tests;
mod trials;
mod words;

pub use candidates::{Blocked, PickCandidate, PickCandidates, PickPassage};
pub(super) use check::CHECKS;
pub use facts::{PickFacts, PickSamplingFacts, PickTrialFacts};
pub use row::FORMAT;
pub use sampling::{DrawnPick, PickPoses, PickSampling};
pub use trials::{AwakeNeighbour, PickProtocol, PickTrial, PickTrials, PressedThing};
pub use words::{AwakeBodies, PickObstacle, PickPhase, PickState, PickVerdict, TakenGrasps};

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Grasps of the bodies of settled scenes, free of obstacles or not, and trials among the neighbours.
    pub const PICKS: Self = Self::named("picks");
}

impl Channel {
    /// [`PickCandidates`]: grasps of one body, and their obstacles; every sample of picks has one.
    pub const PICK_CANDIDATES: Self = Self::at("/picks/grasps");

    /// [`PickTrials`]: physical trials of some of these grasps, among the neighbours.
    pub const PICK_TRIALS: Self = Self::at(facts::TRIALS);

    /// [`PickSampling`]: how the grasps of one body were sampled in its scene.
    pub const PICK_SAMPLING: Self = Self::at(facts::SAMPLING);
}

impl Record for PickCandidates {
    const CHANNEL: Channel = Channel::PICK_CANDIDATES;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PickTrials {
    const CHANNEL: Channel = Channel::PICK_TRIALS;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PickSampling {
    const CHANNEL: Channel = Channel::PICK_SAMPLING;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
