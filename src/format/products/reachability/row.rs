//! The row of reachability in the table of products.

use super::facts::FACTS;
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat};

/// Name of the file of the field.
pub const FIELD: &str = "field.mcap";

pub(crate) const SCHEMAS: &[u8] = include_bytes!("../../generated/reachability.bin");

/// The row of reachability in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "reachability",
    summary: "Map of the poses that the end effector of a robot reaches without a collision.",
    samples: Noun { one: "position", many: "positions" },
    subjects: Noun { one: "robot", many: "robots" },
    subjects_are_objects: false,
    subject_meaning: "The robot by content, 64 hexadecimal digits.",
    item_meaning: "Number of the position, in C order over x, y, z.",
    has_instances: false,
    channels: &[ChannelFormat::new(
        "/reachability/block",
        "graspmill.ReachabilityBlock",
        SCHEMAS,
        &[
            ArrayFormat::new("labels", "(orientations) u8", "label of each pose at the position"),
            ArrayFormat::new("proofs", "(orientations) u8", "how each label is known"),
            ArrayFormat::new("witnesses", "(reachable, joints) f64", "joint values [rad, m]"),
        ],
    )],
    facts: &FACTS,
    has_splits: false,
    inherits_splits: false,
    files: &[ExtraFile { name: FIELD, meaning: "Labels and signed distances of the whole grid of poses." }],
};
