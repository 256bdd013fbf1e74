//! Names of the files in a dataset's folder.

use crate::Product;
use kernel::ids::{Digest, ShardId};

/// Mark of the job that the folder belongs to; written first.
pub const RUN: &str = "run.json";
/// Manifest of its content; written last.
pub const MANIFEST: &str = "manifest.json";
/// Table of a set of datasets, in the folder above theirs.
pub const SET: &str = "set.json";
/// One row per sample.
pub const INDEX: &str = "index.parquet";
/// One row per object, and the refused meshes.
pub const ASSETS: &str = "assets.json";
/// Splits into training, validation and test.
pub const SPLITS: &str = "splits.json";
/// One line per rejected sample.
pub const REJECTS: &str = "rejects.jsonl";
/// The resolved job.
pub const JOB: &str = "job.toml";
/// Record of tasks for the merge that closes the dataset; gone when it is closed.
pub const PENDING: &str = "pending.json";
/// Scripts and logs of a cluster's tasks; not part of the dataset.
pub const CLUSTER: &str = "cluster";

/// A few samples, or a map, for viewers; not part of the dataset.
pub const PREVIEW: &str = "preview.mcap";
/// Report page of a dataset or of a set; not part of either.
pub const REPORT: &str = "report.html";

/// The files of a finished dataset in addition to run mark, manifest and shards, sorted by name.
pub(crate) fn files_of(product: Product) -> Vec<&'static str> {
    let mut files = vec![ASSETS, INDEX, JOB, REJECTS];
    files.extend(product.has_splits.then_some(SPLITS));
    files.extend(product.files.iter().map(|file| file.name));
    files.sort_unstable();
    files
}

/// Folder of the shards.
pub const SHARDS: &str = "shards";

/// A shard's file name: `completion-00003-of-00152-<16 hex digits of its BLAKE3>.mcap`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ShardName {
    /// Product of its samples.
    pub product: Product,
    /// Which shard.
    pub shard: ShardId,
    /// Number of shards in all.
    pub shards: u32,
    /// First 16 hexadecimal digits of the BLAKE3 of the content.
    pub short: String,
}

impl ShardName {
    /// The name of a shard with this content.
    pub fn new(product: Product, shard: ShardId, shards: u32, digest: &Digest) -> Self {
        Self { product, shard, shards, short: digest.short() }
    }

    /// Reads a file name; `None` for any other.
    pub fn parse(name: &str) -> Option<Self> {
        let stem = name.strip_suffix(".mcap")?;
        let (rest, short) = stem.rsplit_once('-')?;
        let (rest, shards) = rest.rsplit_once("-of-")?;
        let (product, shard) = rest.rsplit_once('-')?;
        let number =
            |text: &str| (text.len() >= 5 && text.bytes().all(|byte| byte.is_ascii_digit())).then(|| text.parse());
        let parsed = Self {
            product: Product::from_name(product)?,
            shard: ShardId(number(shard)?.ok()?),
            shards: number(shards)?.ok()?,
            short: short.to_owned(),
        };
        // Only one spelling is allowed, so that a shard has a single name.
        (short.len() == 16 && parsed.to_string() == name && parsed.shard.0 < parsed.shards).then_some(parsed)
    }

    /// The part of a shard's name that is known before its content.
    pub fn stem(product: Product, shard: ShardId, shards: u32) -> String {
        format!("{product}-{:05}-of-{shards:05}", shard.0)
    }
}

impl std::fmt::Display for ShardName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}.mcap", Self::stem(self.product, self.shard, self.shards), self.short)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_reads_back_and_nothing_else_does() {
        let name =
            ShardName::new(Product::from_name("completion").expect("a product"), ShardId(3), 152, &Digest::hash(b"x"));
        assert_eq!(ShardName::parse(&name.to_string()), Some(name.clone()));
        for wrong in [
            "completion-3-of-152-0123456789abcdef.mcap",
            "completion-00152-of-00152-0123456789abcdef.mcap",
            "a.mcap",
            "other-00003-of-00152-0123456789abcdef.mcap",
        ] {
            assert_eq!(ShardName::parse(wrong), None, "{wrong}");
        }
        assert_eq!(ShardName::parse(&format!("{name}.tmp")), None);
    }
}
