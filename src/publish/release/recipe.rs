//! `recipe.json`: files that a release leaves out, and how to make them again.

use serde::{Deserialize, Serialize};

use kernel::ids::{Digest, JobDigest};

/// `recipe.json`: files left out of a release.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Recipe {
    /// Root digest of the whole dataset.
    pub root: Digest,
    /// The job that makes it.
    pub job: JobDigest,
    /// Program that made it.
    pub generator: String,
    /// Files left out.
    pub left_out: Vec<LeftOutFile>,
}

/// A file left out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct LeftOutFile {
    /// Path in the dataset's folder.
    pub path: String,
    /// BLAKE3 of its content.
    pub blake3: Digest,
    /// Size [bytes].
    pub bytes: u64,
}
