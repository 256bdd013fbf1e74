//! Folders that hold one dataset, or a set of them.

use format::dataset::SetTable;

use super::exit::{Exit, Failure};
use kernel::{files::Folder, words::Show};

/// Refuses the folder of a set where a verb wants one dataset.
pub fn refuse_set(folder: &Folder) -> Result<(), Failure> {
    let Some(table) = SetTable::read(folder)? else { return Ok(()) };
    let names: Vec<&str> = table.jobs.iter().map(|job| job.name.as_str()).collect();
    let message = format!("{}: a set of datasets; give one of {} in it", folder.path().shown(), names.join(", "));
    Err(Failure::message(Exit::BadSpec, message))
}
