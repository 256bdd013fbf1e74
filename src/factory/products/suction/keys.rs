//! A resolved job for suction as keys of a job file.

use std::path::Path;

use super::{
    settings::{SuctionJob, SuctionSettings},
    spec::{SuctionJobSpec, SuctionSpec},
};
use crate::sections::{keys_of, relative_to, with_slashes, without};

impl SuctionJob {
    /// Keys of the job file other than shards. With a folder, the dataset is named relative to it, otherwise by content alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let mut spec = SuctionJobSpec::standard();
        spec.scenes.dataset = folder.map(|folder| with_slashes(&relative_to(&self.scenes_folder, folder)).into());
        spec.scenes.root = Some(self.scenes.root.hex());
        spec.cup = *self.cup.settings();
        spec.suction = self.settings.into();
        let errors = ["suction.error_distance", "suction.error_angle_deg"];
        let idle: &[&str] = if self.settings.error_poses == 0 { &errors } else { &[] };
        without(keys_of(&spec), &[&["shards"], idle].concat())
    }
}

impl From<SuctionSpec> for SuctionSettings {
    fn from(spec: SuctionSpec) -> Self {
        let SuctionSpec { poses, free, half_angle_deg, tilt_deg, safety, any_direction, margin, .. } = spec;
        let SuctionSpec { error_poses, error_distance, error_angle_deg, .. } = spec;
        Self {
            poses,
            free,
            half_angle_deg,
            tilt_deg,
            safety,
            any_direction,
            margin,
            error_poses,
            error_distance,
            error_angle_deg,
        }
    }
}

impl From<SuctionSettings> for SuctionSpec {
    fn from(settings: SuctionSettings) -> Self {
        let SuctionSettings { poses, free, half_angle_deg, tilt_deg, safety, any_direction, margin, .. } = settings;
        let SuctionSettings { error_poses, error_distance, error_angle_deg, .. } = settings;
        Self {
            poses,
            free,
            half_angle_deg,
            tilt_deg,
            safety,
            any_direction,
            margin,
            error_poses,
            error_distance,
            error_angle_deg,
        }
    }
}
