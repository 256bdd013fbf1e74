//! The keys of a job for heatmaps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    products::{picked::PicksSourceSpec, viewed::ViewsSourceSpec},
    sections::spec::HandSpec,
};
use format::HeatmapLabel;

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that marks the grasps of all bodies of settled scenes in images of these scenes: positions of palm and
/// fingertips of the hand, and the label of each grasp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeatmapsSpec {
    /// The views, a finished dataset: their cameras and scenes.
    pub views: ViewsSourceSpec,
    /// The grasps of the bodies of the same scenes, a finished dataset.
    pub picks: PicksSourceSpec,
    /// The hand of these grasps, which defines its fingertips.
    // Without an `Option` a mistake in it would hide those of the other keys.
    #[schemars(required)]
    pub hand: Option<HandSpec>,
    /// The heatmaps and their labels.
    pub heatmaps: HeatmapSpec,
    /// The patches around the points of a grasp, where all of them are well inside the image.
    pub patches: SquaresSpec,
    /// The files of the dataset.
    pub shards: HeatmapShardsSpec,
}

impl HeatmapsSpec {
    /// The standard defaults, without datasets and a hand.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// The heatmaps and their labels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatmapSpec {
    /// The label of a grasp.
    pub label: LabelSpec,
    /// Number of grasp types: the most common ones among the free grasps of the whole dataset, with `label = "trial"`
    /// among those that held, the lower type first where two are equally common. Grasps of other types are counted and
    /// left out. Grasps of a hand without types count as one type.
    #[schemars(range(min = 1, max = 4096), extend("x-unit" = "types"))]
    pub types: u32,
    /// The fingertips: contacts of the hand, by the names of their sites. Default: the pads of a hand with two pads;
    /// required for every other hand.
    #[schemars(length(min = 1, max = 15), extend("examples" = [["distal_1_outer", "distal_2_outer", "distal_3_outer"]]))]
    pub tips: Option<Vec<String>>,
    /// Largest angle between the approaches of the marked grasps and the camera's axis.
    #[schemars(range(min = 0, max = std::f64::consts::PI), extend("x-unit" = "rad"))]
    pub max_angle: f64,
    /// Step of the stored depth, as 16-bit numbers; 0 stores metres as 32-bit floats.
    #[schemars(range(min = 0, max = 0.01), extend("x-unit" = "m"))]
    pub depth_step: f64,
}

/// Label of a grasp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LabelSpec {
    /// Label by trials among the neighbours: -1 for a grasp that held, 1 for one that failed, 0 without a result.
    Trial,
    /// -1 for every free grasp: the hand reaches it and closes without touching anything else.
    Free,
}

impl From<LabelSpec> for HeatmapLabel {
    fn from(label: LabelSpec) -> Self {
        match label {
            LabelSpec::Trial => Self::Trial,
            LabelSpec::Free => Self::Free,
        }
    }
}

impl From<HeatmapLabel> for LabelSpec {
    fn from(label: HeatmapLabel) -> Self {
        match label {
            HeatmapLabel::Trial => Self::Trial,
            HeatmapLabel::Free => Self::Free,
        }
    }
}

/// The patches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SquaresSpec {
    /// Side of each patch.
    #[schemars(range(min = 4, max = 1024), extend("x-unit" = "px"))]
    pub side: u32,
    /// Stores in addition to the squares of `side` pixels others that cover one size in metres, `size`, at the depth of
    /// their points.
    pub metric: bool,
    /// With `metric`: side of these squares.
    #[schemars(range(max = 10), extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub size: f64,
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeatmapShardsSpec {
    /// Images per shard. Default: a thirty-second of all images, at least 8 and at most 64, since threads and tasks
    /// make whole shards. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "images", "examples" = [64]))]
    pub samples: Option<u32>,
}
