//! Errors of datasets, with numbers and remedies.

use std::{
    io,
    path::{Path, PathBuf},
};

use crate::{Product, RecordError};
use kernel::{
    ids::{Digest, JobDigest, SampleIndex},
    remedy,
    words::{Show, number_ranges},
};

/// Error of a dataset.
#[derive(Debug, thiserror::Error)]
pub enum DatasetError {
    /// The operating system refused a read or write.
    #[error("{action} {}: {source}; {}", path.shown(), io_remedy(action, source))]
    Io {
        /// Action that failed: "writing", "reading", ...
        action: &'static str,
        /// File.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The MCAP library refused.
    #[error("{}: {source}", path.shown())]
    Mcap {
        /// File.
        path: PathBuf,
        /// Why.
        source: mcap::McapError,
    },
    /// The folder holds another job.
    #[error(
        "{} belongs to job {}, this is job {}; give another --out, or delete the folder to start over",
        folder.shown(), found.0.short(), expected.0.short()
    )]
    ForeignJob {
        /// The folder.
        folder: PathBuf,
        /// Job digest that the folder was begun with.
        found: JobDigest,
        /// Job digest of this run.
        expected: JobDigest,
    },
    /// The folder holds the same job, cut into other shards.
    #[error(
        "{} was begun with {found}, this run needs {expected}; use the same shard size, or another --out",
        folder.shown()
    )]
    OtherShards {
        /// The folder.
        folder: PathBuf,
        /// Shards of the folder, in words.
        found: String,
        /// Shards of this run, in words.
        expected: String,
    },
    /// The folder holds another set.
    #[error("{} holds the set {}, this is {}; give another --out, or delete the folder", folder.shown(), found.shown(), expected.shown())]
    ForeignSet {
        /// The folder.
        folder: PathBuf,
        /// Datasets found.
        found: String,
        /// Datasets of this set.
        expected: String,
    },
    /// The folder holds something that is not a dataset.
    #[error("{} is not empty and no dataset ('{}' is in it); give an empty or new folder", folder.shown(), entry.shown())]
    NotADataset {
        /// The folder.
        folder: PathBuf,
        /// One thing in it.
        entry: String,
    },
    /// A folder to be filled is not empty.
    #[error("{} is not empty ('{}' is in it); give a new or empty folder", folder.shown(), entry.shown())]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// One thing in it.
        entry: String,
    },
    /// A folder to be read or filled is a file.
    #[error("{} is a file; give a folder", path.shown())]
    NotAFolder {
        /// The file.
        path: PathBuf,
    },
    /// The path does not exist.
    #[error("{}: no such folder; give the folder that `run --out` made", folder.shown())]
    NoFolder {
        /// The path.
        folder: PathBuf,
    },
    /// The folder holds no dataset.
    #[error("{} holds no dataset: it has neither manifest.json nor run.json; {}", folder.shown(), folder_remedy(inside))]
    NoDataset {
        /// The folder.
        folder: PathBuf,
        /// Names of the folders in it that hold datasets.
        inside: Vec<String>,
    },
    /// The folder holds a dataset that is not finished.
    #[error("{} has no manifest.json: the dataset is not finished; `run` the job again to resume", folder.shown())]
    Unfinished {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder holds a set of which datasets are not finished.
    #[error("{} is a set of which {} not finished; `run` the set again to resume", folder.shown(), unfinished(missing))]
    UnfinishedSet {
        /// The folder.
        folder: PathBuf,
        /// Names of those datasets.
        missing: Vec<String>,
    },
    /// The dataset was written in another format.
    #[error("{} has format version {found}, this program reads {expected}; {}", path.shown(), version_remedy(*found, *expected))]
    Version {
        /// The file with the version.
        path: PathBuf,
        /// Version found.
        found: u32,
        /// Ours.
        expected: u32,
    },
    /// The content of a file of the dataset is invalid.
    #[error("{}: {problem}; {remedy}", path.shown())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Problem, with numbers.
        problem: String,
        /// Remedy.
        remedy: &'static str,
    },
    /// The content of a file does not match its name or the manifest.
    #[error(
        "{} has changed: saved digest {}, calculated {}; {remedy}", path.shown(), saved.short(), calculated.short()
    )]
    Changed {
        /// The file.
        path: PathBuf,
        /// Digest in its name or in the manifest.
        saved: Digest,
        /// Digest of its content.
        calculated: Digest,
        /// Remedy.
        remedy: &'static str,
    },
    /// A payload is not a valid record.
    #[error("{}: sample {index}: {source}; {REMAKE}", path.shown())]
    Record {
        /// The shard.
        path: PathBuf,
        /// The sample.
        index: SampleIndex,
        /// Why not.
        source: RecordError,
    },
    /// The dataset is of a product whose samples have no such record.
    #[error("{} is of a dataset of {found}, whose samples have no {record}; give a dataset of {}", path.shown(), of.join(" or "))]
    OtherProduct {
        /// The shard.
        path: PathBuf,
        /// Product of the dataset.
        found: Product,
        /// Name of the record's channel.
        record: &'static str,
        /// Products whose samples have the record.
        of: Vec<&'static str>,
    },
    /// Shards of the plan are missing.
    #[error("{} of {shards} shards are missing ({}); `run` the job again: only they are made", missing.len(), list(missing))]
    MissingShards {
        /// Number of shards in the plan.
        shards: u32,
        /// Which are missing.
        missing: Vec<u32>,
    },
    /// The caller broke the writer's order; a defect of the program, not of the data.
    #[error("shard {shard}: expected {expected}, got {found}")]
    Sequence {
        /// The shard's name.
        shard: String,
        /// Expected item.
        expected: String,
        /// Item that came instead.
        found: String,
    },
    /// Two sample indices have the same id.
    #[error("samples {first} and {second} are both {id}: the plan repeats a sample")]
    DuplicateSample {
        /// The id.
        id: String,
        /// One index.
        first: SampleIndex,
        /// The other.
        second: SampleIndex,
    },
}

/// The remedy for a shard that is damaged.
pub const REMAKE: &str = "delete this shard if it exists, and `run` the job again: only this shard is made again";

/// The remedy for a table that is damaged.
pub const REWRITE: &str =
    "delete manifest.json and `run` the job again: the shards are kept, the tables are written again";

impl DatasetError {
    /// Wraps an I/O error with what was tried on which file.
    pub fn io(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { action, path: path.to_owned(), source }
    }

    /// Wraps an error of the MCAP library; I/O errors stay I/O errors.
    pub fn mcap(action: &'static str, path: &Path) -> impl FnOnce(mcap::McapError) -> Self {
        move |source| match source {
            mcap::McapError::Io(source) => Self::Io { action, path: path.to_owned(), source },
            source => Self::Mcap { path: path.to_owned(), source },
        }
    }

    /// Whether the folder belongs to another job, is not a dataset, is a dataset of another product, or is not empty: exit code
    /// 2; another folder must be given.
    pub fn is_foreign(&self) -> bool {
        matches!(
            self,
            Self::ForeignJob { .. }
                | Self::ForeignSet { .. }
                | Self::OtherShards { .. }
                | Self::NotADataset { .. }
                | Self::Occupied { .. }
                | Self::NotAFolder { .. }
                | Self::NoFolder { .. }
                | Self::NoDataset { .. }
                | Self::OtherProduct { .. }
        )
    }

    /// Whether the operating system is to blame (disk full, read-only, gone): exit code 74, retry and resume.
    pub fn is_io(&self) -> bool {
        matches!(self, Self::Io { .. })
    }
}

fn unfinished(missing: &[String]) -> String {
    format!("{} {}", missing.join(", ").shown(), if missing.len() == 1 { "is" } else { "are" })
}

fn folder_remedy(inside: &[String]) -> String {
    const SHOWN: usize = 8;
    if inside.is_empty() {
        return "give the folder that `run --out` made".to_owned();
    }
    let more = if inside.len() > SHOWN { ", ..." } else { "" };
    format!("give one of those in it: {}{more}", inside[..inside.len().min(SHOWN)].join(", ").shown())
}

/// Actions that write nothing.
const READING: [&str; 3] = ["reading", "opening", "measuring"];

fn io_remedy(action: &str, error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space and run again: finished shards are kept"
        }
        io::ErrorKind::FileTooLarge => {
            "files cannot grow this large here (`ulimit -f`): raise the limit and run again; finished shards are kept"
        }
        io::ErrorKind::ReadOnlyFilesystem => "give a folder that can be written",
        io::ErrorKind::PermissionDenied if !READING.contains(&action) => {
            "give a folder that can be written, or change its permissions"
        }
        io::ErrorKind::NotFound if action == "reading" => {
            "`graspmill verify` of the dataset explains how to restore it"
        }
        _ => remedy::for_reading(error),
    }
}

fn version_remedy(found: u32, expected: u32) -> String {
    if found > expected {
        return "get a newer graspmill".to_owned();
    }
    format!("make it again from its job with `graspmill run`, or read it with a graspmill of format {found}")
}

/// At most eight ranges of numbers, `3-7`.
fn list(numbers: &[u32]) -> String {
    let ranges = number_ranges(numbers);
    let more = if ranges.len() > 8 { ", ..." } else { "" };
    format!("{}{more}", ranges[..ranges.len().min(8)].join(", "))
}
