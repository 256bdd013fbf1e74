//! The dataset of picks that a job file names, compared with the job's pins.

use std::path::Path as FilePath;

use super::{found::FoundPicks, reader::read_picks, spec::PicksSourceSpec};
use crate::{
    products::{input::InputSection, viewed::FoundViews},
    sections::JobHand,
};
use form::Checker;
use kernel::words::Show;

/// The section that names the dataset.
pub const PICKS: InputSection = InputSection {
    name: "picks",
    make: "make one first, and name its folder: `graspmill run jobs/picks-quick.toml --out datasets/picks-quick`",
};

/// The picks, compared with the roots that the job pins and with the scenes of the views; `None` when something is wrong, which is
/// reported.
pub fn found_picks(
    checker: &mut Checker,
    spec: &PicksSourceSpec,
    dataset: &FilePath,
    views: &FoundViews,
) -> Option<FoundPicks> {
    let found = PICKS.found(checker, read_picks(dataset))?;
    if !PICKS.has_root(checker, spec.root.as_deref(), found.root, dataset)
        || !PICKS.has_trials_root(checker, spec.trials_root.as_deref(), found.trials, dataset)
    {
        return None;
    }
    let foreign: Vec<&str> = views
        .scenes
        .iter()
        .filter(|scene| !found.scenes.contains(&scene.id))
        .map(|scene| scene.name.as_str())
        .collect();
    if let [first, ..] = foreign[..] {
        let seen = format!("{} of {} are not in {}, as {first}", foreign.len(), views.scenes.len(), dataset.shown());
        let report = checker.invalid("picks.dataset", "picks of the scenes that the views show", seen);
        report.help("make views and picks of the same dataset of scenes");
        return None;
    }
    Some(found)
}

/// Whether a hand is that of the picks; another one is reported.
pub fn has_hand(checker: &mut Checker, hand: &JobHand, picks: &FoundPicks) -> bool {
    if hand.id == picks.hand {
        return true;
    }
    let expected = format!("the hand of the picks, of content {}", picks.hand.0.short());
    let seen = format!("{} of content {}", hand.name, hand.id.0.short());
    checker.invalid("hand.model", expected, seen).help("name the hand's description as the job of the picks does");
    false
}
