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

/// A job that makes completion pairs of the bodies in views of settled scenes: what an image shows of each, the whole solid, and what
/// surrounds it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AmodalSpec {
    /// The views, a finished dataset.
    pub views: ViewsSourceSpec,
    /// Measured depths that a partial grid is made of.
    #[schemars(extend("examples" = ["surface"]))]
    pub points: PointSource,
    /// The occupancy grids.
    pub grid: GridSpec,
    /// When a cell of the complete grid is occupied.
    pub truth: TruthSpec,
    /// Which pairs are kept; the others are counted rejects with a reason.
    pub gate: AmodalGateSpec,
    /// Channels stored beside the pair and what surrounds it.
    pub channels: ChannelsSpec,
    /// Touch that goes with each pair, of what the camera did not see.
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

/// Which pairs are kept.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmodalGateSpec {
    /// Smallest share of a body's silhouette that is seen; 0.1 is the level below which BOP ignores a body.
    #[schemars(range(min = 0, max = 1))]
    pub min_visible_share: f64,
    /// Fewest occupied cells of the partial grid.
    #[schemars(extend("x-unit" = "cells"))]
    pub min_partial_cells: u32,
}

/// The files of the dataset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmodalShardsSpec {
    /// Samples per shard, at most: a shard ends where a view ends, and holds one at least. Without it, a thirty-second of
    /// all samples, but from 64 to 4,096: threads and tasks take whole shards. Changes no sample.
    #[schemars(range(min = 1, max = 1_000_000), extend("x-unit" = "samples", "examples" = [4096]))]
    pub samples: Option<u32>,
}
