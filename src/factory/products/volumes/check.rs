//! From the keys of a job for volumes to settings that make sense: every mistake that the schema cannot see.

use std::path::{Path as FilePath, PathBuf};

use super::{
    settings::{VolumeGrasps, VolumeSettings},
    spec::{FusionSpec, VolumesSpec},
};
use crate::{
    products::{
        picked::{PICKS, found_picks, has_hand},
        viewed::{FoundViews, VIEWS, found_views},
    },
    sections::read_hand,
};
use form::Checker;
use kernel::voxel::VolumeGrid;

/// Settings of the volumes; mistakes are reported.
pub(super) fn settings(checker: &mut Checker, spec: &VolumesSpec) -> VolumeSettings {
    let FusionSpec { size, resolution, truncation_voxels, support_height, views, per_scene } = spec.fusion;
    checker.check_range("fusion.views", &views);
    if support_height >= size {
        checker.invalid(
            "fusion.support_height",
            format!("less than the cube's edge, {size} m"),
            format!("{support_height} m"),
        );
    }
    VolumeSettings { grid: VolumeGrid { resolution, size }, truncation_voxels, support_height, views, per_scene }
}

/// The folder of the dataset; `None` when the job names none, which is reported.
pub(super) fn dataset(checker: &mut Checker, spec: &VolumesSpec, folder: &FilePath) -> Option<PathBuf> {
    VIEWS.folder(checker, spec.views.dataset.as_ref(), folder)
}

/// The views, compared with the root that the job pins and with its cube; `None` when something is wrong, which is reported.
pub(super) fn views(
    checker: &mut Checker,
    spec: &VolumesSpec,
    settings: &VolumeSettings,
    dataset: &FilePath,
) -> Option<FoundViews> {
    let found = found_views(checker, &spec.views, dataset)?;
    if let Some((key, seen)) = settings.too_small_for(&found.container) {
        let report = checker.invalid(key, "a cube that contains the inside of the bin", seen);
        report.help("give a larger `fusion.size`, with `fusion.resolution` to match, or make scenes in a smaller bin");
        return None;
    }
    let most = found.scenes.iter().map(|scene| scene.cameras.len()).max().unwrap_or(0);
    if (most as u64) < u64::from(spec.fusion.views[0]) {
        let seen = format!("{} images, and no scene has more than {most} views", spec.fusion.views[0]);
        let report = checker.invalid("fusion.views", "at most as many images as a scene has views", seen);
        report.help("use fewer images, or make more views of each scene");
        return None;
    }
    Some(found)
}

/// The grasps that go with the volumes; `None` where the job names none, or when something is wrong, which is reported.
pub(super) fn grasps(
    checker: &mut Checker,
    spec: &VolumesSpec,
    folder: &FilePath,
    views: &FoundViews,
) -> Option<VolumeGrasps> {
    let source = match (&spec.picks, &spec.hand) {
        (Some(source), Some(_)) => source,
        (Some(_), None) => {
            checker
                .missing("hand", "the hand of the picks")
                .help("name the hand's description: `hand = { model = \"...\" }`");
            return None;
        }
        (None, Some(_)) => {
            checker.contradiction("hand", "picks", "without grasps there is no hand");
            return None;
        }
        (None, None) => return None,
    };
    let hand = read_hand(checker, "hand", spec.hand.as_ref()?, folder, |_| Ok(()));
    let dataset = PICKS.folder(checker, source.dataset.as_ref(), folder)?;
    let picks = found_picks(checker, source, &dataset, views)?;
    let hand = hand.filter(|hand| has_hand(checker, hand, &picks))?;
    Some(VolumeGrasps { dataset, picks, hand })
}
