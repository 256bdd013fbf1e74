//! A job for patches, checked, with everything that it takes from the dataset of grasps but the meshes.

use std::{collections::BTreeSet, path::PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{products::appearance::Colours, sections::JobHand};
use format::{GraspLabel, TRIAL_LABEL, TrialVerdict, trial_value};
use kernel::{
    geom::{Approach, HandBase, Intrinsics, Object, Pose, World},
    ids::{Digest, ObjectId},
    words::{GraspTypeCounts, GraspVerdict, Split},
};

/// Settings, hand and grasps of a job for patches.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchJob {
    /// The folder of the dataset of grasps.
    pub dataset: PathBuf,
    /// Grasps of the chosen types.
    pub grasps: FoundGrasps,
    /// The hand.
    pub hand: JobHand,
    /// Settings of the images.
    pub settings: PatchSettings,
}

/// Grasps of the most common types in a dataset.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundGrasps {
    /// Digest of the dataset's exact numbers.
    pub root: Digest,
    /// Digest of its physics numbers, where labels are those of trials.
    pub trials: Option<Digest>,
    /// Hand by content.
    pub hand: ObjectId,
    /// Space of force closure: `force` or `wrench`.
    pub space: String,
    /// Counts of its grasps by type, and the chosen types.
    pub types: GraspTypeCounts,
    /// Objects, sorted by content.
    pub objects: Vec<GraspedObject>,
    /// Objects per nested training subset, smallest first.
    pub training_subsets: Vec<u32>,
}

/// An object, and its grasps of the chosen types.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspedObject {
    /// By content.
    pub id: ObjectId,
    /// Name in the dataset of grasps.
    pub name: String,
    /// Row in that dataset's table of assets.
    pub asset: serde_json::Value,
    /// Split of the object in that dataset.
    pub split: Split,
    /// Held-out runs of a training object.
    pub holdout_runs: BTreeSet<u32>,
    /// Smallest nested subset that holds a training object.
    pub subset: Option<u32>,
    /// Grasps of the chosen types, by run and rank.
    pub grasps: Vec<ChosenGrasp>,
}

/// A grasp of one of the chosen types: a kept one, or with labels of trials a tried one.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenGrasp {
    /// Run of the grasp: the number of the seed.
    pub run: u32,
    /// Rank in that run.
    pub rank: u32,
    /// Grasp type.
    pub kind: u32,
    /// The approach frame.
    pub object_from_approach: Pose<Object, Approach>,
    /// The hand's base.
    pub object_from_base: Pose<Object, HandBase>,
    /// All joints of the closed hand [rad or m].
    pub joints: Vec<f64>,
    /// Energy that annealing minimised, before closing.
    pub energy: f64,
    /// Epsilon of the closed hand, in the space of the job for grasps.
    pub epsilon: f64,
    /// Verdict of the analytic criteria.
    pub verdict: GraspVerdict,
    /// Outcome of the trials, where labels are those of trials.
    pub trial: Option<GraspTrialEnd>,
    /// The resting pose of the object on a table that the grasp allows, if the job has a table and there is such a
    /// pose.
    pub table: Option<GraspTable>,
}

/// Resting pose of the object of a grasp: the most likely one above whose table the hand stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspTable {
    /// Index into the object's resting poses.
    pub pose: u32,
    /// The object on the table, whose top is the plane z = 0.
    pub world_from_object: Pose<World, Object>,
}

/// Outcome of the trials of a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GraspTrialEnd {
    /// Label that all of them make together.
    pub outcome: GraspLabel,
    /// End of the one in the air.
    pub trial: TrialVerdict,
}

/// Settings of the images of grasps.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchSettings {
    /// Requested number of types, at least 1.
    pub types: u32,
    /// Side of a patch [px].
    pub side: u32,
    /// Side of the squares of patches in metres [m]; `None` without such patches.
    pub metric: Option<f64>,
    /// Whether the object rests on a table.
    pub table: bool,
    /// Whether points behind the surface are marked.
    pub visibility: bool,
    /// The contacts of the hand that are F0, F1 and F2.
    pub tips: [String; 3],
    /// Label of a patch.
    pub label: PatchLabel,
    /// The camera.
    pub camera: Intrinsics,
    /// The camera's horizontal field of view [rad], as written.
    pub horizontal_fov: f64,
    /// Distance from the camera to the centre of the object's box [m].
    pub distance: f64,
    /// Quirk of the thesis: the focal length that points are projected with [px]; `None`: the camera's.
    pub point_focal_length: Option<f64>,
    /// Colours in addition to depth; `None` without.
    pub colour: Option<Colours>,
    /// Whether the whole image is stored in addition to its patches.
    pub image: bool,
    /// Truth for heatmaps over the whole image: largest angle between an approach and the camera's axis [rad]; `None` without.
    pub heatmap_angle: Option<f64>,
}

impl PatchSettings {
    /// The camera that points are projected with.
    pub fn projection(&self) -> Intrinsics {
        self.camera.with_focal_length(self.point_focal_length)
    }

    /// The label of a grasp.
    pub fn label_of(&self, grasp: &ChosenGrasp) -> f32 {
        let label = match self.label {
            PatchLabel::Epsilon => -grasp.epsilon,
            PatchLabel::Energy => grasp.energy,
            PatchLabel::Trial => grasp.trial.map_or(0.0, |trial| f64::from(trial_value(trial.outcome))),
        };
        label as f32
    }
}

/// Label of a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PatchLabel {
    /// -epsilon of the closed hand: below 0, so that a grasp is better than none.
    Epsilon,
    /// Quirk of the thesis: the energy that annealing minimised. It can be above 0, where no grasp is labelled better
    /// than one.
    Energy,
    /// Label by physics: -1 for a grasp that held in all its trials, 1 for one that failed in all, 0 where they
    /// disagree or have no result. Samples are the grasps that were tried, regardless of the analytic criteria.
    Trial,
}

impl PatchLabel {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Epsilon => "epsilon",
            Self::Energy => "energy",
            Self::Trial => TRIAL_LABEL,
        }
    }
}
