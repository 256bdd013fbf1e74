//! Folders that hold one dataset, or a set of them.

use std::path::Path;

use format::dataset::SetTable;

use super::exit::{Exit, Failure};

/// Refuses the folder of a set where a verb wants one dataset.
pub fn refuse_set(folder: &Path) -> Result<(), Failure> {
    let Some(table) = SetTable::read(folder)? else { return Ok(()) };
    let names: Vec<&str> = table.jobs.iter().map(|job| job.name.as_str()).collect();
    let message = format!("{}: a set of datasets; give one of {} in it", folder.display(), names.join(", "));
    Err(Failure::message(Exit::BadSpec, message))
}
