//! Patches: what a camera sees around the palm and the fingertips of grasps, with the labels of heatmaps.

mod arrays;
mod check;
mod colour_image;
mod facts;
mod heatmap;
#[cfg(test)]
mod mark_tests;
mod metric;
mod patch;
#[cfg(test)]
mod patch_tests;
mod projection;
mod row;
mod table;
mod trial;
mod visibility;

pub(crate) use arrays::{depths, flags, is_same_depth};
pub(super) use check::CHECKS;
pub use colour_image::PatchImageColour;
pub use facts::PatchFacts;
pub(crate) use facts::TYPE as TYPE_FACT;
pub use heatmap::{HeatmapPoint, PatchHeatmap};
pub use metric::{PatchMetric, window_pixel, window_side};
pub use patch::{HeatmapPatch, PATCH_POINTS, POINT_NAMES, PatchColour, PatchPoint, TRIAL_LABEL};
pub use projection::{pixel_in_image, projection};
pub use row::{FORMAT, TYPES};
pub use table::PatchTable;
pub use trial::{PatchTrial, trial_value};
pub use visibility::{PatchVisibility, VISIBLE_TOLERANCE, is_visible};

use crate::{Channel, Product, Record, RecordError};

impl Product {
    /// Image patches around the palm and the fingertips of grasps, with labels.
    pub const PATCHES: Self = Self::named("patches");
}

impl Channel {
    /// [`HeatmapPatch`]: depth around palm and fingertips of one grasp, with labels; every sample of patches has one.
    pub const PATCH: Self = Self::at("/patches/patch");
    /// [`PatchColour`]: the same patches in colour.
    pub const PATCH_COLOUR: Self = Self::at("/patches/colour");
    /// [`Depth`](crate::Depth) of the whole image from which the patches are cut.
    pub const PATCH_IMAGE: Self = Self::at("/patches/image");
    /// [`PatchImageColour`]: the same image in colour.
    pub const PATCH_IMAGE_COLOUR: Self = Self::at("/patches/image_colour");
    /// [`PatchHeatmap`]: truth for heatmaps over the whole image.
    pub const PATCH_HEATMAP: Self = Self::at("/patches/heatmap");
    /// [`PatchTrial`]: which labels trials determine.
    pub const PATCH_TRIAL: Self = Self::at(facts::TRIAL_TOPIC);
    /// [`PatchVisibility`]: which points the surface hides.
    pub const PATCH_VISIBILITY: Self = Self::at(facts::VISIBILITY_TOPIC);
    /// [`PatchMetric`]: patches that show squares of one size in metres.
    pub const PATCH_METRIC: Self = Self::at("/patches/metric");
    /// [`PatchColour`]: the same patches in colour.
    pub const PATCH_METRIC_COLOUR: Self = Self::at("/patches/metric_colour");
    /// [`PatchTable`]: the table under the object.
    pub const PATCH_TABLE: Self = Self::at("/patches/table");
}

impl Record for HeatmapPatch {
    const CHANNEL: Channel = Channel::PATCH;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PatchColour {
    const CHANNEL: Channel = Channel::PATCH_COLOUR;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PatchImageColour {
    const CHANNEL: Channel = Channel::PATCH_IMAGE_COLOUR;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PatchHeatmap {
    const CHANNEL: Channel = Channel::PATCH_HEATMAP;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PatchTrial {
    const CHANNEL: Channel = Channel::PATCH_TRIAL;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PatchVisibility {
    const CHANNEL: Channel = Channel::PATCH_VISIBILITY;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PatchMetric {
    const CHANNEL: Channel = Channel::PATCH_METRIC;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for PatchTable {
    const CHANNEL: Channel = Channel::PATCH_TABLE;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
