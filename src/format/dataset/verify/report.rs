//! Extent of a verification, and its findings.

use std::fmt;

use crate::{Product, storage::IndexFormat};
use kernel::ids::{Digest, ShardId};

/// Level of detail of a verification.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerifyLevel {
    /// Digests of all files, ledgers, counts and the root: about 2 GB/s.
    Hashes,
    /// Every chunk's CRC, every payload's digest, fields, ranges and identity as well.
    Full,
}

/// Extent of a verification.
#[derive(Clone, Copy)]
pub struct VerifyOptions<'a> {
    /// Level of detail.
    pub level: VerifyLevel,
    /// Rules that the dataset's job makes its records obey.
    pub rules: &'a [&'static str],
    /// Format of the index, to compare its file with the ledgers; `None` checks only its digest.
    pub index: Option<&'a dyn IndexFormat>,
    /// Threads, at least 1.
    pub threads: usize,
}

/// Progress of a verification.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VerifyProgress {
    /// Shards checked.
    pub shards: u32,
    /// Shards in all.
    pub of_shards: u32,
    /// Sample indices checked.
    pub samples: u64,
    /// Bytes of shards read.
    pub bytes: u64,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Path inside the dataset's folder.
    pub file: String,
    /// Which shard, when it is one.
    pub shard: Option<ShardId>,
    /// Location in the file: chunk, sample, channel; empty for the file as a whole.
    pub location: String,
    /// The problem in words, with numbers.
    pub what: String,
    /// The remedy.
    pub remedy: &'static str,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, location, what, remedy, .. } = self;
        if location.is_empty() {
            write!(f, "{file}: {what}; {remedy}")
        } else {
            write!(f, "{file}: {location}: {what}; {remedy}")
        }
    }
}

/// Findings of a verification.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyReport {
    /// Product of the dataset.
    pub product: Product,
    /// Root digest in the manifest.
    pub saved: Digest,
    /// Root digest from the ledgers and tables; `None` when one of them can't be read.
    pub calculated: Option<Digest>,
    /// Shards, samples and bytes that were checked.
    pub checked: VerifyProgress,
    /// Payloads whose digest and fields were checked (level [`VerifyLevel::Full`]).
    pub payloads: u64,
    /// Shards without a problem.
    pub intact_shards: u32,
    /// Everything that is wrong, in order of files and locations; at most [`VerifyReport::MAX`] per shard.
    pub problems: Vec<Problem>,
    /// Notes that are not damage: leftovers of killed runs, files set aside.
    pub notes: Vec<String>,
}

impl VerifyReport {
    /// Problems listed of one shard; a count of the others follows.
    pub const MAX: usize = 20;

    /// Nothing is wrong.
    pub fn is_intact(&self) -> bool {
        self.problems.is_empty()
    }
}

/// A problem of a file as a whole.
pub(super) fn whole(file: &str, what: String, remedy: &'static str) -> Problem {
    Problem { file: file.to_owned(), shard: None, location: String::new(), what, remedy }
}
