//! From the keys of a job for heatmaps to a job that makes sense: every mistake that the schema cannot see.

use std::{
    cell::RefCell,
    path::{Path as FilePath, PathBuf},
    sync::Arc,
};

use super::{
    settings::{HeatmapJob, HeatmapSettings},
    spec::{HeatmapSpec, HeatmapsSpec, SquaresSpec},
    types::count_types,
};
use crate::{
    products::{
        patches::Fingertips,
        picked::{FoundPicks, PICKS, PickedHand, found_picks, has_hand},
        viewed::{VIEWS, found_views},
    },
    sections::{JobHand, read_hand},
};
use form::{Checker, first_repeated};
use format::{HeatmapLabel, dataset::DatasetReader};
use kernel::{files::Folder, words::Show};
use robot::hand::Hand;
use sim::HandModel;

const MAKE_TRIALS: &str =
    "make picks with trials (`picks.trials` in their job), or label every free grasp: `heatmaps.label = \"free\"`";

/// The whole job; `None` when something is wrong, which is reported.
pub(super) fn job(checker: &mut Checker, spec: &HeatmapsSpec, folder: &FilePath) -> Option<HeatmapJob> {
    let hand = hand(checker, spec, folder);
    let settings = hand.as_ref().and_then(|(_, hand)| settings(checker, spec, hand.hand()));
    let views_folder = VIEWS.folder(checker, spec.views.dataset.as_ref(), folder);
    let picks_folder = PICKS.folder(checker, spec.picks.dataset.as_ref(), folder);
    let views = views_folder.as_ref().and_then(|dataset| found_views(checker, &spec.views, dataset));
    let (views_folder, picks_folder, views) = (views_folder?, picks_folder?, views?);
    let picks = found_picks(checker, &spec.picks, &picks_folder, &views)?;
    let (hand, model) = hand?;
    if !has_hand(checker, &hand, &picks) {
        return None;
    }
    let settings = settings?;
    let types = types(checker, &settings, (&picks_folder, &picks), &model)?;
    Some(HeatmapJob { views_folder, views, picks_folder, picks, hand, types, settings })
}

/// The hand, and its description.
fn hand(checker: &mut Checker, spec: &HeatmapsSpec, folder: &FilePath) -> Option<(JobHand, PickedHand)> {
    let read = RefCell::new(None);
    let can = |model: &HandModel| {
        read.replace(Some(PickedHand::new(model.hand())));
        Ok(())
    };
    let hand = read_hand(checker, "hand", spec.hand.as_ref()?, folder, can)?;
    Some((hand, read.take()?))
}

fn settings(checker: &mut Checker, spec: &HeatmapsSpec, hand: &Arc<Hand>) -> Option<HeatmapSettings> {
    let HeatmapSpec { label, types, max_angle, depth_step, .. } = spec.heatmaps;
    let SquaresSpec { side, metric, size } = spec.patches;
    let tips = tips(checker, spec, hand)?;
    let (label, size) = (label.into(), metric.then_some(size));
    Some(HeatmapSettings { label, types, tips, max_angle, depth_step, side, size })
}

/// The fingertips, by default the pads of a gripper.
fn tips(checker: &mut Checker, spec: &HeatmapsSpec, hand: &Arc<Hand>) -> Option<Vec<String>> {
    const KEY: &str = "heatmaps.tips";
    let Some(tips) = &spec.heatmaps.tips else {
        let pads = hand.pads().map(|pads| pads.map(|pad| hand.contacts()[pad].name.clone()).to_vec());
        if pads.is_none() {
            let names: Vec<&str> = hand.contacts().iter().map(|contact| contact.name.as_str()).collect();
            let what = format!("the contacts of {} that are its fingertips, among {}", hand.name(), names.join(", "));
            checker.missing(KEY, what);
        }
        return pads;
    };
    if let Some(twice) = first_repeated(tips) {
        checker.invalid(KEY, "different contacts", format!("{} twice", tips[twice]));
        return None;
    }
    if let Err(error) = Fingertips::new(hand, tips) {
        checker.invalid(KEY, "contacts of the hand", error.to_string());
        return None;
    }
    Some(tips.clone())
}

/// The chosen types; none of a hand without types.
fn types(
    checker: &mut Checker,
    settings: &HeatmapSettings,
    (dataset, picks): (&PathBuf, &FoundPicks),
    hand: &PickedHand,
) -> Option<Vec<u32>> {
    if settings.label == HeatmapLabel::Trial && picks.trials.is_none() {
        let seen = format!("{} has none", dataset.shown());
        checker.invalid("heatmaps.label", "a dataset of picks with trials", seen).help(MAKE_TRIALS);
        return None;
    }
    let reader = PICKS.found(checker, DatasetReader::open(&Folder::at(dataset)))?;
    let counts = PICKS.found(checker, count_types(&reader, hand, settings.label, settings.types))?;
    if counts.grasps() == 0 || hand.has_types() && counts.chosen.is_empty() {
        let such = if settings.label == HeatmapLabel::Trial { "that held" } else { "that is free" };
        let seen = format!("none in {}", dataset.shown());
        let report = checker.invalid("picks.dataset", format!("at least one grasp {such}"), seen);
        report.help("make picks of more scenes or grasps, or try more grasps (`picks.candidates`, `picks.trials`)");
        return None;
    }
    Some(counts.chosen)
}
