//! A resolved job for volumes as keys of a job file.

use std::path::Path;

use super::{
    settings::{VolumeGrasps, VolumeJob, VolumeSettings},
    spec::{FusionSpec, VolumesSpec},
};
use crate::sections::{keys_of, relative_to, with_slashes, without};
use kernel::voxel::VolumeGrid;

impl VolumeJob {
    /// Keys of the job file other than shards. With a folder the dataset is named relative to it, otherwise by content
    /// alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let VolumeSettings {
            grid: VolumeGrid { resolution, size },
            truncation_voxels,
            support_height,
            views,
            per_scene,
        } = self.settings;
        let mut spec = VolumesSpec::standard();
        spec.views.dataset = folder.map(|folder| with_slashes(&relative_to(&self.dataset, folder)).into());
        spec.views.root = Some(self.views.root.hex());
        if let Some(VolumeGrasps { dataset, picks, hand }) = &self.grasps {
            let named = folder.map(|folder| with_slashes(&relative_to(dataset, folder)).into());
            (spec.picks, spec.hand) = (Some(picks.spec(named)), Some(hand.spec(folder)));
        }
        spec.fusion = FusionSpec { size, resolution, truncation_voxels, support_height, views, per_scene };
        let mut idle = vec!["shards"];
        idle.extend((folder.is_none() && self.grasps.is_some()).then_some("hand.model"));
        without(keys_of(&spec), &idle)
    }
}
