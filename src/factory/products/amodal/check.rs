//! From the keys of a job for amodal pairs to settings that make sense: every mistake that the schema cannot see.

use std::path::{Path as FilePath, PathBuf};

use super::{
    settings::{AmodalSettings, FoundViews},
    spec::AmodalSpec,
    views_reader::read_views,
};
use crate::{
    job::tidy,
    products::pair::{Channels, PairRules},
};
use form::Checker;
use format::Product;
use kernel::ids::Digest;

const MAKE_VIEWS: &str = "make it first: `graspmill run jobs/views-quick.toml --out datasets/views-quick`";

/// Settings of the pairs; mistakes are reported.
pub(super) fn settings(checker: &mut Checker, spec: &AmodalSpec) -> AmodalSettings {
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
    }
}

/// The folder of the dataset; `None` when the job names none, which is reported.
pub(super) fn dataset(checker: &mut Checker, spec: &AmodalSpec, folder: &FilePath) -> Option<PathBuf> {
    match &spec.views.dataset {
        Some(dataset) => Some(tidy(&folder.join(dataset))),
        None => {
            checker.missing("views.dataset", "the folder of a finished dataset of views").help(MAKE_VIEWS);
            None
        }
    }
}

/// The views, compared with the root that the job pins; `None` when something is wrong, which is reported.
pub(super) fn views(checker: &mut Checker, spec: &AmodalSpec, dataset: &FilePath) -> Option<FoundViews> {
    let found = match read_views(dataset) {
        Ok(found) => found,
        Err(error) => {
            checker.not_found("views.dataset", "dataset of views", error.to_string()).help(MAKE_VIEWS);
            return None;
        }
    };
    let pinned = spec.views.root.as_deref().and_then(Digest::from_hex);
    if let Some(pinned) = pinned.filter(|pinned| *pinned != found.root) {
        let expected = format!("views of root {}", pinned.short());
        let seen = format!("{}: {} holds others", found.root.short(), dataset.display());
        let report = checker.invalid("views.root", expected, seen);
        report.help("restore the dataset, or take `root` out of the job for a new dataset");
        return None;
    }
    Some(found)
}
