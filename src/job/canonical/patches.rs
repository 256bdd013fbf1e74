//! A resolved job for patches as text.

use std::path::Path;

use toml::Value;

use super::{Text, relative_to};
use crate::job::{
    checked::{FoundGrasps, PatchJob, PatchSettings},
    discover,
};

impl Text {
    /// The settings, with the dataset's folder where there is one to see it from.
    pub(super) fn patches(&mut self, job: &PatchJob, folder: Option<&Path>) {
        let PatchSettings { types, side, tips, label, camera, horizontal_fov, distance, colour, .. } = &job.settings;
        let PatchSettings { point_focal_length, image, heatmap_angle, .. } = &job.settings;
        self.section("grasps");
        if let Some(folder) = folder {
            self.key("dataset", discover::with_slashes(&relative_to(&job.dataset, folder)));
        }
        self.key("root", job.grasps.root.hex());
        self.key("types", i64::from(*types));
        self.section("patches");
        self.key("side", i64::from(*side));
        self.list("tips", tips.iter().map(|tip| Value::from(tip.as_str())));
        self.key("label", label.name());
        self.section("camera");
        self.key("distance", *distance);
        self.key("width", i64::from(camera.width));
        self.key("height", i64::from(camera.height));
        self.key("horizontal_fov", *horizontal_fov);
        self.key("near", camera.near);
        if let Some(focal_length) = point_focal_length {
            self.key("point_focal_length", *focal_length);
        }
        self.section("render");
        self.key("colour", colour.is_some());
        // Without colours there is nothing to draw anew.
        if let Some(colour) = colour {
            self.key("randomise", colour.randomise);
        }
        // Jobs without whole images keep the digest that they had before there were any.
        if *image || heatmap_angle.is_some() {
            self.section("images");
            self.key("full", *image);
            self.key("heatmaps", heatmap_angle.is_some());
        }
        if let Some(angle) = heatmap_angle {
            self.key("heatmap_angle", *angle);
        }
    }

    /// The objects by name and content, and who trains and who tests: what the root of the grasps does not say.
    pub(super) fn grasped(&mut self, grasps: &FoundGrasps) {
        self.list("training_subsets", grasps.training_subsets.iter().map(|models| Value::from(i64::from(*models))));
        for object in &grasps.objects {
            let parts = [object.name.as_str(), &object.id.0.hex(), object.side.name()].map(Value::from);
            let subset = object.subset.map(|subset| Value::from(i64::from(subset)));
            let runs = object.holdout_runs.iter().map(|run| Value::from(i64::from(*run)));
            let parts = parts.into_iter().chain([Value::from(runs.collect::<Vec<_>>())]).chain(subset);
            self.list("object", parts);
        }
    }
}
