//! Settings of a job for patches.

use std::path::Path as FilePath;

use super::{
    Checker,
    touch::{HandReader, read_hand},
};
use crate::{
    geom::Intrinsics,
    ids::Digest,
    job::{
        checked::{FoundGrasps, PatchColours, PatchJob, PatchLabel, PatchSettings},
        discover,
        document::Path,
        errors::Problem,
        spec::patches::{LabelSpec, PatchCameraSpec, PatchesSpec},
    },
};

/// Reads what a finished dataset of grasps holds of its so many most common types; the error says why it cannot, in words.
///
/// A job knows no dataset, so whoever reads a job passes it in.
pub type GraspsReader<'a> = dyn Fn(&FilePath, u32) -> Result<FoundGrasps, String> + 'a;

/// The reader of a program without datasets: refuses every folder.
///
/// # Errors
/// Always.
pub fn no_grasps(_: &FilePath, _: u32) -> Result<FoundGrasps, String> {
    Err("no dataset can be read here".to_owned())
}

const MAKE_GRASPS: &str = "make it first: `graspmill run jobs/ycb-grasps.toml --out datasets/ycb-grasps`";

/// The whole job; `None` where something is wrong, which was reported.
pub(in crate::job) fn patches(
    checker: &mut Checker<'_>,
    spec: &PatchesSpec,
    folder: &FilePath,
    hands: &HandReader<'_>,
    grasps: &GraspsReader<'_>,
) -> Option<PatchJob> {
    let settings = settings(checker, spec);
    let hand = spec.hand.as_ref().and_then(|hand| read_hand(checker, "hand", hand, folder, hands));
    let Some(dataset) = &spec.grasps.dataset else {
        let problem = Problem::Missing { expected: "the folder of a finished dataset of grasps".to_owned() };
        checker.fail(&Path::of("grasps.dataset"), problem, Some(MAKE_GRASPS.to_owned()));
        return None;
    };
    let dataset = discover::tidy(&folder.join(dataset));
    let found = read_grasps(checker, spec, &dataset, grasps);
    let (hand, grasps, settings) = (hand?, found?, settings?);
    if hand.id != grasps.hand {
        let expected = format!("the hand of the grasps, of content {}", grasps.hand.0.short());
        checker.senseless("hand.scene", expected, format!("{} of content {}", hand.name, hand.id.0.short()));
        return None;
    }
    Some(PatchJob { dataset, grasps, hand, settings })
}

fn read_grasps(
    checker: &mut Checker<'_>,
    spec: &PatchesSpec,
    dataset: &FilePath,
    grasps: &GraspsReader<'_>,
) -> Option<FoundGrasps> {
    let found = match grasps(dataset, spec.grasps.types) {
        Ok(found) => found,
        Err(detail) => {
            let problem = Problem::NotFound { what: "dataset of grasps".to_owned(), detail };
            checker.fail(&Path::of("grasps.dataset"), problem, Some(MAKE_GRASPS.to_owned()));
            return None;
        }
    };
    let pinned = spec.grasps.root.as_deref().and_then(Digest::from_hex);
    if let Some(pinned) = pinned.filter(|pinned| *pinned != found.root) {
        let expected = format!("grasps of root {}", pinned.short());
        let seen = format!("{}: {} holds others", found.root.short(), dataset.display());
        let help = "restore the dataset, or take `root` out of the job for a new dataset".to_owned();
        checker.fail(&Path::of("grasps.root"), Problem::Senseless { expected, found: seen }, Some(help));
        return None;
    }
    if found.types.chosen.is_empty() {
        let seen = format!("none in {}, {} kept grasps without a type", dataset.display(), found.types.without);
        checker.senseless("grasps.dataset", "at least one kept grasp that has a type", seen);
        return None;
    }
    Some(found)
}

fn settings(checker: &mut Checker<'_>, spec: &PatchesSpec) -> Option<PatchSettings> {
    let &PatchCameraSpec { distance, width, height, horizontal_fov, near, point_focal_length } = &spec.camera;
    let camera = match Intrinsics::from_horizontal_fov(width, height, horizontal_fov, near) {
        Ok(camera) => camera,
        Err(error) => {
            checker.senseless("camera", "a camera", error.to_string());
            return None;
        }
    };
    if near >= distance && checker.document.has("camera") {
        let expected = format!("below the distance, {distance} m");
        checker.senseless("camera.near", expected, format!("{near} m: nothing would be seen"));
    }
    let side = spec.patches.side;
    if side > width.min(height) {
        let expected = format!("at most the image's shorter side, {} px", width.min(height));
        checker.senseless("patches.side", expected, format!("{side} px: every patch would reach out of the image"));
    }
    let tips = <[String; 3]>::try_from(spec.patches.tips.clone()).ok()?;
    if let Some(place) = (1..3).find(|place| tips[..*place].contains(&tips[*place])) {
        checker.senseless("patches.tips", "three different contacts", format!("{} twice", tips[place]));
    }
    if spec.render.randomise && !spec.render.colour {
        let because = "depth has neither lights nor colours";
        checker.contradiction("render.randomise", "render.colour = false", because);
    }
    Some(PatchSettings {
        types: spec.grasps.types,
        side,
        tips,
        label: match spec.patches.label {
            LabelSpec::Epsilon => PatchLabel::Epsilon,
            LabelSpec::Energy => PatchLabel::Energy,
        },
        camera,
        horizontal_fov,
        distance,
        point_focal_length,
        image: spec.images.full,
        heatmap_angle: spec.images.heatmaps.then_some(spec.images.heatmap_angle),
        colour: spec.render.colour.then_some(PatchColours { randomise: spec.render.randomise }),
    })
}
