//! Reads the grasps of a finished dataset for a job for picks.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use nalgebra::Vector3;

use super::settings::{PickGrasps, StoredGrasp};
use crate::products::input::{InvalidInput, open_input};
use format::{
    Grasp, GraspLabel, GraspLadders, GraspRun, GraspTrials, LadderLabel, Product, TakenGrasps,
    dataset::{DatasetError, Sample, Selection},
};
use kernel::{
    ids::ObjectId,
    words::{GraspVerdict, NumberClass, Show},
};

/// Reason why a folder is no dataset of grasps that can be evaluated in scenes.
#[derive(Debug, thiserror::Error)]
pub enum InvalidPickGrasps {
    /// The folder holds no finished dataset of grasps.
    #[error(transparent)]
    Input(#[from] InvalidInput),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// Grasps are to be taken by their trials, and the dataset has none.
    #[error("{} has no trials, which the choice of grasps requires", .0.shown())]
    NoTrials(PathBuf),
    /// The dataset's table of assets names no hand.
    #[error("{} names no hand", .0.shown())]
    NoHand(PathBuf),
}

/// The selected grasps of a dataset, for these objects only; one chunk of a shard is in memory at a time. By default
/// those that held, or without trials the kept ones.
///
/// # Errors
/// When the folder holds no finished dataset of grasps of a known hand, or none with trials where they are required.
pub fn read_pick_grasps(
    folder: &Path,
    take: Option<TakenGrasps>,
    wanted: &BTreeSet<ObjectId>,
) -> Result<PickGrasps, InvalidPickGrasps> {
    let (reader, root) = open_input(folder, Product::GRASPS, NumberClass::Exact)?;
    let physics = reader.manifest().classes.get(&NumberClass::Physics).copied();
    let take = take.unwrap_or(if physics.is_some() { TakenGrasps::Held } else { TakenGrasps::Kept });
    let trials = physics.filter(|_| take.needs_trials());
    if take.needs_trials() && trials.is_none() {
        return Err(InvalidPickGrasps::NoTrials(folder.to_owned()));
    }
    let mut objects: BTreeMap<ObjectId, Vec<StoredGrasp>> = BTreeMap::new();
    for sample in reader.iter(Selection::default()) {
        let sample = sample?;
        if !wanted.contains(&sample.id.subject) {
            continue;
        }
        let run = sample.read::<GraspRun>()?;
        let tried = if take.needs_trials() { held_of_tried(&sample)? } else { BTreeMap::new() };
        let taken = (0..).zip(&run.grasps).filter(|(rank, grasp)| is_taken(take, *rank, grasp, &tried));
        // A hand that touches nothing has no line to be rotated about, and grasps nothing.
        let stored = taken.filter(|(_, grasp)| !grasp.contacts.is_empty());
        let stored = stored.map(|(rank, grasp)| stored_grasp(sample.id.item.0, rank, grasp));
        objects.entry(sample.id.subject).or_default().extend(stored);
    }
    objects.values_mut().for_each(|grasps| grasps.sort_by_key(|grasp| (grasp.run, grasp.rank)));
    let assets = reader.assets()?;
    let hand = assets.hands.first().ok_or_else(|| InvalidPickGrasps::NoHand(folder.to_owned()))?.object;
    Ok(PickGrasps { root, trials, hand, take, objects })
}

/// The tried grasps of a run, each with whether its label is held, by either method of labels.
fn held_of_tried(sample: &Sample) -> Result<BTreeMap<u32, bool>, DatasetError> {
    let mut tried = BTreeMap::new();
    if let Some(trials) = sample.find::<GraspTrials>()? {
        tried.extend(trials.trials.iter().map(|trial| (trial.grasp, trial.label() == GraspLabel::Held)));
    }
    if let Some(ladders) = sample.find::<GraspLadders>()? {
        tried.extend(ladders.ladders.iter().map(|ladder| (ladder.grasp, ladder.label() == LadderLabel::Held)));
    }
    Ok(tried)
}

fn is_taken(take: TakenGrasps, rank: u32, grasp: &Grasp, tried: &BTreeMap<u32, bool>) -> bool {
    match take {
        TakenGrasps::Tried => tried.contains_key(&rank),
        TakenGrasps::Held => tried.get(&rank).copied() == Some(true),
        TakenGrasps::Kept => grasp.verdict == GraspVerdict::Kept,
        TakenGrasps::Closed => grasp.verdict.is_closed(),
        // No stored grasp is a sampled one.
        TakenGrasps::Sampled => false,
    }
}

fn stored_grasp(run: u32, rank: u32, grasp: &Grasp) -> StoredGrasp {
    let sum: Vector3<f64> = grasp.contacts.iter().map(|contact| Vector3::from(contact.point)).sum();
    StoredGrasp {
        run,
        rank,
        object_from_base: grasp.object_from_base,
        posture: grasp.posture.clone(),
        middle: (sum / grasp.contacts.len() as f64).into(),
    }
}
