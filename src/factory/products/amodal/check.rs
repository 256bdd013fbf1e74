//! From the keys of a job for amodal pairs to settings that make sense: every mistake that the schema cannot see.

use std::path::{Path as FilePath, PathBuf};

use super::{settings::AmodalSettings, spec::AmodalSpec};
use crate::products::{
    pair::{
        Channels, PairRules,
        touch::{RayTarget, Touch, TouchSpec},
    },
    viewed::{FoundViews, VIEWS, found_views},
};
use form::Checker;
use format::Product;

/// Settings of the pairs; mistakes are reported.
pub(super) fn settings(checker: &mut Checker, spec: &AmodalSpec, folder: &FilePath) -> AmodalSettings {
    let rules = PairRules {
        resolution: spec.grid.resolution,
        drop_index_zero: spec.grid.drop_index_zero,
        truth: spec.truth.check(checker),
        min_partial_cells: spec.gate.min_partial_cells,
    };
    rules.check(checker);
    AmodalSettings {
        points: spec.points,
        min_visible_share: spec.gate.min_visible_share,
        rules,
        solid_with_surface: spec.truth.solid_with_surface,
        channels: Channels::read(checker, &spec.channels, Product::AMODAL, None),
        touch: touch(checker, &spec.touch, folder),
    }
}

/// Kinds of touch; those that no scene offers are reported.
fn touch(checker: &mut Checker, spec: &TouchSpec, folder: &FilePath) -> Touch {
    if spec.random_rays && spec.ray_target == RayTarget::Cells {
        let expected = "\"mesh\": the cells of a grid do not contain the surroundings of a body";
        checker.invalid("touch.ray_target", expected, "\"cells\"".to_owned());
    }
    if spec.grasp {
        let because = "a hand that grasps in a scene moves its neighbours; use the scenes in a job for picks";
        checker.contradiction("touch.grasp", "product", because);
    }
    Touch::read(checker, spec, folder)
}

/// The folder of the dataset; `None` when the job names none, which is reported.
pub(super) fn dataset(checker: &mut Checker, spec: &AmodalSpec, folder: &FilePath) -> Option<PathBuf> {
    VIEWS.folder(checker, spec.views.dataset.as_ref(), folder)
}

/// The views, compared with the root that the job pins; `None` when something is wrong, which is reported.
pub(super) fn views(checker: &mut Checker, spec: &AmodalSpec, dataset: &FilePath) -> Option<FoundViews> {
    found_views(checker, &spec.views, dataset)
}
