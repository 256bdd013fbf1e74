//! The keys of a job for volumes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    job::spec::HandSpec,
    products::{picked::PicksSourceSpec, viewed::ViewsSourceSpec},
};

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that fuses depth images of settled scenes into truncated signed distances, with what is at the centre of every voxel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VolumesSpec {
    /// The views, a finished dataset.
    pub views: ViewsSourceSpec,
    /// The cube, and which images are fused.
    pub fusion: FusionSpec,
    /// Grasps of the bodies of the same scenes, a finished dataset: with it each volume says which grasps have their centre in the
    /// cube, and what trials say of them.
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

/// The cube, and which images are fused.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FusionSpec {
    /// Length of an edge of the cube, which stands upright and centred over the middle of the container's floor. A bin must fit
    /// into it.
    #[schemars(range(min = 0.01, max = 10), extend("x-unit" = "m", "examples" = [0.5]))]
    pub size: f64,
    /// Voxels along each edge.
    #[schemars(range(min = 1, max = 128), extend("x-unit" = "voxels"))]
    pub resolution: u32,
    /// Distances are cut at this. A voxel farther behind everything that an image sees learns nothing from it.
    #[schemars(range(min = 0.5, max = 64), extend("x-unit" = "voxels"))]
    pub truncation_voxels: f64,
    /// Height of what carries the bodies, the plane or the floor of the bin, above the lower side of the cube.
    #[schemars(range(min = 0, max = 10), extend("x-unit" = "m"))]
    pub support_height: f64,
    /// Fewest and most images that are fused; their number is uniform in between, at most the views that the scene has, and each of
    /// these is as likely as any other.
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
    /// Samples per shard. Without it, a thirty-second of all samples, but from 8 to 256: threads and tasks take whole
    /// shards. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [256]))]
    pub samples: Option<u32>,
}
