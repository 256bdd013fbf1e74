//! Suction: poses of a suction cup on the bodies of settled scenes, whether the cup seals there and holds the body, and which of the
//! poses it reaches without touching anything else.

mod check;
mod codec;
mod facts;
mod poses;
mod row;
#[cfg(test)]
mod tests;

pub(super) use check::CHECKS;
pub use facts::SuctionFacts;
pub use poses::{
    CupMeasures, SealedSurface, SuctionDraws, SuctionHold, SuctionPose, SuctionPoses, SuctionResult, SuctionRules,
};
pub use row::FORMAT;

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Poses of a suction cup on the bodies of settled scenes.
    pub const SUCTION: Self = Self::named("suction");
}

impl Channel {
    /// [`SuctionPoses`]: poses on one body, with seal, hold and obstacles; every sample of suction has one.
    pub const SUCTION_POSES: Self = Self::at("/suction/poses");
}

impl Record for SuctionPoses {
    const CHANNEL: Channel = Channel::SUCTION_POSES;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
