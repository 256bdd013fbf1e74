//! A resolved job for picks as keys of a job file.

use std::path::Path;

use super::{
    settings::{PickJob, PickSettings},
    spec::{PickSpec, PicksSpec},
};
use crate::sections::{keys_of, relative_to, with_slashes, without};

impl PickJob {
    /// Keys of the job file other than shards. With a folder, datasets and the hand's file are named relative to it,
    /// otherwise by content alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let PickSettings { rolls, candidates, margin, trials, awake } = self.settings;
        let named = |dataset: &Path| folder.map(|folder| with_slashes(&relative_to(dataset, folder)).into());
        let mut spec = PicksSpec::standard();
        spec.scenes.dataset = named(&self.scenes_folder);
        spec.scenes.root = Some(self.scenes.root.hex());
        spec.grasps.dataset = named(&self.grasps_folder);
        spec.grasps.root = Some(self.grasps.root.hex());
        spec.grasps.trials_root = self.grasps.trials.map(|root| root.hex());
        spec.hand = Some(self.hand.spec(folder));
        let grasps = Some(self.grasps.take.into());
        spec.picks = PickSpec { grasps, rolls: Some(rolls), candidates, margin, trials, movable: awake.into() };
        let mut idle = vec!["shards"];
        if folder.is_none() {
            idle.push("hand.model");
        }
        if trials == 0 {
            idle.push("picks.movable");
        }
        without(keys_of(&spec), &idle)
    }
}
