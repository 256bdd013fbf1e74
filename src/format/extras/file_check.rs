//! Checks of files that only some products have.

use crate::storage::{DatasetError, DatasetReader, Manifest};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId},
};

/// Check of a file that only the datasets of some products have: one row of the table of extra files.
pub struct FileCheck {
    /// Name inside the dataset's folder.
    pub name: &'static str,
    /// Word and digest by which the file's content enters the root digest; `None` when the root does not depend on it.
    pub in_root: Option<RootPart>,
    /// Checks the file against the rest of the dataset; every problem in words.
    pub check: fn(&FileContext<'_>) -> Vec<String>,
}

/// Part of a root digest that covers a file.
pub struct RootPart {
    /// Word before the digest.
    pub word: &'static str,
    /// Digest of the content of a dataset's file.
    pub digest: fn(&Folder) -> Result<Digest, DatasetError>,
}

/// The dataset around a file that is checked.
pub struct FileContext<'a> {
    /// Folder of the dataset.
    pub folder: &'a Folder,
    /// Manifest of the dataset.
    pub manifest: &'a Manifest,
    /// Reader of the dataset; `None` when it cannot be opened.
    pub reader: Option<&'a DatasetReader>,
    /// Ids of the objects in the asset table.
    pub objects: &'a [ObjectId],
    /// Ids of the hands in the asset table.
    pub hands: &'a [ObjectId],
    /// Whether every shard matches the manifest; otherwise nothing can be compared with the samples.
    pub shards_intact: bool,
    /// Whether contents are to be checked, not only digests.
    pub full: bool,
}
