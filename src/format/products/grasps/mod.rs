//! Grasps: runs that searched for grasps of a hand on an object, and physical trials of what they kept.

mod check;
mod facts;
mod resting;
mod run;
#[cfg(test)]
mod run_tests;
mod shapes;
mod shapes_file;
mod trial;
#[cfg(test)]
mod trial_tests;

pub use facts::{GraspFacts, TrialFacts};
pub use resting::{InvalidResting, add_resting};
pub use run::{FORCE, Grasp, GraspMethod, GraspRun, HandNames, HeldContact, RunStretch, Seed, WRENCH};
pub use shapes::{HandJoint, HandShape, LinkSolid, ObjectShape, TrialHand};
pub use shapes_file::{SHAPES, Shapes, ShapesWriter};
pub use trial::{
    ClosedHand, GraspTrial, GraspTrials, PerturbedTrial, PressedContact, TrialMethod, TrialOutcome, TrialVerdict,
};

use crate::{
    ArrayFormat, Channel, ChannelFormat, ExtraFile, Noun, Product, ProductFormat,
    dataset::{DatasetError, Sample},
};

const RUN_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/grasp.bin"));
const TRIAL_SCHEMAS: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/trials.bin"));

/// The row of grasps in the table of products.
pub static FORMAT: ProductFormat = ProductFormat {
    name: "grasps",
    summary: "Grasps of a hand on objects, by search or sampling, with their quality.",
    samples: Noun { one: "run", many: "runs" },
    subjects: Noun { one: "object", many: "objects" },
    subjects_are_objects: true,
    subject_meaning: "The object by content, 64 hexadecimal digits.",
    item_meaning: "Number of the run: of its seed.",
    channels: &[
        ChannelFormat {
            topic: "/grasps/run",
            message: "graspmill.GraspRun",
            descriptors: RUN_SCHEMAS,
            arrays: &[ArrayFormat {
                name: "grasps",
                shape: "(grasps, ...)",
                meaning: "states of the hand: pose, posture, energies, contacts, quality, verdict",
            }],
        },
        ChannelFormat {
            topic: facts::TRIALS,
            message: "graspmill.GraspTrials",
            descriptors: TRIAL_SCHEMAS,
            arrays: &[ArrayFormat {
                name: "trials",
                shape: "(kept grasps, ...)",
                meaning: "physical trials: verdict, displacement, forces, perturbed runs",
            }],
        },
    ],
    facts: &facts::FACTS,
    has_splits: true,
    inherits_splits: false,
    files: &[ExtraFile {
        name: SHAPES,
        meaning: "Shapes of the hand and meshes of the objects.",
        in_root: None,
        check: check::check_shapes,
    }],
    check: || Box::new(check::RunCheck::default()),
};

impl Product {
    /// Grasps of a hand on objects, by search or sampling, with their quality.
    pub const GRASPS: Self = Self::named("grasps");
}

impl Channel {
    /// [`GraspRun`]: one run of the search and the grasps that it found; every sample of grasps has one.
    pub const GRASP_RUN: Self = Self::at("/grasps/run");
    /// [`GraspTrials`]: physical trials of the grasps that a run kept.
    pub const GRASP_TRIALS: Self = Self::at(facts::TRIALS);
}

impl Sample {
    /// One run of the search and its grasps.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is no valid record.
    pub fn grasp_run(&self) -> Result<GraspRun, DatasetError> {
        self.leading(Channel::GRASP_RUN, GraspRun::decode)
    }

    /// Trials of the grasps that the run kept; `None` where the dataset has none.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn grasp_trials(&self) -> Result<Option<GraspTrials>, DatasetError> {
        self.decoded(Channel::GRASP_TRIALS, GraspTrials::decode)
    }
}
