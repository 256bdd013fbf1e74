//! A completion job, checked.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    products::pair::{Channels, PairRules, touch::Touch},
    sections::JobObjects,
};
use kernel::{
    geom::{Intrinsics, ViewSet},
    render::{OccluderModel, SensorModel},
    voxel::Truth,
};

/// Settings and objects of a completion job.
#[derive(Clone, Debug, PartialEq)]
pub struct CompletionJob {
    /// The objects and their split.
    pub objects: JobObjects,
    /// Settings of the samples.
    pub settings: CompletionSettings,
}

/// The camera of an MJCF scene that gave the numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneCamera {
    /// The scene file.
    pub scene: PathBuf,
    /// The camera's name in it.
    pub camera: String,
    /// Image width [px].
    pub width: u32,
    /// Image height [px].
    pub height: u32,
}

/// Settings of the shape-completion product.
#[derive(Clone, Debug, PartialEq)]
pub struct CompletionSettings {
    /// Rotations of the object.
    pub views: ViewSet,
    /// Whether these are rotated, all together, by a random rotation of each object.
    pub views_per_object: bool,
    /// Point that the object is rotated about.
    pub pivot: Pivot,
    /// The camera.
    pub camera: Intrinsics,
    /// Scene that gave the camera's numbers, if one did.
    pub scene: Option<SceneCamera>,
    /// Distance from the camera to the pivot.
    pub distance: Distance,
    /// Renderer of the depth image.
    pub renderer: Renderer,
    /// Noise of the depth sensor; `None` is a perfect sensor.
    pub sensor: Option<SensorModel>,
    /// Occluders in front of the objects in a share of the views; `None` without occluders.
    pub occlusion: Option<OccluderModel>,
    /// Cells along each axis of the grids, 1 to 128.
    pub resolution: u32,
    /// `thesis` quirk: cells with index 0 on any axis are dropped from both grids.
    pub drop_index_zero: bool,
    /// `thesis` quirk: the 256^3 solid also holds every cell that the surface crosses, as binvox does.
    pub solid_with_surface: bool,
    /// Rule by which a cell of the complete grid is occupied.
    pub truth: Truth,
    /// Conditions under which a pair is kept.
    pub gate: Gate,
    /// Channels in addition to the pair.
    pub channels: Channels,
    /// Kinds of touch that go with each pair.
    pub touch: Touch,
}

impl CompletionSettings {
    /// Rules by which the grids are made.
    pub fn rules(&self) -> PairRules {
        let Self { resolution, drop_index_zero, truth, gate, .. } = self;
        let (resolution, drop_index_zero, truth) = (*resolution, *drop_index_zero, *truth);
        PairRules { resolution, drop_index_zero, truth, min_partial_cells: gate.min_partial_cells }
    }
}

/// The pivot of an object's rotation, which is at the stated distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pivot {
    /// Centre of the bounding box.
    BoxCentre,
    /// Origin of the mesh's own frame (`thesis`).
    MeshOrigin,
}

/// Distance from the camera to the pivot along the optical axis [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distance {
    /// One distance for all samples.
    Fixed(f64),
    /// Uniform, drawn per sample.
    Range {
        /// Shortest [m].
        min: f64,
        /// Longest [m].
        max: f64,
    },
    /// So that the sphere around the object's box fills this share of the shorter image side.
    Fit {
        /// 0 to 1.
        share: f64,
    },
}

impl Distance {
    /// The longest distance [m] that a job states; `None` where it follows from the object.
    pub fn farthest(&self) -> Option<f64> {
        match *self {
            Self::Fixed(distance) => Some(distance),
            Self::Range { max, .. } => Some(max),
            Self::Fit { .. } => None,
        }
    }
}

/// Renderer of the depth image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Renderer {
    /// Our z-buffer in the projected box: the fastest, needs nothing.
    Raster,
    /// Rays through MuJoCo's `mj_multiRay`.
    MujocoRay,
    /// MuJoCo's OpenGL renderer, without a window. Needs EGL.
    MujocoGl,
}

impl Renderer {
    /// Name in job files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::MujocoRay => "mujoco-ray",
            Self::MujocoGl => "mujoco-gl",
        }
    }
}

/// Conditions under which a pair is kept; the others are rejects with a reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gate {
    /// Fewest occupied cells of the partial grid.
    pub min_partial_cells: u32,
    /// Smallest |partial AND complete| / |partial|; 0 disables the gate.
    pub min_overlap: f64,
}
