//! Volumes: truncated signed distances fused from the depth images of settled scenes, what is at the centre of every voxel,
//! and the grasps in them.

mod affordance;
mod check;
mod facts;
mod row;
#[cfg(test)]
mod tests;
mod truth;
mod volume;

pub use affordance::{VolumeAffordance, VoxelGrasp};
pub(super) use check::CHECKS;
pub use facts::{GraspsInVolume, VolumeFacts};
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
    /// [`SceneVolume`]: the fused distances and their images; every volume has one.
    pub const VOLUME_FUSION: Self = Self::at("/volumes/fusion");

    /// [`VolumeTruth`]: what is at the centre of each voxel; every volume has one.
    pub const VOLUME_TRUTH: Self = Self::at("/volumes/truth");

    /// [`VolumeAffordance`]: grasps in the cube, where the job names a dataset of picks.
    pub const VOLUME_AFFORDANCE: Self = Self::at(facts::AFFORDANCE);
}

impl Sample {
    /// Fused distances of a volume.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn scene_volume(&self) -> Result<SceneVolume, DatasetError> {
        self.leading(Channel::VOLUME_FUSION, SceneVolume::decode)
    }

    /// Truth of a volume: what is at the centre of each voxel.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn volume_truth(&self) -> Result<VolumeTruth, DatasetError> {
        self.leading(Channel::VOLUME_TRUTH, VolumeTruth::decode)
    }

    /// Grasps in the cube of a volume; `None` where the dataset has none.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn volume_affordance(&self) -> Result<Option<VolumeAffordance>, DatasetError> {
        self.decoded(Channel::VOLUME_AFFORDANCE, VolumeAffordance::decode)
    }
}
