//! From the keys of a job for patches to a job that makes sense: every mistake that the schema cannot see.

use std::path::Path as FilePath;

use super::{
    grasps_reader::{InvalidGrasps, WantedGrasps, read_grasps},
    settings::{FoundGrasps, PatchJob, PatchLabel, PatchSettings},
    spec::{PatchCameraSpec, PatchesSpec},
};
use crate::{products::input::InputSection, sections::read_hand};
use form::{Checker, first_repeated};
use kernel::{geom::Intrinsics, words::Show};
use sim::HandModel;

/// The section that names the dataset.
const GRASPS: InputSection = InputSection {
    name: "grasps",
    make: "make one first, and name its folder: `graspmill run jobs/grasps-quick.toml --out datasets/grasps-quick`",
};

const MAKE_TRIALS: &str = "make a dataset with trials (a section `[physics]` in the job for grasps), or use labels by \
                           analytic criteria: `patches.label = \"epsilon\"`";

/// The whole job; `None` when something is wrong, which is reported.
pub(super) fn job(checker: &mut Checker, spec: &PatchesSpec, folder: &FilePath) -> Option<PatchJob> {
    let settings = settings(checker, spec);
    let hand = spec.hand.as_ref();
    let hand = hand.and_then(|hand| read_hand(checker, "hand", hand, folder, HandModel::check_grasping));
    let dataset = GRASPS.folder(checker, spec.grasps.dataset.as_ref(), folder)?;
    let found = grasps(checker, spec, &dataset);
    let (hand, grasps, settings) = (hand?, found?, settings?);
    if hand.id != grasps.hand {
        let expected = format!("the hand of the grasps, of content {}", grasps.hand.0.short());
        checker.invalid("hand.model", expected, format!("{} of content {}", hand.name, hand.id.0.short()));
        return None;
    }
    Some(PatchJob { dataset, grasps, hand, settings })
}

/// The grasps of the most common types, compared with the root that the job pins.
fn grasps(checker: &mut Checker, spec: &PatchesSpec, dataset: &FilePath) -> Option<FoundGrasps> {
    let by_trials = spec.patches.label == PatchLabel::Trial;
    let wanted = WantedGrasps { max_types: spec.grasps.types, by_trials, on_table: spec.scene.table };
    let found = read_grasps(dataset, wanted);
    if let Err(InvalidGrasps::NoTrials(_)) = found {
        let seen = format!("{} has none", dataset.shown());
        checker.invalid("patches.label", "a dataset of grasps with trials", seen).help(MAKE_TRIALS);
        return None;
    }
    let found = GRASPS.found(checker, found)?;
    if !GRASPS.has_root(checker, spec.grasps.root.as_deref(), found.root, dataset) {
        return None;
    }
    if !GRASPS.has_trials_root(checker, spec.grasps.trials_root.as_deref(), found.trials, dataset) {
        return None;
    }
    if found.types.chosen.is_empty() {
        let mut such =
            if by_trials { "grasp that held and has a type" } else { "kept grasp that has a type" }.to_owned();
        if spec.scene.table {
            such += ", and that a table allows";
        }
        let others = if by_trials { "tried" } else { "kept" };
        let seen = format!("none in {}, {} {others} grasps without a type", dataset.shown(), found.types.without);
        checker.invalid("grasps.dataset", format!("at least one {such}"), seen);
        return None;
    }
    Some(found)
}

fn settings(checker: &mut Checker, spec: &PatchesSpec) -> Option<PatchSettings> {
    let &PatchCameraSpec { distance, width, height, horizontal_fov, near, point_focal_length } = &spec.camera;
    let camera = match Intrinsics::from_horizontal_fov(width, height, horizontal_fov, near) {
        Ok(camera) => camera,
        Err(error) => {
            checker.invalid("camera.horizontal_fov", "a camera", error.to_string());
            return None;
        }
    };
    if let Err(error) = camera.with_focal_length(point_focal_length).checked() {
        checker.invalid("camera.point_focal_length", "a focal length", error.to_string());
    }
    if near >= distance && checker.has("camera") {
        let expected = format!("below the distance, {distance} m");
        checker.invalid("camera.near", expected, format!("{near} m: nothing would be visible"));
    }
    let side = spec.patches.side;
    if side > width.min(height) {
        let expected = format!("at most the image's shorter side, {} px", width.min(height));
        checker.invalid("patches.side", expected, format!("{side} px: every patch would exceed the image"));
    }
    let tips = <[String; 3]>::try_from(spec.patches.tips.clone()).ok()?;
    if let Some(index) = first_repeated(&tips) {
        checker.invalid("patches.tips", "three different contacts", format!("{} twice", tips[index]));
    }
    Some(PatchSettings {
        types: spec.grasps.types,
        side,
        metric: spec.patches.metric.then_some(spec.patches.size),
        table: spec.scene.table,
        visibility: spec.patches.visibility,
        tips,
        label: spec.patches.label,
        camera,
        horizontal_fov,
        distance,
        point_focal_length,
        image: spec.images.full,
        heatmap_angle: spec.images.heatmaps.then_some(spec.images.heatmap_angle),
        colour: spec.render.check(checker),
    })
}
