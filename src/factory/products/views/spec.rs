//! The keys of a job for views.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    products::{appearance::RenderSpec, settled::ScenesSourceSpec},
    sections::spec::SensorSpec,
};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that renders settled scenes: depth, the body that each pixel sees, and the separate silhouette of every body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViewsSpec {
    /// The scenes, a finished dataset.
    pub scenes: ScenesSourceSpec,
    /// The cameras and their images.
    pub views: ImagesSpec,
    /// The depth sensor. The body that a pixel sees is that of the noise-free image, even with a sensor model.
    pub sensor: SensorSpec,
    /// Colours of the images.
    pub render: RenderSpec,
    /// The files of the dataset.
    pub shards: ViewShardsSpec,
}

impl ViewsSpec {
    /// The standard defaults, without a dataset.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// The images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImagesSpec {
    /// The cameras; each has its views of every scene. Each entry has exactly one of `shell`, `overhead`, `list` and
    /// `poses`.
    #[schemars(length(min = 1, max = 1000))]
    pub cameras: Vec<ViewCameraSpec>,
    /// Smallest distance of anything from the camera, which nothing may surround; drawn cameras are drawn again until
    /// this is met, those of fixed pose are rejected.
    #[schemars(range(min = 0, max = 1), extend("x-unit" = "m"))]
    pub clearance: f64,
    /// Smallest number of visible pixels of some body; drawn cameras are drawn again until this is met, those of fixed
    /// pose are rejected.
    #[schemars(range(min = 1), extend("x-unit" = "px"))]
    pub min_pixels: u32,
    /// Sides of the table along x and y: below the bodies, or below the floor of the bin.
    #[schemars(inner(range(min = 0.01, max = 100)), extend("x-unit" = "m"))]
    pub table: [f64; 2],
    /// Step of the stored depth, as 16-bit numbers; 0 stores metres as 32-bit floats.
    #[schemars(range(min = 0, max = 0.01), extend("x-unit" = "m"))]
    pub depth_step: f64,
}

/// A camera, and its poses.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ViewCameraSpec {
    /// Poses drawn for each scene on a shell around the point that the camera aims at.
    pub shell: Option<ShellSpec>,
    /// One pose that points straight down at the world's origin: right is x, up is y.
    pub overhead: Option<OverheadSpec>,
    /// A CSV file of poses in the world, relative to the job file. Its first line is `x,y,z,qw,qx,qy,qz`: position in
    /// metres and rotation of a camera with z along the optical axis, y down. A resolved job lists them in `poses`.
    #[schemars(extend("examples" = ["wrist.csv"]))]
    pub list: Option<PathBuf>,
    /// Poses in the world, each x, y, z, qw, qx, qy, qz as in the file of `list`.
    #[schemars(length(min = 1, max = 10_000), extend("examples" = [[[0.0, 0.0, 0.8, 0.0, 1.0, 0.0, 0.0]]]))]
    pub poses: Option<Vec<[f64; 7]>>,
    /// With `shell`: views of each scene. Without it, 1.
    #[schemars(range(min = 1, max = 10_000), extend("x-unit" = "views", "examples" = [6]))]
    pub views: Option<u32>,
    /// A depth sensor's size of image and focal length, in place of the numbers below. The resolved job contains the
    /// numbers.
    #[schemars(extend("examples" = ["kinect-v1-640x480"]))]
    pub preset: Option<String>,
    /// Image width.
    #[schemars(range(min = 1, max = 8192), extend("x-unit" = "px", "examples" = [640]))]
    pub width: Option<u32>,
    /// Image height.
    #[schemars(range(min = 1, max = 8192), extend("x-unit" = "px", "examples" = [480]))]
    pub height: Option<u32>,
    /// Focal length along x.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [540.0]))]
    pub fx: Option<f64>,
    /// Focal length along y. Default: `fx`.
    #[schemars(extend("x-unit" = "px", "exclusiveMinimum" = 0, "examples" = [540.0]))]
    pub fy: Option<f64>,
    /// Principal point, x; pixel centres are at +0.5. Default: the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [320.0]))]
    pub cx: Option<f64>,
    /// Principal point, y. Default: the middle of the image.
    #[schemars(extend("x-unit" = "px", "examples" = [240.0]))]
    pub cy: Option<f64>,
    /// Nearest visible distance along the optical axis. Default: 0.01.
    #[schemars(extend("x-unit" = "m", "exclusiveMinimum" = 0, "examples" = [0.01]))]
    pub near: Option<f64>,
}

/// Poses on a shell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShellSpec {
    /// Shortest and longest distance from the point that the camera aims at; uniform in between.
    #[schemars(inner(range(min = 0.05, max = 20)), extend("x-unit" = "m", "examples" = [[0.48, 0.72]]))]
    pub radius: [f64; 2],
    /// Smallest and largest angle from straight above; uniform by area in between, in any direction around.
    #[schemars(inner(range(min = 0, max = 90)), extend("x-unit" = "deg", "examples" = [[0, 45]]))]
    pub polar_deg: [f64; 2],
    /// Smallest and largest rotation about the optical axis. Default: none, so that up in the image is up in the world,
    /// or x for a camera that points straight down.
    #[schemars(inner(range(min = -180, max = 180)), extend("x-unit" = "deg", "examples" = [[-180, 180]]))]
    pub roll_deg: Option<[f64; 2]>,
    /// Point that the camera aims at. Default: the bodies.
    #[schemars(extend("examples" = ["origin"]))]
    pub aim: Option<AimSpec>,
}

/// A point that cameras aim at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AimSpec {
    /// The mean of the centres of the bodies' boxes.
    Bodies,
    /// The world's origin, the middle of the container's floor.
    Origin,
}

/// A pose that points straight down.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OverheadSpec {
    /// Height above the container's floor.
    #[schemars(range(min = 0.05, max = 20), extend("x-unit" = "m", "examples" = [0.8]))]
    pub height: f64,
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ViewShardsSpec {
    /// Samples per shard. Default: a thirty-second of all samples, at least 32 and at most 256, since threads and tasks
    /// make whole shards. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [256]))]
    pub samples: Option<u32>,
}
