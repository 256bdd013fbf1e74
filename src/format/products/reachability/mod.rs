//! Reachability maps: which poses of a grid a robot's end effector reaches without a collision.

mod block;
mod check;
mod facts;
mod field;
mod field_file;
#[cfg(test)]
mod tests;

pub use block::ReachabilityBlock;
pub use facts::BlockFacts;
pub use field::{FieldHeader, ReachabilityField};
pub use field_file::{FIELD, read_field, write_field};

use crate::{
    ArrayFormat, Channel, ChannelFormat, ExtraFile, Noun, Product, ProductFormat, RootPart,
    dataset::{DatasetError, Sample},
};

pub(super) const SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/reachability.bin"));

/// The row of reachability in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "reachability",
    summary: "Map of the poses that the end effector of a robot reaches without a collision.",
    samples: Noun { one: "position", many: "positions" },
    subjects: Noun { one: "robot", many: "robots" },
    subjects_are_objects: false,
    subject_meaning: "The robot by content, 64 hexadecimal digits.",
    item_meaning: "Number of the position, in C order over x, y, z.",
    channels: &[ChannelFormat {
        topic: "/reachability/block",
        message: "graspmill.ReachabilityBlock",
        descriptors: SCHEMAS,
        arrays: &[
            ArrayFormat { name: "labels", shape: "(orientations) u8", meaning: "label of each pose at the position" },
            ArrayFormat { name: "proofs", shape: "(orientations) u8", meaning: "how each label is known" },
            ArrayFormat { name: "witnesses", shape: "(reachable, joints) f64", meaning: "joint values [rad, m]" },
        ],
    }],
    facts: &facts::FACTS,
    has_splits: false,
    inherits_splits: false,
    files: &[ExtraFile {
        name: FIELD,
        meaning: "Labels and signed distances of the whole grid of poses.",
        in_root: Some(RootPart { word: "field", digest: field_file::payload_digest }),
        check: check::check_field,
    }],
    check: || Box::new(check::BlockCheck),
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
    /// When the sample is of another product, or the payload is no valid record.
    pub fn block(&self) -> Result<ReachabilityBlock, DatasetError> {
        self.leading(Channel::BLOCK, ReachabilityBlock::decode)
    }
}
