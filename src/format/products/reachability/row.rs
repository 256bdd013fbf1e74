//! The row of reachability in the table of products.

use super::facts::FACTS;
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat};

/// Name of the file of the field.
pub const FIELD: &str = "field.mcap";

pub(super) const SCHEMAS: &[u8] = include_bytes!("../../generated/reachability.bin");

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
    facts: &FACTS,
    has_splits: false,
    inherits_splits: false,
    files: &[ExtraFile { name: FIELD, meaning: "Labels and signed distances of the whole grid of poses." }],
};
