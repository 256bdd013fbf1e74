//! Records of a sample of patches.

use super::{
    HeatmapPatch, PatchColour, PatchHeatmap, PatchImageColour, PatchMetric, PatchTable, PatchTrial, PatchVisibility,
};
use crate::dataset::{DatasetError, Sample};
use crate::{Channel, Depth};

impl Sample {
    /// Depth and labels around the palm and the fingertips of a grasp.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn heatmap_patch(&self) -> Result<HeatmapPatch, DatasetError> {
        self.leading(Channel::PATCH, HeatmapPatch::decode)
    }

    /// Reads the patches in colour; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_colour(&self) -> Result<Option<PatchColour>, DatasetError> {
        self.decoded(Channel::PATCH_COLOUR, PatchColour::decode)
    }

    /// The whole depth image from which the patches are cut, as the box of its returns
    /// ([`DepthCrop::whole`](kernel::geom::DepthCrop::whole) gives every pixel); `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_image(&self) -> Result<Option<Depth>, DatasetError> {
        self.decoded(Channel::PATCH_IMAGE, Depth::decode)
    }

    /// Reads the image in colour; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_image_colour(&self) -> Result<Option<PatchImageColour>, DatasetError> {
        self.decoded(Channel::PATCH_IMAGE_COLOUR, PatchImageColour::decode)
    }

    /// Truth for heatmaps over that image; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_heatmap(&self) -> Result<Option<PatchHeatmap>, DatasetError> {
        self.decoded(Channel::PATCH_HEATMAP, PatchHeatmap::decode)
    }

    /// Trials of the grasp, and the labels that they determine; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_trial(&self) -> Result<Option<PatchTrial>, DatasetError> {
        self.decoded(Channel::PATCH_TRIAL, PatchTrial::decode)
    }

    /// Which points the surface in the image hides; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_visibility(&self) -> Result<Option<PatchVisibility>, DatasetError> {
        self.decoded(Channel::PATCH_VISIBILITY, PatchVisibility::decode)
    }

    /// Patches of one size in metres; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_metric(&self) -> Result<Option<PatchMetric>, DatasetError> {
        self.decoded(Channel::PATCH_METRIC, PatchMetric::decode)
    }

    /// Reads the patches of one size in colour; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_metric_colour(&self) -> Result<Option<PatchColour>, DatasetError> {
        self.decoded(Channel::PATCH_METRIC_COLOUR, PatchColour::decode)
    }

    /// The table under the object; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn patch_table(&self) -> Result<Option<PatchTable>, DatasetError> {
        self.decoded(Channel::PATCH_TABLE, PatchTable::decode)
    }
}
