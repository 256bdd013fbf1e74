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

use crate::{Channel, Product, Record, RecordError};

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

impl Record for SceneVolume {
    const CHANNEL: Channel = Channel::VOLUME_FUSION;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for VolumeTruth {
    const CHANNEL: Channel = Channel::VOLUME_TRUTH;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}

impl Record for VolumeAffordance {
    const CHANNEL: Channel = Channel::VOLUME_AFFORDANCE;
    const DECODE: fn(&[u8]) -> Result<Self, RecordError> = Self::decode;
}
