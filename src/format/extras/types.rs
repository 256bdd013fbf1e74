//! `types.json`: grasp types of the kept grasps from which patches were chosen, with their counts.

use std::collections::BTreeMap;

use super::{FileCheck, FileContext};
use crate::{
    products::patches::{TYPE_FACT, TYPES},
    storage::{
        DatasetError, DatasetReader,
        durable::{self, json_text},
        error::REWRITE,
    },
};
use kernel::{
    files::{Bound, Folder},
    words::GraspTypeCounts,
};

/// Writes the table.
///
/// # Errors
/// When the file cannot be written.
pub fn write_types(folder: &Folder, types: &GraspTypeCounts) -> Result<(), DatasetError> {
    durable::write_file(folder, TYPES, json_text(types).as_bytes()).map(drop)
}

/// Reads the table.
///
/// # Errors
/// When the file is missing or damaged.
pub fn read_types(folder: &Folder) -> Result<GraspTypeCounts, DatasetError> {
    let path = folder.path_of(TYPES);
    let text = folder.read(TYPES, Bound::DATASET_TABLE).map_err(DatasetError::io("reading", &path))?;
    serde_json::from_slice(&text).map_err(|error| DatasetError::Invalid {
        path: path.clone(),
        problem: error.to_string(),
        remedy: REWRITE,
    })
}

/// The check of the table.
pub(super) static CHECK: FileCheck = FileCheck { name: TYPES, in_root: None, check: check_types };

/// Checks the counts of the chosen types against the samples: each grasp of a chosen type is one sample.
fn check_types(context: &FileContext<'_>) -> Vec<String> {
    let words = |error: DatasetError| match error {
        DatasetError::Invalid { problem, .. } => problem,
        other => other.to_string(),
    };
    let types = match read_types(context.folder) {
        Ok(types) => types,
        Err(error) => return vec![words(error)],
    };
    let Some(reader) = context.reader.filter(|_| context.shards_intact) else { return Vec::new() };
    let counted = match count_types(reader) {
        Ok(counted) => counted,
        Err(error) => return vec![words(error)],
    };
    let count_of = |kind: &u32| (*kind, types.counts.get(kind).copied().unwrap_or(0));
    let stated: BTreeMap<u32, u64> = types.chosen.iter().map(count_of).collect();
    let differs = stated != counted;
    let what = || format!("its grasps of the chosen types are {stated:?}, those of the samples {counted:?}");
    differs.then(what).into_iter().collect()
}

/// Samples of each grasp type, kept or rejected.
fn count_types(reader: &DatasetReader) -> Result<BTreeMap<u32, u64>, DatasetError> {
    let mut counts = BTreeMap::new();
    for shard in 0..reader.manifest().shards.len() {
        for row in reader.ledger(shard)?.rows {
            *counts.entry(row.facts.integer(TYPE_FACT)).or_default() += 1;
        }
    }
    Ok(counts)
}
