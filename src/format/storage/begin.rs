//! Start of a run: the job that a folder belongs to, before any shard is written.

use super::{
    DatasetError, Manifest, durable,
    folder::{RunMark, mark_text, own_name, present_names, read_mark},
    layout::{CLUSTER, MANIFEST, RUN, SHARDS, ShardName},
};
use kernel::files::{self, Folder};

/// State of a folder when a run began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begun {
    /// Empty or new: this run marked it.
    New,
    /// Begun earlier by the same job: finished shards are kept.
    Again,
    /// The folder has a manifest: the dataset is finished.
    Finished,
}

/// Marks `folder` as this job's, or finds that it already is; creates it and its `shards` if missing.
///
/// # Errors
/// When it holds another job, the same job cut into other shards, or something that is not a dataset; when a part of it is a
/// link, or can't be created or written.
pub fn begin_run(folder: &Folder, mark: &RunMark) -> Result<Begun, DatasetError> {
    let (path, shards) = (folder.path(), folder.subfolder(SHARDS));
    if let Some(found) = read_mark(folder)? {
        if (found.product, found.job) != (mark.product, mark.job) {
            return Err(DatasetError::ForeignJob { folder: path.to_owned(), found: found.job, expected: mark.job });
        }
        if found != *mark {
            let words = |mark: &RunMark| {
                format!("{} samples in {} shards of {}", mark.samples, mark.shards, mark.shard_samples)
            };
            return Err(DatasetError::OtherShards {
                folder: path.to_owned(),
                found: words(&found),
                expected: words(mark),
            });
        }
        shards.create().map_err(DatasetError::io("creating", shards.path()))?;
        return Ok(if folder.contains(MANIFEST) { Begun::Finished } else { Begun::Again });
    }
    // The mark of a finished dataset was deleted, as the remedy for a damaged mark requires: its manifest names the job.
    if Manifest::read(folder).is_ok_and(|manifest| manifest.is_of(mark)) {
        durable::write_file(folder, RUN, mark_text(mark).as_bytes())?;
        return Ok(Begun::Finished);
    }
    if folder.is_another_file() {
        return Err(DatasetError::NotAFolder { path: path.to_owned() });
    }
    // Leftovers of a killed first start, or of another task of the job, are ours.
    let is_ours = |name: &String| [SHARDS, CLUSTER].contains(&name.as_str()) || files::is_temporary_name(name);
    let mut names = present_names(folder)?.into_iter();
    if let Some(entry) = names.find(|name| !is_ours(name)) {
        // Another task has marked the folder in the meantime.
        if folder.contains(RUN) {
            return begin_run(folder, mark);
        }
        return Err(DatasetError::NotADataset { folder: path.to_owned(), entry });
    }
    let is_own_shard = |name: &String| files::is_temporary_name(name) || ShardName::parse(own_name(name)).is_some();
    if let Some(entry) = present_names(&shards)?.into_iter().find(|name| !is_own_shard(name)) {
        return Err(DatasetError::NotADataset { folder: shards.path().to_owned(), entry });
    }
    shards.create().map_err(DatasetError::io("creating", shards.path()))?;
    durable::write_file(folder, RUN, mark_text(mark).as_bytes())?;
    Ok(Begun::New)
}

/// Removes what [`begin_run`] created in a new folder, so that another job can use it. Anything else in it is kept.
pub fn abandon_run(folder: &Folder) {
    // The next run finds and reports a folder that cannot be removed. A folder with shards also belongs to another run, which
    // needs the mark.
    if folder.remove_empty_folder(SHARDS).is_ok() {
        _ = folder.remove_file(RUN);
        _ = folder.remove_itself();
    }
}
