//! `types.json`: grasp types of the kept grasps from which patches were chosen, with their counts.

use super::row::TYPES;
use crate::dataset::{
    DatasetError,
    durable::{self, json_text},
    error::REWRITE,
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
