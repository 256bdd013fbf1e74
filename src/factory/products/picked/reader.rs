//! Reads picks from a finished dataset.

use std::path::{Path, PathBuf};

use super::found::FoundPicks;
use crate::{
    ProduceError,
    products::input::{InvalidInput, open_input},
};
use format::{
    Product,
    dataset::{DatasetError, DatasetReader},
};
use kernel::{
    ids::ObjectId,
    words::{NumberClass, Show},
};

/// Reason why samples cannot be made from a folder as a dataset of picks.
#[derive(Debug, thiserror::Error)]
pub enum InvalidPicks {
    /// The folder holds no finished dataset of picks.
    #[error(transparent)]
    Input(#[from] InvalidInput),
    /// The dataset cannot be read.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The dataset's table of assets names no hand.
    #[error("{} names no hand", .0.shown())]
    NoHand(PathBuf),
}

/// Scenes and hand of a dataset of picks; of its grasps none is read.
///
/// # Errors
/// When the folder holds no finished dataset of picks.
pub fn read_picks(folder: &Path) -> Result<FoundPicks, InvalidPicks> {
    let (reader, root) = open_input(folder, Product::PICKS, NumberClass::Exact)?;
    let trials = reader.manifest().classes.get(&NumberClass::Physics).copied();
    let assets = reader.assets()?;
    let hand = assets.hands.first().ok_or_else(|| InvalidPicks::NoHand(folder.to_owned()))?.object;
    Ok(FoundPicks { root, trials, hand, scenes: assets.subjects.iter().map(|row| row.object).collect() })
}

/// Opens a dataset of picks that a job has read before.
///
/// # Errors
/// When it is gone or another one than when the job was resolved.
pub fn open_picks(dataset: &Path, picks: &FoundPicks) -> Result<DatasetReader, ProduceError> {
    let name = || dataset.display().to_string();
    let opened = open_input(dataset, Product::PICKS, NumberClass::Exact);
    let (reader, root) = opened.map_err(|error| ProduceError::unusable(name(), error))?;
    let trials = reader.manifest().classes.get(&NumberClass::Physics).copied();
    let changed = |found, expected| ProduceError::Changed { name: name(), found, expected };
    if root != picks.root {
        return Err(changed(ObjectId(root), ObjectId(picks.root)));
    }
    match (trials, picks.trials) {
        (found, expected) if found == expected => Ok(reader),
        (Some(found), Some(expected)) => Err(changed(ObjectId(found), ObjectId(expected))),
        _ => Err(ProduceError::unusable(name(), "it was with trials or without when the job was resolved; restore it")),
    }
}
