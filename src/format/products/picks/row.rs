//! The row of picks in the table of products.

use super::facts::{FACTS, SAMPLING, TRIALS};
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat, products::grasps::SHAPES};

const SCHEMAS: &[u8] = include_bytes!("../../generated/picks.bin");
const SAMPLING_SCHEMAS: &[u8] = include_bytes!("../../generated/pick_sampling.bin");

/// The row of picks in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "picks",
    summary: "Grasps of the bodies of settled scenes: which are free of obstacles, and the outcome of trials among the neighbours.",
    samples: Noun { one: "body", many: "bodies" },
    subjects: Noun { one: "scene", many: "scenes" },
    subjects_are_objects: false,
    subject_meaning: "The scene by content, 64 hexadecimal digits.",
    item_meaning: "Number of the body in the scene, minus one.",
    has_instances: false,
    channels: &[
        ChannelFormat::new(
            "/picks/grasps",
            "graspmill.PickCandidates",
            SCHEMAS,
            &[
                ArrayFormat::new(
                    "world_from_base",
                    "(candidates, 12) f64",
                    "the hand's base where it closes, by rows [m]",
                ),
                ArrayFormat::new("verdicts", "(candidates) u8", "obstacle: 0 nothing, 4 a neighbour"),
                ArrayFormat::new(
                    "clearances",
                    "(candidates) f64",
                    "distance from the obstacle, or from anything else than the body [m]",
                ),
                ArrayFormat::new(
                    "closed_joints",
                    "(free candidates, joints) f64",
                    "joints of the closed hand [rad or m]",
                ),
                ArrayFormat::new("world_from_object", "(bodies, 12) f64", "pose of each body by rows [m]"),
            ],
        ),
        ChannelFormat::new(
            TRIALS,
            "graspmill.PickTrials",
            SCHEMAS,
            &[ArrayFormat::new(
                "trials",
                "(tried candidates, ...)",
                "physical trials among the neighbours: verdict, bodies touched, moved and carried along",
            )],
        ),
        ChannelFormat::new(
            SAMPLING,
            "graspmill.PickSampling",
            SAMPLING_SCHEMAS,
            &[
                ArrayFormat::new("points", "(candidates, 6) f64", "the two points between the pads, in Object [m]"),
                ArrayFormat::new("openings", "(candidates) f64", "distance between the opened pads [m]"),
                ArrayFormat::new("depths", "(candidates) f64", "distance of the fingertips past the points [m]"),
            ],
        ),
    ],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: true,
    files: &[ExtraFile { name: SHAPES, meaning: "Shapes of the hand and meshes of the objects." }],
};
