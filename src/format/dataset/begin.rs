//! The begin of a run: whose a folder is, before any shard.

use std::{fs, io, path::Path};

use super::{
    DatasetError, Manifest,
    durable::{self, TEMPORARY},
    folder::{RunMark, mark_text, read_mark},
    layout::{CLUSTER, MANIFEST, RUN, SHARDS},
};

/// State of a folder when a run began.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Begun {
    /// Empty or new: this run marked it.
    New,
    /// Begun before by the same job: finished shards are kept.
    Again,
    /// The folder has a manifest: the dataset is finished.
    Finished,
}

/// Marks `folder` as this job's, or finds that it is; makes it and its `shards` where missing.
///
/// # Errors
/// When it holds another job, the same job cut into other shards, or something that is no dataset; when it can't be
/// made or written.
pub fn begin_run(folder: &Path, mark: &RunMark) -> Result<Begun, DatasetError> {
    if let Some(found) = read_mark(folder)? {
        if (found.product, found.job) != (mark.product, mark.job) {
            return Err(DatasetError::ForeignJob { folder: folder.to_owned(), found: found.job, expected: mark.job });
        }
        if found != *mark {
            let words = |mark: &RunMark| {
                format!("{} samples in {} shards of {}", mark.samples, mark.shards, mark.shard_samples)
            };
            return Err(DatasetError::OtherShards {
                folder: folder.to_owned(),
                found: words(&found),
                expected: words(mark),
            });
        }
        let shards = folder.join(SHARDS);
        fs::create_dir_all(&shards).map_err(DatasetError::io("creating", &shards))?;
        return Ok(if folder.join(MANIFEST).exists() { Begun::Finished } else { Begun::Again });
    }
    // The mark of a finished dataset was deleted, as the remedy for a damaged one is: its manifest says whose it is.
    if Manifest::read(folder).is_ok_and(|manifest| manifest.is_of(mark)) {
        durable::write_file(folder, RUN, mark_text(mark).as_bytes())?;
        return Ok(Begun::Finished);
    }
    match fs::read_dir(folder) {
        Ok(entries) => {
            for entry in entries {
                let entry = entry.map_err(DatasetError::io("reading", folder))?;
                let name = entry.file_name().to_string_lossy().into_owned();
                // What a first start that was killed, or another task of it, leaves behind is ours.
                let ours =
                    [SHARDS, CLUSTER].contains(&name.as_str()) || (name.starts_with('.') && name.ends_with(TEMPORARY));
                if !ours {
                    // Another task has marked the folder since its mark was looked for.
                    if folder.join(RUN).exists() {
                        return begin_run(folder, mark);
                    }
                    return Err(DatasetError::NotADataset { folder: folder.to_owned(), entry: name });
                }
            }
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        Err(_) if folder.is_file() => return Err(DatasetError::NotAFolder { path: folder.to_owned() }),
        Err(error) => return Err(DatasetError::io("reading", folder)(error)),
    }
    let shards = folder.join(SHARDS);
    fs::create_dir_all(&shards).map_err(DatasetError::io("creating", &shards))?;
    durable::write_file(folder, RUN, mark_text(mark).as_bytes())?;
    Ok(Begun::New)
}

/// Takes back what [`begin_run`] made of a new folder, so that it is free for another job. What else is there stays.
pub fn abandon_run(folder: &Path) {
    // Whatever does not go is found by the next run, which says so.
    _ = fs::remove_file(folder.join(RUN));
    _ = fs::remove_dir(folder.join(SHARDS));
    _ = fs::remove_dir(folder);
}
