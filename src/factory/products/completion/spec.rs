//! The keys of a completion job.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    settings::{Pivot, Renderer},
    spec_occlusion::OcclusionSpec,
};
use crate::{
    job::spec::{ObjectsSpec, SensorSpec, SplitSpec},
    products::pair::{ChannelsSpec, GridSpec, TruthSpec, touch::TouchSpec},
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

/// A job that makes shape-completion pairs: which objects, seen how, become which samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompletionSpec {
    /// Where the objects come from: one or several `[[objects]]` entries, each with exactly one of `folder`, `list`,
    /// `package` and `built_in`.
    #[schemars(length(min = 1))]
    pub objects: Vec<ObjectsSpec>,
    /// Rotations of each object: a named set or a table.
    pub views: ViewsSpec,
    /// The point that an object is rotated about, and that stands at the stated distance.
    #[schemars(extend("examples" = ["box_centre"]))]
    pub pivot: Pivot,
    /// The camera, by numbers, by the name of a depth sensor, or from an MJCF scene.
    pub camera: CameraSpec,
    /// From the camera to the pivot, along the optical axis: a number, a range, or a share of the image to fill.
    #[schemars(extend("x-unit" = "m"))]
    pub distance: DistanceSpec,
    /// Renderer of the depth image.
    #[schemars(extend("examples" = ["raster"]))]
    pub renderer: Renderer,
    /// Sensor model: what it adds to a perfect depth image.
    pub sensor: SensorSpec,
    /// Occluders between the camera and the object in a share of the views. Without the section, there are none.
    pub occlusion: Option<OcclusionSpec>,
    /// The occupancy grids.
    pub grid: GridSpec,
    /// When a cell of the complete grid is occupied.
    pub truth: TruthSpec,
    /// Which pairs are kept; the others are counted rejects with a reason.
    pub gate: GateSpec,
    /// Which objects train, validate and test.
    pub split: SplitSpec,
    /// Channels stored beside the partial and the complete grid.
    pub channels: ChannelsSpec,
    /// Touch that goes with each pair, of what the camera did not see.
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
pub enum ViewsSpec {
    /// A named set.
    Named(NamedViews),
    /// Every combination of roll, pitch and yaw, R = Rz(yaw) Ry(pitch) Rx(roll).
    Grid(GridViews),
    /// Rotations spread evenly over all of SO(3).
    Even(EvenViews),
    /// Rotations one by one, as roll, pitch and yaw.
    RollPitchYaw(RpyViews),
    /// Rotations one by one, as quaternions.
    Quaternions(QuaternionViews),
    /// Rotations one by one, as matrices.
    Matrices(MatrixViews),
}

/// A named set of views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum NamedViews {
    /// 11 x 6 x 11 = 726 different rotations: roll, yaw = -pi + 2 pi k / 11, pitch -75 to 75 degrees in steps of 30.
    Standard,
    /// 11 x 6 x 11 = 726 views on closed ranges, as the thesis has them; only 420 rotations differ.
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
    /// Unit of the angles. Without it, radians.
    pub unit: Option<AngleUnit>,
}

/// Angles, one by one or as a range.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum AnglesSpec {
    /// One by one.
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
    /// The last angle, or one step behind it.
    pub to: f64,
    /// Number of angles.
    #[schemars(range(min = 1, max = 100_000))]
    pub count: u32,
    /// Whether `to` is one of them. Without it, `closed`.
    pub ends: Option<Ends>,
}

/// Whether a range holds its end.
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
    /// Whether the views of each object are rotated, all together, by a random rotation of its own. Without it, the camera views
    /// every object along the same directions.
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
    /// Unit of the angles. Without it, radians.
    pub unit: Option<AngleUnit>,
}

/// Rotations as quaternions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QuaternionViews {
    /// Quaternions in the order w, x, y, z; brought to length 1.
    #[schemars(length(min = 1), extend("examples" = [[[1.0, 0.0, 0.0, 0.0]]]))]
    pub quaternions_wxyz: Vec<[f64; 4]>,
}

/// Rotations as matrices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MatrixViews {
    /// World from object, as three rows each; orthonormal within 1e-9, determinant 1, taken as they stand.
    #[schemars(length(min = 1), extend("examples" = [[[[1, 0, 0], [0, 1, 0], [0, 0, 1]]]]))]
    pub matrices: Vec<[[f64; 3]; 3]>,
}

/// The camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    /// A depth sensor's size of image and focal length, in place of all other keys but `near`. The resolved job has the numbers.
    #[schemars(extend("examples" = ["d435-848x480"]))]
    pub preset: Option<String>,
    /// Image width.
    #[schemars(range(min = 1, max = 16384), extend("x-unit" = "px"))]
    pub width: u32,
    /// Image height.
    #[schemars(range(min = 1, max = 16384), extend("x-unit" = "px"))]
    pub height: u32,
    /// Horizontal field of view, for square pixels and a centred principal point. Without it and without `fx`, 1.047.
    #[schemars(extend("x-unit" = "rad", "exclusiveMinimum" = 0, "exclusiveMaximum" = std::f64::consts::PI, "examples" = [1.047]))]
    pub horizontal_fov: Option<f64>,
    /// Focal length along x; in place of `horizontal_fov`.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [554.38]))]
    pub fx: Option<f64>,
    /// Focal length along y. Without it, `fx`.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [554.38]))]
    pub fy: Option<f64>,
    /// Principal point, x. Without it, the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [320.0]))]
    pub cx: Option<f64>,
    /// Principal point, y. Without it, the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [240.0]))]
    pub cy: Option<f64>,
    /// Nothing nearer than this along the optical axis is seen.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0))]
    pub near: f64,
    /// An MJCF scene that holds the camera, relative to the job file; in place of the field of view, the focal lengths
    /// and `near`.
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
    /// So that the object fills the image.
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
    /// The sphere around the object's box fills this share of the shorter image side.
    #[schemars(extend("exclusiveMinimum" = 0, "examples" = [0.6]), range(max = 1))]
    pub fit: f64,
}

/// Which pairs are kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GateSpec {
    /// Fewest occupied cells of the partial grid.
    #[schemars(extend("x-unit" = "cells"))]
    pub min_partial_cells: u32,
    /// Smallest share of the partial's cells that the complete grid holds too; 0 asks for nothing.
    #[schemars(range(min = 0, max = 1))]
    pub min_overlap: f64,
}

/// The files of the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShardsSpec {
    /// Samples per shard. Without it, the multiple of the views per object that is nearest below 4,096. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [1000]))]
    pub samples: Option<u32>,
}
