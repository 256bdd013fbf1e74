//! A job for amodal pairs, checked, with everything that it takes from the dataset of views but images and meshes.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::products::{
    pair::{Channels, PairRules, touch::Touch},
    viewed::FoundViews,
};

/// Views and settings of a job for amodal pairs.
#[derive(Clone, Debug, PartialEq)]
pub struct AmodalJob {
    /// The folder of the dataset of views.
    pub dataset: PathBuf,
    /// Views of that dataset.
    pub views: FoundViews,
    /// Settings of the pairs.
    pub settings: AmodalSettings,
}

/// Settings of amodal pairs.
#[derive(Clone, Debug, PartialEq)]
pub struct AmodalSettings {
    /// Rule by which a measured depth is of a body.
    pub points: PointSource,
    /// Smallest share of its silhouette that is seen of a body.
    pub min_visible_share: f64,
    /// Rules by which the grids are made.
    pub rules: PairRules,
    /// `thesis` quirk: the 256^3 solid also holds every cell that the surface crosses, as binvox does.
    pub solid_with_surface: bool,
    /// Channels in addition to the pair.
    pub channels: Channels,
    /// Kinds of touch that go with each pair.
    pub touch: Touch,
}

/// Rule that assigns a measured depth to a body. Without a sensor both rules agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PointSource {
    /// Depths that were measured on the body's own surface: no other's point is among them.
    Surface,
    /// Depths of the pixels that see the body in the noise-free image, as a perfect segmentation of a colour image
    /// would select them. At its outline a sensor also measures surfaces behind or next to the body there.
    Pixels,
}
