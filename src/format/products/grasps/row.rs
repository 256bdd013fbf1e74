//! The row of grasps in the table of products.

use super::facts::{FACTS, LADDER, TRIALS};
use crate::{ArrayFormat, ChannelFormat, ExtraFile, Noun, ProductFormat};

/// Name of the file of shapes.
pub const SHAPES: &str = "shapes.mcap";

pub(crate) const RUN_SCHEMAS: &[u8] = include_bytes!("../../generated/grasp.bin");
const TRIAL_SCHEMAS: &[u8] = include_bytes!("../../generated/trials.bin");
const LADDER_SCHEMAS: &[u8] = include_bytes!("../../generated/ladder.bin");

/// The row of grasps in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "grasps",
    summary: "Grasps of a hand on objects, by search or sampling, with their quality.",
    samples: Noun { one: "run", many: "runs" },
    subjects: Noun { one: "object", many: "objects" },
    subjects_are_objects: true,
    subject_meaning: "The object by content, 64 hexadecimal digits.",
    item_meaning: "Number of the run: of its seed.",
    has_instances: false,
    channels: &[
        ChannelFormat::new(
            "/grasps/run",
            "graspmill.GraspRun",
            RUN_SCHEMAS,
            &[ArrayFormat::new(
                "grasps",
                "(grasps, ...)",
                "states of the hand: pose, posture, energies, contacts, quality, verdict",
            )],
        ),
        ChannelFormat::new(
            TRIALS,
            "graspmill.GraspTrials",
            TRIAL_SCHEMAS,
            &[ArrayFormat::new(
                "trials",
                "(tried grasps, ...)",
                "physical trials: verdict, displacement, forces, perturbed runs",
            )],
        ),
        ChannelFormat::new(
            LADDER,
            "graspmill.GraspLadders",
            LADDER_SCHEMAS,
            &[ArrayFormat::new(
                "ladders",
                "(tried grasps, ...)",
                "graded labels: obstacles of the way, verdict and margin per level, reason of a failure",
            )],
        ),
    ],
    facts: &FACTS,
    has_splits: true,
    inherits_splits: false,
    files: &[ExtraFile { name: SHAPES, meaning: "Shapes of the hand and meshes of the objects." }],
};
