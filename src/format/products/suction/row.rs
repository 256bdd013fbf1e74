//! The row of suction in the table of products.

use super::facts::FACTS;
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat, products::grasps::SHAPES};

const SCHEMAS: &[u8] = include_bytes!("../../generated/suction.bin");

/// The row of suction in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "suction",
    summary: "Poses of a suction cup on the bodies of settled scenes: whether it seals, holds the body, and is free of obstacles.",
    samples: Noun { one: "body", many: "bodies" },
    subjects: Noun { one: "scene", many: "scenes" },
    subjects_are_objects: false,
    subject_meaning: "The scene by content, 64 hexadecimal digits.",
    item_meaning: "Number of the body in the scene, minus one.",
    has_instances: false,
    channels: &[ChannelFormat::new(
        "/suction/poses",
        "graspmill.SuctionPoses",
        SCHEMAS,
        &[
            ArrayFormat::new(
                "object_from_cup",
                "(poses, 12) f64",
                "the cup where its axis meets the surface, by rows [m]",
            ),
            ArrayFormat::new("results", "(poses) u8", "0 free, 1 blocked, 2 too weak, 3 leaking"),
            ArrayFormat::new("seal_margins", "(poses) f64", "1 less the used share of the limit of the seal used most"),
            ArrayFormat::new("hold_margins", "(poses) f64", "1 less the used share of the strength used most"),
            ArrayFormat::new("surfaces", "(poses, 11) f64", "measures of the surface under the cup"),
            ArrayFormat::new("obstacles", "(poses) u8", "obstacle: 0 nothing, 4 a neighbour"),
            ArrayFormat::new("robustness", "(poses) f64", "share of poses with errors in which a free cup holds"),
            ArrayFormat::new("world_from_object", "(bodies, 12) f64", "pose of each body by rows [m]"),
        ],
    )],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[ExtraFile { name: SHAPES, meaning: "Meshes of the objects." }],
};
