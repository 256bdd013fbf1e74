//! Record of tasks for the merge that closes their dataset: the resolved job, and data that it does not contain.

use std::io;

use serde::{Deserialize, Serialize};

use super::DatasetHeader;
use crate::storage::{
    DatasetError, durable,
    layout::{JOB, PENDING},
};
use kernel::files::{Bound, Folder};

/// `pending.json`: content of a dataset's tables that does not follow from its `job.toml`, which names only usable meshes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pending {
    /// Meshes that could not be used.
    pub refused: Vec<serde_json::Value>,
    /// Warnings for users.
    pub warnings: Vec<String>,
}

/// Writes `job.toml` and `pending.json` if they do not exist yet. Every task of a job writes the same.
///
/// # Errors
/// When they can't be read or written.
pub fn write_pending(folder: &Folder, header: &DatasetHeader) -> Result<(), DatasetError> {
    let DatasetHeader { job_text, refused, warnings, .. } = header;
    let pending = Pending { refused: refused.clone(), warnings: warnings.clone() };
    let text = serde_json::to_string_pretty(&pending).expect("plain data") + "\n";
    for (name, content) in [(JOB, job_text), (PENDING, &text)] {
        let path = folder.path_of(name);
        let stands = match folder.read(name, Bound::DATASET_TABLE) {
            Ok(found) => found == content.as_bytes(),
            Err(error) if error.kind() == io::ErrorKind::NotFound => false,
            Err(error) => return Err(DatasetError::io("reading", &path)(error)),
        };
        if !stands {
            durable::write_file(folder, name, content.as_bytes())?;
        }
    }
    Ok(())
}

/// Reads what tasks left in a folder; `None` where there is no `pending.json`.
///
/// # Errors
/// When the file can't be read or is invalid.
pub fn read_pending(folder: &Folder) -> Result<Option<Pending>, DatasetError> {
    let path = folder.path_of(PENDING);
    let text = match folder.read(PENDING, Bound::DATASET_TABLE) {
        Ok(text) => text,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(DatasetError::io("reading", &path)(error)),
    };
    serde_json::from_slice(&text).map(Some).map_err(|error| DatasetError::Invalid {
        path,
        problem: error.to_string(),
        remedy: "delete it and run one task again, which writes it again",
    })
}

/// Removes `pending.json`, if it is there: the dataset is closed.
///
/// # Errors
/// When it can't be removed.
pub fn clear_pending(folder: &Folder) -> Result<(), DatasetError> {
    match folder.remove_file(PENDING) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(DatasetError::io("removing", &folder.path_of(PENDING))(error))
        }
        _ => Ok(()),
    }
}
