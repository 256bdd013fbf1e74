//! Reachability maps: which poses of a grid a robot's end effector reaches without a collision.

mod block;
mod check;
mod facts;
mod field;
mod field_file;
mod row;
#[cfg(test)]
mod tests;

pub use block::ReachabilityBlock;
pub(super) use check::CHECKS;
pub use facts::BlockFacts;
pub use field::{FieldHeader, ReachabilityField};
pub use field_file::{read_field, write_field};
pub use row::{FIELD, FORMAT};

use crate::{
    Channel, Product,
    dataset::{DatasetError, Sample},
};

impl Product {
    /// Map of the poses that the end effector of a robot reaches without a collision.
    pub const REACHABILITY: Self = Self::named("reachability");
}

impl Channel {
    /// [`ReachabilityBlock`]: labels, proofs and witnesses of one position; every reachability sample has one.
    pub const BLOCK: Self = Self::at("/reachability/block");
}

impl Sample {
    /// Labels, proofs and witnesses of the poses at one position.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn block(&self) -> Result<ReachabilityBlock, DatasetError> {
        self.leading(Channel::BLOCK, ReachabilityBlock::decode)
    }
}
