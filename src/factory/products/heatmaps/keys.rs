//! A resolved job for heatmaps as keys of a job file.

use std::path::Path;

use super::{
    settings::{HeatmapJob, HeatmapSettings},
    spec::{HeatmapSpec, HeatmapsSpec, SquaresSpec},
};
use crate::sections::{keys_of, relative_to, with_slashes, without};

impl HeatmapJob {
    /// Keys of the job file other than shards. With a folder, datasets and the hand's file are named relative to it,
    /// otherwise by content alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let HeatmapSettings { label, types, tips, max_angle, depth_step, side, size } = &self.settings;
        let mut spec = HeatmapsSpec::standard();
        let named = |dataset: &Path| folder.map(|folder| with_slashes(&relative_to(dataset, folder)).into());
        spec.views.dataset = named(&self.views_folder);
        spec.views.root = Some(self.views.root.hex());
        spec.picks = self.picks.spec(named(&self.picks_folder));
        spec.hand = Some(self.hand.spec(folder));
        spec.heatmaps = HeatmapSpec {
            label: (*label).into(),
            types: *types,
            tips: Some(tips.clone()),
            max_angle: *max_angle,
            depth_step: *depth_step,
        };
        spec.patches = SquaresSpec { side: *side, metric: size.is_some(), size: size.unwrap_or(spec.patches.size) };
        let mut idle = vec!["shards"];
        if folder.is_none() {
            idle.push("hand.model");
            idle.extend(size.is_none().then_some("patches.size"));
        }
        without(keys_of(&spec), &idle)
    }
}
