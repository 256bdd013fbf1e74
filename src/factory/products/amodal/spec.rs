//! The keys of a job for amodal pairs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::settings::PointSource;
use crate::products::{
    pair::{ChannelsSpec, GridSpec, TruthSpec, touch::TouchSpec},
    viewed::ViewsSourceSpec,
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

/// A job that makes completion pairs of the bodies in views of settled scenes: the visible part of each, the whole
/// solid, and its surroundings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AmodalSpec {
    /// The views, a finished dataset.
    pub views: ViewsSourceSpec,
    /// Measured depths that a partial grid contains.
    #[schemars(extend("examples" = ["surface"]))]
    pub points: PointSource,
    /// The occupancy grids.
    pub grid: GridSpec,
    /// Rule for the occupied cells of the complete grid.
    pub truth: TruthSpec,
    /// Limits for pairs; others are rejected with a reason and counted.
    pub gate: AmodalGateSpec,
    /// Channels stored in addition to the pair and its surroundings.
    pub channels: ChannelsSpec,
    /// Tactile contacts on the hidden surface, stored with each pair.
    pub touch: TouchSpec,
    /// The files of the dataset.
    pub shards: AmodalShardsSpec,
}

impl AmodalSpec {
    /// The standard defaults, without a dataset.
    pub fn standard() -> Self {
        form::decode_own(PROFILES[0])
    }
}

/// Limits for pairs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmodalGateSpec {
    /// Smallest visible share of a body's silhouette; 0.1 is the level below which BOP ignores a body.
    #[schemars(range(min = 0, max = 1))]
    pub min_visible_share: f64,
    /// Smallest number of occupied cells of the partial grid.
    #[schemars(extend("x-unit" = "cells"))]
    pub min_partial_cells: u32,
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmodalShardsSpec {
    /// Largest number of samples per shard: a shard ends at the end of a view, and contains at least one. Default: a
    /// thirty-second of all samples, at least 64 and at most 4,096, since threads and tasks make whole shards. Changes
    /// no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [4096]))]
    pub samples: Option<u32>,
}
