//! Volumes: truncated signed distances fused from the depth images of settled scenes, and what is at the centre of every voxel.

mod check;
mod facts;
mod row;
#[cfg(test)]
mod tests;
mod truth;
mod volume;

pub(super) use check::CHECKS;
pub use facts::VolumeFacts;
pub use row::FORMAT;
pub use truth::VolumeTruth;
pub use volume::{FusedView, SceneVolume};

use crate::{
    Channel, Product,
    dataset::{DatasetError, Sample},
};

impl Product {
    /// Truncated signed distances fused from images of settled scenes.
    pub const VOLUMES: Self = Self::named("volumes");
}

impl Channel {
    /// [`SceneVolume`]: the fused distances and the images that they are of; every volume has one.
    pub const VOLUME_FUSION: Self = Self::at("/volumes/fusion");

    /// [`VolumeTruth`]: what is at the centre of each voxel; every volume has one.
    pub const VOLUME_TRUTH: Self = Self::at("/volumes/truth");
}

impl Sample {
    /// Fused distances of a volume.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is no valid record.
    pub fn scene_volume(&self) -> Result<SceneVolume, DatasetError> {
        self.leading(Channel::VOLUME_FUSION, SceneVolume::decode)
    }

    /// Truth of a volume: what is at the centre of each voxel.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is no valid record.
    pub fn volume_truth(&self) -> Result<VolumeTruth, DatasetError> {
        self.leading(Channel::VOLUME_TRUTH, VolumeTruth::decode)
    }
}
