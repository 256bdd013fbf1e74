//! A resolved job for amodal pairs as keys of a job file.

use std::path::Path;

use super::{
    settings::{AmodalJob, AmodalSettings},
    spec::AmodalSpec,
};
use crate::{
    products::pair::TruthSpec,
    sections::{keys_of, relative_to, with_slashes, without},
};

impl AmodalJob {
    /// Keys of the job file other than shards. With a folder the dataset is named relative to it, otherwise by content
    /// alone.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let AmodalSettings { points, min_visible_share, rules, solid_with_surface, channels, touch } = &self.settings;
        let mut spec = AmodalSpec::standard();
        spec.views.dataset = folder.map(|folder| with_slashes(&relative_to(&self.dataset, folder)).into());
        spec.views.root = Some(self.views.root.hex());
        spec.points = *points;
        (spec.grid.resolution, spec.grid.drop_index_zero) = (rules.resolution, rules.drop_index_zero);
        spec.truth = TruthSpec::from_truth(rules.truth, *solid_with_surface);
        (spec.gate.min_visible_share, spec.gate.min_partial_cells) = (*min_visible_share, rules.min_partial_cells);
        channels.write_keys(&mut spec.channels);
        spec.touch.write(touch, folder);
        // Digests of jobs without touch do not contain its section.
        let unknown: &[&str] = match (touch.is_asked(), folder) {
            (false, _) => &["shards", "touch"],
            (true, None) => &["shards", "touch.hand.model"],
            (true, Some(_)) => &["shards"],
        };
        without(keys_of(&spec), unknown)
    }
}
