//! The keys of a job for patches.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::settings::PatchLabel;
use crate::{products::appearance::RenderSpec, sections::spec::HandSpec};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that renders the image patches around the palm and the fingertips of grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PatchesSpec {
    /// The grasps, a finished dataset.
    pub grasps: GraspsSourceSpec,
    /// The hand of these grasps, which defines its fingertips.
    // Without an `Option` a mistake in it would hide those of the other keys.
    #[schemars(required)]
    pub hand: Option<HandSpec>,
    /// The patches and their labels.
    pub patches: PatchSpec,
    /// The camera. It points along the approach at the centre of the object's box; up is the object's z axis (on a table the
    /// table's normal), or its x axis where the approach is within 5 degrees of that.
    pub camera: PatchCameraSpec,
    /// Surroundings of the object.
    pub scene: PatchSceneSpec,
    /// The images.
    pub render: RenderSpec,
    /// Whole images in addition to the patches.
    pub images: PatchImagesSpec,
    /// The files of the dataset.
    pub shards: PatchShardsSpec,
}

impl PatchesSpec {
    /// The standard defaults, without a dataset and a hand.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// Source of the grasps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GraspsSourceSpec {
    /// The folder of a finished dataset of grasps; relative to the job file.
    #[schemars(required, extend("examples" = ["../datasets/ycb-grasps"]))]
    pub dataset: Option<PathBuf>,
    /// The digest of its exact numbers (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub root: Option<String>,
    /// With `label = "trial"`: the digest of its physics numbers (64 hexadecimal digits); a resolved job pins it.
    #[schemars(regex(pattern = "^[0-9a-f]{64}$"))]
    pub trials_root: Option<String>,
    /// Number of grasp types: the most common ones among the kept grasps of the whole dataset, with `label = "trial"`
    /// among those that held, on a table among those that a table allows, the lower type first where two are equally
    /// common. Grasps of other types are left out.
    #[schemars(range(min = 1, max = 4096), extend("x-unit" = "types"))]
    pub types: u32,
}

/// The patches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchSpec {
    /// Side of each patch.
    #[schemars(range(min = 4, max = 1024), extend("x-unit" = "px"))]
    pub side: u32,
    /// The fingertips F0, F1 and F2: contacts of the hand, by the names of their sites.
    #[schemars(length(min = 3, max = 3))]
    pub tips: Vec<String>,
    /// The number in a label vector that is not 0.
    pub label: PatchLabel,
    /// Marks each point that the surface in the depth image hides.
    pub visibility: bool,
    /// Stores in addition to the patches of `side` pixels others that show squares of one size in metres, `size`, at
    /// the depth of their points, resampled to `side` pixels.
    pub metric: bool,
    /// With `metric`: side of these squares.
    #[schemars(range(max = 10), extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub size: f64,
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchCameraSpec {
    /// Distance of the camera from the centre of the object's box, back along the approach.
    #[schemars(range(max = 100), extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub distance: f64,
    /// Image width.
    #[schemars(range(min = 8, max = 16384), extend("x-unit" = "px"))]
    pub width: u32,
    /// Image height.
    #[schemars(range(min = 8, max = 16384), extend("x-unit" = "px"))]
    pub height: u32,
    /// Horizontal field of view; pixels are square, the principal point is in the middle.
    #[schemars(extend("x-unit" = "rad", "exclusiveMinimum" = 0, "maximum" = 3.1))]
    pub horizontal_fov: f64,
    /// Nearest visible distance along the optical axis.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub near: f64,
    /// Quirk of the thesis: points of the hand are projected with this focal length and not with that of the images, so
    /// that patches are off their points, increasingly towards the border (6 % for 640 px and 1.047 rad).
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0))]
    pub point_focal_length: Option<f64>,
}

/// Surroundings of the object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchSceneSpec {
    /// Puts the object on a table, in the most likely of its resting poses in which the hand stays above it. Grasps that no
    /// table allows are rejected, and the roll in a grasp's type is that against the camera over the table.
    pub table: bool,
}

/// Whole images in addition to the patches, each on a separate topic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchImagesSpec {
    /// The depth image that the patches are cut from; with `render.colour` also the same image in colour.
    pub full: bool,
    /// Truth for heatmaps over that image: palm and fingertips of all grasps of the object, of the chosen types, that
    /// approach from about the camera's direction.
    pub heatmaps: bool,
    /// With `heatmaps`: largest angle between their approaches and the camera's axis.
    #[schemars(range(min = 0, max = std::f64::consts::PI), extend("x-unit" = "rad"))]
    pub heatmap_angle: f64,
}

/// The files of the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PatchShardsSpec {
    /// Grasps per shard. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "grasps"))]
    pub samples: u32,
}
