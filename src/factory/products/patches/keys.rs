//! A resolved job for patches as keys of a job file.

use std::path::Path;

use super::{
    settings::{PatchJob, PatchSettings},
    spec::{PatchCameraSpec, PatchesSpec},
};
use crate::{
    products::appearance::RenderSpec,
    sections::{keys_of, relative_to, with_slashes, without},
};

impl PatchJob {
    /// Keys of the job file other than shards. With a folder, the dataset and the hand's file are named relative to it,
    /// otherwise by content alone. Keys that do not matter have the standard values.
    pub(super) fn keys(&self, folder: Option<&Path>) -> toml::Table {
        let PatchSettings {
            types,
            side,
            metric,
            table,
            visibility,
            tips,
            label,
            camera,
            horizontal_fov,
            distance,
            point_focal_length,
            colour,
            image,
            heatmap_angle,
        } = &self.settings;
        let mut spec = PatchesSpec::standard();
        spec.grasps.dataset = folder.map(|folder| with_slashes(&relative_to(&self.dataset, folder)).into());
        spec.grasps.root = Some(self.grasps.root.hex());
        spec.grasps.trials_root = self.grasps.trials.map(|root| root.hex());
        spec.grasps.types = *types;
        spec.hand = Some(self.hand.spec(folder));
        (spec.patches.side, spec.patches.tips, spec.patches.label) = (*side, tips.to_vec(), *label);
        (spec.patches.visibility, spec.patches.metric) = (*visibility, metric.is_some());
        spec.scene.table = *table;
        spec.patches.size = metric.unwrap_or(spec.patches.size);
        spec.camera = PatchCameraSpec {
            distance: *distance,
            width: camera.width,
            height: camera.height,
            horizontal_fov: *horizontal_fov,
            near: camera.near,
            point_focal_length: *point_focal_length,
        };
        spec.render = RenderSpec::of(*colour);
        (spec.images.full, spec.images.heatmaps) = (*image, heatmap_angle.is_some());
        spec.images.heatmap_angle = heatmap_angle.unwrap_or(spec.images.heatmap_angle);
        let mut idle = vec!["shards"];
        if folder.is_none() {
            idle.push("hand.model");
            // A job without a mark is named as it was before there were any.
            idle.extend((!visibility).then_some("patches.visibility"));
            idle.extend((!table).then_some("scene"));
            idle.extend(metric.is_none().then_some(["patches.metric", "patches.size"]).into_iter().flatten());
        }
        without(keys_of(&spec), &idle)
    }
}
