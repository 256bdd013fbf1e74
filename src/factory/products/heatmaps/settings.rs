//! A job for heatmaps, checked, with everything that it takes from the datasets of views and picks but images, meshes and grasps.

use std::path::PathBuf;

use crate::{
    products::{picked::FoundPicks, viewed::FoundViews},
    sections::JobHand,
};
use format::HeatmapLabel;

/// Views, picks, hand and settings of a job for heatmaps.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatmapJob {
    /// The folder of the dataset of views.
    pub views_folder: PathBuf,
    /// Views of that dataset.
    pub views: FoundViews,
    /// The folder of the dataset of picks.
    pub picks_folder: PathBuf,
    /// Picks of that dataset.
    pub picks: FoundPicks,
    /// The hand.
    pub hand: JobHand,
    /// The chosen grasp types, the most common first; of a hand without types none.
    pub types: Vec<u32>,
    /// Everything else.
    pub settings: HeatmapSettings,
}

/// Settings of heatmaps.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatmapSettings {
    /// Meaning of the labels.
    pub label: HeatmapLabel,
    /// Requested number of types, at least 1.
    pub types: u32,
    /// The contacts of the hand that are fingertips.
    pub tips: Vec<String>,
    /// Largest angle between an approach and the camera's axis [rad].
    pub max_angle: f64,
    /// Step of stored depth [m]; 0: floats.
    pub depth_step: f64,
    /// Side of a patch [px].
    pub side: u32,
    /// Side of the squares that patches in metres show [m]; `None` without.
    pub size: Option<f64>,
}
