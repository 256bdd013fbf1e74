//! Material of a release's documents.

use std::collections::BTreeMap;

use super::{About, assets::Asset, checksums::FileDigests, recipe::LeftOutFile};
use crate::numbers::Numbers;
use format::dataset::Manifest;

/// Material of the documents.
pub(super) struct Release<'a> {
    pub about: &'a About,
    pub manifest: &'a Manifest,
    pub assets: &'a [Asset],
    pub numbers: &'a Numbers,
    /// Files written before the documents, by path.
    pub files: &'a BTreeMap<String, FileDigests>,
    pub left_out: &'a [LeftOutFile],
    /// Paths and captions.
    pub pictures: &'a [(String, String)],
    /// Keys of the job with paths outside the folder: the first path, and the number of further ones.
    pub outside: BTreeMap<String, (String, usize)>,
}
