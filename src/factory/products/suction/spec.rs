//! The keys of a job for suction.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::products::settled::ScenesSourceSpec;
use robot::suction::CupSettings;

/// Defaults of the profile `standard`, and the ones that `thesis` changes.
pub const PROFILES: [&str; 2] = [include_str!("profiles/standard.toml"), include_str!("profiles/thesis.toml")];

/// A job that finds poses of a suction cup on the bodies of settled scenes: where it seals, holds the body, and gets there without
/// touching anything else.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SuctionJobSpec {
    /// The scenes, a finished dataset.
    pub scenes: ScenesSourceSpec,
    /// The suction cup.
    pub cup: CupSettings,
    /// Poses to draw and to keep.
    pub suction: SuctionSpec,
    /// The files of the dataset.
    pub shards: SuctionShardsSpec,
}

impl SuctionJobSpec {
    /// The standard defaults, without a dataset.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// Poses to draw and to keep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuctionSpec {
    /// Largest number of poses to draw per body.
    #[schemars(range(min = 1, max = 10_000_000), extend("x-unit" = "poses"))]
    pub poses: u32,
    /// Number of free poses, unlike each other, at which drawing ends. As many of the poses that leak, that are too weak and that
    /// are blocked are stored, too.
    #[schemars(range(min = 1, max = 10_000), extend("x-unit" = "poses"))]
    pub free: u32,
    /// Largest angle between the approach and straight down.
    #[schemars(range(min = 1, max = 180), extend("x-unit" = "degree"))]
    pub half_angle_deg: f64,
    /// Largest angle between the approach and the inward normal of the drawn point. Half of the poses are tilted, uniformly over
    /// the cone of this half angle; the others are normal to the plane of the lip.
    #[schemars(range(min = 0, max = 60), extend("x-unit" = "degree"))]
    pub tilt_deg: f64,
    /// Factor on the weight, for accelerations and leaks. Data sheets of cups advise 1.5 to 2.
    #[schemars(range(min = 0.01, max = 100))]
    pub safety: f64,
    /// Whether the cup must hold the body in every direction of gravity, and not only as it lies.
    pub any_direction: bool,
    /// Smallest distance of cup and tube from everything except the body.
    #[schemars(range(min = 0, max = 0.009), extend("x-unit" = "m"))]
    pub margin: f64,
    /// Poses with errors for the robustness of each free pose; 0 disables it.
    #[schemars(range(max = 10_000), extend("x-unit" = "poses"))]
    pub error_poses: u32,
    /// Largest error across the axis, uniform over the disc.
    #[schemars(range(min = 0, max = 0.1), extend("x-unit" = "m"))]
    pub error_distance: f64,
    /// Largest error of the axis, uniform over the cone.
    #[schemars(range(min = 0, max = 90), extend("x-unit" = "degree"))]
    pub error_angle_deg: f64,
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuctionShardsSpec {
    /// Bodies per shard. Default: a thirty-second of all bodies, at least 8 and at most 64, since threads and tasks
    /// make whole shards. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "bodies", "examples" = [64]))]
    pub samples: Option<u32>,
}
