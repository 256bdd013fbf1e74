//! Reachability maps: which poses of a grid a robot's end effector reaches without a collision.

mod block;
mod check;
mod facts;
mod field;
mod row;
#[cfg(test)]
mod tests;

pub use block::ReachabilityBlock;
pub(super) use check::CHECKS;
pub use facts::BlockFacts;
pub use field::{FieldHeader, ReachabilityField};
pub(crate) use row::SCHEMAS;
pub use row::{FIELD, FORMAT};

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Map of the poses that the end effector of a robot reaches without a collision.
    pub const REACHABILITY: Self = Self::named("reachability");
}

impl Channel {
    /// [`ReachabilityBlock`]: labels, proofs and witnesses of one position; every reachability sample has one.
    pub const BLOCK: Self = Self::at("/reachability/block");
}

impl Record for ReachabilityBlock {
    const CHANNEL: Channel = Channel::BLOCK;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
