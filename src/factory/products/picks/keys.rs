//! A resolved job for picks as keys of a job file.

use std::path::Path;

use super::{
    settings::{PickJob, PickSettings, PickSource},
    spec::{PickSpec, PicksSpec, SamplerSpec, TakeSpec},
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
        spec.hand = Some(self.hand.spec(folder));
        spec.picks = PickSpec { candidates, margin, trials, movable: awake.into(), ..spec.picks };
        let mut idle = vec!["shards"];
        match &self.source {
            PickSource::Transferred { folder, grasps } => {
                spec.grasps.dataset = named(folder);
                spec.grasps.root = Some(grasps.root.hex());
                spec.grasps.trials_root = grasps.trials.map(|root| root.hex());
                (spec.picks.grasps, spec.picks.rolls) = (TakeSpec::of(grasps.take), Some(rolls));
                // A dataset of grasps decides the sampler.
                idle.extend(["picks.poses", "picks.half_angle_deg", "picks.cone_friction"]);
            }
            PickSource::Scene(scene) => {
                spec.picks.sampler = Some(SamplerSpec::Scene);
                spec.picks.poses = scene.poses;
                spec.picks.half_angle_deg = scene.half_angle_deg;
                spec.picks.cone_friction = scene.cone_friction;
                idle.push("grasps");
            }
        }
        if folder.is_none() {
            idle.push("hand.model");
        }
        if trials == 0 {
            idle.push("picks.movable");
        }
        without(keys_of(&spec), &idle)
    }
}
