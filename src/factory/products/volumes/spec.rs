//! The keys of a job for volumes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    products::{picked::PicksSourceSpec, viewed::ViewsSourceSpec},
    sections::spec::HandSpec,
};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that fuses depth images of settled scenes into truncated signed distances, with the body at the centre of
/// every voxel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VolumesSpec {
    /// The views, a finished dataset.
    pub views: ViewsSourceSpec,
    /// The cube, and the images to fuse.
    pub fusion: FusionSpec,
    /// Grasps of the bodies of the same scenes, a finished dataset: with it each volume contains the grasps with their
    /// centre in the cube, and the outcomes of their trials.
    pub picks: Option<PicksSourceSpec>,
    /// With `picks`: the hand of these grasps.
    pub hand: Option<HandSpec>,
    /// The files of the dataset.
    pub shards: VolumeShardsSpec,
}

impl VolumesSpec {
    /// The standard defaults, without a dataset.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// The cube, and the images to fuse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FusionSpec {
    /// Length of an edge of the cube, which is upright and centred over the middle of the container's floor. A bin must
    /// fit into it.
    #[schemars(range(min = 0.01, max = 10), extend("x-unit" = "m", "examples" = [0.5]))]
    pub size: f64,
    /// Voxels along each edge.
    #[schemars(range(min = 1, max = 128), extend("x-unit" = "voxels"))]
    pub resolution: u32,
    /// Truncation of distances. A voxel farther behind everything that an image sees gets no information from it.
    #[schemars(range(min = 0.5, max = 64), extend("x-unit" = "voxels"))]
    pub truncation_voxels: f64,
    /// Height of the plane or the floor of the bin that carries the bodies, above the lower side of the cube.
    #[schemars(range(min = 0, max = 10), extend("x-unit" = "m"))]
    pub support_height: f64,
    /// Smallest and largest number of images to fuse; uniform in between, at most the views of the scene, each of which
    /// is equally likely.
    #[schemars(inner(range(min = 1, max = 255)), extend("x-unit" = "views", "examples" = [[1, 1]]))]
    pub views: [u32; 2],
    /// Volumes of each scene, each fused from a draw of images.
    #[schemars(range(min = 1, max = 10_000))]
    pub per_scene: u32,
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VolumeShardsSpec {
    /// Samples per shard. Default: a thirty-second of all samples, at least 8 and at most 256, since threads and tasks
    /// make whole shards. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [256]))]
    pub samples: Option<u32>,
}
