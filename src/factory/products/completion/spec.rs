//! The keys of a completion job.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    settings::{Pivot, Renderer},
    spec_occlusion::OcclusionSpec,
};
use crate::{
    products::pair::{ChannelsSpec, GridSpec, TruthSpec, touch::TouchSpec},
    sections::spec::{ObjectsSpec, SensorSpec, SplitSpec},
};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [
    concat!(
        include_str!("profiles/standard.toml"),
        include_str!("../pair/channels.toml"),
        include_str!("../pair/touch.toml")
    ),
    include_str!("profiles/thesis.toml"),
];

/// A job that makes shape-completion pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompletionSpec {
    /// Sources of the objects: one or several `[[objects]]` entries, each with exactly one of `folder`, `list`,
    /// `package` and `built_in`.
    #[schemars(length(min = 1))]
    pub objects: Vec<ObjectsSpec>,
    /// Rotations of each object: a named set or a table.
    pub views: RotationsSpec,
    /// Pivot of an object's rotation, which is at the stated distance.
    #[schemars(extend("examples" = ["box_centre"]))]
    pub pivot: Pivot,
    /// Camera, by numbers, by the name of a depth sensor, or from an MJCF scene.
    pub camera: CameraSpec,
    /// Distance from the camera to the pivot, along the optical axis: a number, a range, or a share of the image to
    /// fill.
    #[schemars(extend("x-unit" = "m"))]
    pub distance: DistanceSpec,
    /// Renderer of the depth image.
    #[schemars(extend("examples" = ["raster"]))]
    pub renderer: Renderer,
    /// Sensor model, which adds noise to a perfect depth image.
    pub sensor: SensorSpec,
    /// Occluders between the camera and the object in a share of the views. Default: no occluders.
    pub occlusion: Option<OcclusionSpec>,
    /// The occupancy grids.
    pub grid: GridSpec,
    /// Rule for the occupied cells of the complete grid.
    pub truth: TruthSpec,
    /// Limits for pairs; others are rejected with a reason and counted.
    pub gate: GateSpec,
    /// Objects for training, validation and test.
    pub split: SplitSpec,
    /// Channels stored in addition to the partial and the complete grid.
    pub channels: ChannelsSpec,
    /// Tactile contacts on the hidden surface, stored with each pair.
    pub touch: TouchSpec,
    /// The files of the dataset.
    pub shards: ShardsSpec,
}

impl CompletionSpec {
    /// The standard defaults, without objects.
    pub fn standard() -> Self {
        form::decode_own(&format!("objects = []\n{}", PROFILES[0]))
    }
}

/// Rotations of each object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum RotationsSpec {
    /// A named set.
    Named(NamedViews),
    /// Every combination of roll, pitch and yaw, R = Rz(yaw) Ry(pitch) Rx(roll).
    Grid(GridViews),
    /// Rotations spread evenly over all of SO(3).
    Even(EvenViews),
    /// List of rotations, as roll, pitch and yaw.
    RollPitchYaw(RpyViews),
    /// List of rotations, as quaternions.
    Quaternions(QuaternionViews),
    /// List of rotations, as matrices.
    Matrices(MatrixViews),
}

/// A named set of views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedViews {
    /// 11 x 6 x 11 = 726 different rotations: roll, yaw = -pi + 2 pi k / 11, pitch -75 to 75 degrees in steps of 30.
    Standard,
    /// 11 x 6 x 11 = 726 views on closed ranges, as in the thesis; only 420 rotations differ.
    Thesis,
    /// Upright, seen from 12 sides at its own height.
    HeadOn,
}

/// Every combination of roll, pitch and yaw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GridViews {
    /// Roll angles, about the world's x axis (towards the object), applied first.
    #[schemars(extend("examples" = [[0.0, 1.57]]))]
    pub roll: AnglesSpec,
    /// Pitch angles, about the world's y axis.
    #[schemars(extend("examples" = [{ "from": -1.2, "to": 1.2, "count": 6 }]))]
    pub pitch: AnglesSpec,
    /// Yaw angles, about the world's z axis (up), applied last.
    #[schemars(extend("examples" = [{ "from": -3.0, "to": 3.0, "count": 7 }]))]
    pub yaw: AnglesSpec,
    /// Unit of the angles. Default: radians.
    pub unit: Option<AngleUnit>,
}

/// Angles, as a list or as a range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum AnglesSpec {
    /// A list.
    List(#[schemars(length(min = 1))] Vec<f64>),
    /// Equal steps.
    Range(AngleRange),
}

/// Angles in equal steps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleRange {
    /// The first angle.
    pub from: f64,
    /// Last angle, or one step beyond it.
    pub to: f64,
    /// Number of angles.
    #[schemars(range(min = 1, max = 100_000))]
    pub count: u32,
    /// Whether `to` is one of the angles. Default: `closed`.
    pub ends: Option<Ends>,
}

/// Whether a range contains its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ends {
    /// The last angle is `to`.
    Closed,
    /// The last angle is one step before `to`: for a full rotation.
    Open,
}

/// Unit of angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum AngleUnit {
    /// Radians.
    #[serde(rename = "rad")]
    Radian,
    /// Degrees.
    #[serde(rename = "deg")]
    Degree,
}

/// Rotations spread evenly over all of SO(3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvenViews {
    /// Number of views: a super-Fibonacci spiral (Alexa, CVPR 2022).
    #[schemars(range(min = 1, max = 1_000_000), extend("examples" = [500]))]
    pub even: u32,
    /// Whether the views of each object are rotated, all together, by a separate random rotation. If false, the
    /// default, the camera views every object along the same directions.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("examples" = [true]))]
    pub per_object: bool,
}

/// Rotations as roll, pitch, yaw.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RpyViews {
    /// Triples of roll, pitch and yaw.
    #[schemars(length(min = 1), extend("examples" = [[[0.0, 0.5, 1.57]]]))]
    pub rpy: Vec<[f64; 3]>,
    /// Unit of the angles. Default: radians.
    pub unit: Option<AngleUnit>,
}

/// Rotations as quaternions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuaternionViews {
    /// Quaternions in the order w, x, y, z; normalised.
    #[schemars(length(min = 1), extend("examples" = [[[1.0, 0.0, 0.0, 0.0]]]))]
    pub quaternions_wxyz: Vec<[f64; 4]>,
}

/// Rotations as matrices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatrixViews {
    /// World from object, as three rows each; orthonormal within 1e-9, determinant 1, used as written.
    #[schemars(length(min = 1), extend("examples" = [[[[1, 0, 0], [0, 1, 0], [0, 0, 1]]]]))]
    pub matrices: Vec<[[f64; 3]; 3]>,
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// A depth sensor's size of image and focal length, in place of all other keys except `near`. The resolved job
    /// contains the numbers.
    #[schemars(extend("examples" = ["d435-848x480"]))]
    pub preset: Option<String>,
    /// Image width.
    #[schemars(range(min = 1, max = 16384), extend("x-unit" = "px"))]
    pub width: u32,
    /// Image height.
    #[schemars(range(min = 1, max = 16384), extend("x-unit" = "px"))]
    pub height: u32,
    /// Horizontal field of view, for square pixels and a centred principal point. Default without `fx`: 1.047.
    #[schemars(extend("x-unit" = "rad", "exclusiveMinimum" = 0, "exclusiveMaximum" = std::f64::consts::PI, "examples" = [1.047]))]
    pub horizontal_fov: Option<f64>,
    /// Focal length along x; in place of `horizontal_fov`.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [554.38]))]
    pub fx: Option<f64>,
    /// Focal length along y. Default: `fx`.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [554.38]))]
    pub fy: Option<f64>,
    /// Principal point, x. Default: the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [320.0]))]
    pub cx: Option<f64>,
    /// Principal point, y. Default: the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [240.0]))]
    pub cy: Option<f64>,
    /// Nearest visible distance along the optical axis.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub near: f64,
    /// An MJCF scene with the camera, relative to the job file; in place of the field of view, the focal lengths and
    /// `near`.
    #[schemars(extend("examples" = ["../scenes/completion.xml"]))]
    pub scene: Option<PathBuf>,
    /// Name of the camera in the scene.
    #[schemars(extend("examples" = ["depth"]))]
    pub camera: Option<String>,
}

/// Distance of the pivot from the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum DistanceSpec {
    /// One distance for all samples.
    Fixed(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// Uniform, drawn per sample.
    Range(DistanceRange),
    /// The object fills the image.
    Fit(FitDistance),
}

/// A range of distances.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceRange {
    /// Shortest distance.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.6]))]
    pub min: f64,
    /// Longest distance.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [1.4]))]
    pub max: f64,
}

/// A distance that makes the object fill the image.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FitDistance {
    /// Share of the shorter image side that the sphere around the object's box fills.
    #[schemars(extend("exclusiveMinimum" = 0, "examples" = [0.6]), range(max = 1))]
    pub fit: f64,
}

/// Limits for pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GateSpec {
    /// Smallest number of occupied cells of the partial grid.
    #[schemars(extend("x-unit" = "cells"))]
    pub min_partial_cells: u32,
    /// Smallest share of the partial's cells that are also in the complete grid; 0 disables the limit.
    #[schemars(range(min = 0, max = 1))]
    pub min_overlap: f64,
}

/// The files of the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShardsSpec {
    /// Samples per shard. Default: the multiple of the views per object that is nearest below 4,096. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [1000]))]
    pub samples: Option<u32>,
}
