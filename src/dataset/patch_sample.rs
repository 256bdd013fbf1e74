//! What stands beside the patches of a sample.

use super::{DatasetError, Sample};
use crate::record::{Channel, Depth, PatchColour, PatchHeatmap, PatchImageColour};

impl Sample {
    /// The same patches in colour; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn patch_colour(&self) -> Result<Option<PatchColour>, DatasetError> {
        self.decoded(Channel::PatchColour, PatchColour::decode)
    }

    /// The whole depth image that the patches are cut out of, as the box of its returns
    /// ([`DepthCrop::whole`](crate::geom::DepthCrop::whole) gives every pixel); `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn patch_image(&self) -> Result<Option<Depth>, DatasetError> {
        self.decoded(Channel::PatchImage, Depth::decode)
    }

    /// The same image in colour; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn patch_image_colour(&self) -> Result<Option<PatchImageColour>, DatasetError> {
        self.decoded(Channel::PatchImageColour, PatchImageColour::decode)
    }

    /// Truth for heatmaps over that image; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn patch_heatmap(&self) -> Result<Option<PatchHeatmap>, DatasetError> {
        self.decoded(Channel::PatchHeatmap, PatchHeatmap::decode)
    }
}
