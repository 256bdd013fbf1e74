//! Whether a dataset is what its manifest says; which shard, chunk and sample is not, and how to mend it.

mod shards;
mod tables;

use std::{fmt, path::Path};

use super::{
    DatasetError, DatasetReader, Ledger, Manifest, NumberClass,
    error::REWRITE,
    finish::{Objects, asset_names, asset_tree},
    layout::{ASSETS, MANIFEST, has_splits},
    roots::{ClassChannels, Leaf, Roots},
};
use crate::{
    ids::{Digest, Product, ShardId},
    record::Channel,
};
use shards::{Context, check_shards};
use tables::{AssetRows, RowChecks};

/// How much to check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VerifyLevel {
    /// Digests of all files, ledgers, counts and the root: about 2 GB/s.
    Hashes,
    /// Every chunk's CRC, every payload's digest, fields, ranges and identity as well.
    Full,
}

/// What to check and with how many threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VerifyOptions {
    /// How much.
    pub level: VerifyLevel,
    /// The job's truth makes `partial` a part of `complete` (any overlap): check that it is.
    pub partial_inside_complete: bool,
    /// Threads, at least 1.
    pub threads: usize,
}

/// How far a verification is.
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
    /// Where in the file: chunk, sample, channel; empty for the file as a whole.
    pub place: String,
    /// What is wrong, with numbers.
    pub what: String,
    /// How to mend it.
    pub remedy: &'static str,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, place, what, remedy, .. } = self;
        if place.is_empty() {
            write!(f, "{file}: {what}; {remedy}")
        } else {
            write!(f, "{file}: {place}: {what}; {remedy}")
        }
    }
}

/// What a verification found.
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyReport {
    /// What the dataset holds.
    pub product: Product,
    /// Root digest in the manifest.
    pub saved: Digest,
    /// Root digest out of the ledgers and tables; `None` when one of them can't be read.
    pub calculated: Option<Digest>,
    /// What was looked at.
    pub checked: VerifyProgress,
    /// Payloads whose digest and fields were checked (level [`VerifyLevel::Full`]).
    pub payloads: u64,
    /// Shards without a problem.
    pub intact_shards: u32,
    /// Everything that is wrong, in order of files and places; at most [`VerifyReport::MOST`] a shard.
    pub problems: Vec<Problem>,
    /// Things that are no damage: leftovers of killed runs, files set aside.
    pub notes: Vec<String>,
}

impl VerifyReport {
    /// Problems listed of one shard; a count of the others follows.
    pub const MOST: usize = 20;

    /// Nothing is wrong.
    pub fn is_intact(&self) -> bool {
        self.problems.is_empty()
    }
}

/// Checks a finished dataset; damage is in the report, not an error. Memory: a chunk a thread, 64 bytes a sample and
/// class.
///
/// # Errors
/// When there is no readable manifest, or the operating system refuses to list the folder.
pub fn verify(
    folder: &Path,
    options: VerifyOptions,
    mut progress: impl FnMut(&VerifyProgress),
) -> Result<VerifyReport, DatasetError> {
    let manifest = Manifest::read(folder)?;
    let mut problems = tables::check_files(folder, &manifest);
    tables::check_mark(folder, &manifest, &mut problems);
    let reader = match DatasetReader::open(folder) {
        Ok(reader) => Some(reader),
        Err(error) => {
            let table = !problems.iter().any(|problem| problem.file.ends_with(".parquet"));
            if table {
                problems.push(whole("index.parquet", error.to_string(), REWRITE));
            }
            None
        }
    };
    let assets = tables::read_assets(folder);
    let ranks = assets.as_ref().ok().and_then(|rows| asset_names(folder, &rows.objects).ok());
    if let Err(what) = &assets {
        problems.push(whole(ASSETS, what.clone(), REWRITE));
    }
    let mut notes = Vec::new();
    tables::check_foreign(folder, &manifest, &mut problems, &mut notes)?;
    tables::check_preview(folder, &mut notes);
    let splits = reader.as_ref().map(DatasetReader::splits).filter(|_| has_splits(manifest.product));
    if let (Some(splits), Ok(assets)) = (splits, &assets) {
        tables::check_splits(splits, assets, &manifest, &mut problems, &mut notes);
    }
    let context = Context { folder, manifest: &manifest, reader: reader.as_ref(), options };
    let of_shards = manifest.shards.len() as u32;
    let mut checked = VerifyProgress { of_shards, ..VerifyProgress::default() };
    let shards = check_shards(&context, |shard| {
        checked.shards += 1;
        checked.samples += shard.samples;
        checked.bytes += shard.bytes;
        progress(&checked);
    });
    let mut leaves = ranks.as_ref().map(|_| Vec::with_capacity(manifest.foreseen()));
    let (mut payloads, mut intact_shards) = (0, 0);
    let mut rows = ranks.as_ref().map(|ranks| RowChecks::open(folder, &manifest, ranks, splits, &mut problems));
    for shard in shards {
        if let Some(rows) = &mut rows {
            rows.shard(shard.ledger.as_ref(), shard.samples);
        }
        payloads += shard.payloads;
        intact_shards += u32::from(shard.problems.is_empty());
        problems.extend(shard.problems);
        leaves = match (leaves, shard.ledger, &ranks) {
            (Some(leaves), Some(ledger), Some(ranks)) => {
                let more = with_leaves_of(leaves, &ledger, &manifest, ranks);
                if more.is_none() {
                    let what = format!("shard {} has samples of objects that it does not list", ledger.shard.0);
                    problems.push(whole(ASSETS, what, REWRITE));
                }
                more
            }
            _ => None,
        };
    }
    if let (Some(rows), Ok(assets)) = (rows, &assets) {
        problems.extend(rows.finish(assets));
    }
    let field = tables::check_field(&context, intact_shards, &mut problems);
    if let (Product::Grasps, VerifyLevel::Full, Ok(rows)) = (manifest.product, options.level, &assets) {
        tables::check_shapes(folder, rows, &mut problems);
    }
    let calculated = match (leaves, &ranks, &assets, field) {
        (Some(leaves), Some(ranks), Ok(assets), Ok(field)) => {
            check_root(&manifest, leaves, ranks, assets, field.as_ref(), &mut problems)
        }
        _ => None,
    };
    if calculated.is_none() && problems.is_empty() {
        let what = "its root cannot be calculated: a table names an object twice, or has none of a sample";
        problems.push(whole(ASSETS, what.to_owned(), REWRITE));
    }
    let product = manifest.product;
    Ok(VerifyReport { product, saved: manifest.root, calculated, checked, payloads, intact_shards, problems, notes })
}

/// The roots out of the ledgers' rows, against the manifest's; `None` where a sample stands twice.
fn check_root(
    manifest: &Manifest,
    leaves: Vec<Leaf>,
    ranks: &Objects,
    assets: &AssetRows,
    field: Option<&Digest>,
    problems: &mut Vec<Problem>,
) -> Option<Digest> {
    match Roots::new(leaves, &classes_of(&manifest.channels(), manifest), ranks) {
        Ok(roots) => {
            let assets = asset_tree(assets.objects.iter().chain(&assets.hands));
            let root = roots.dataset(&assets, field, &manifest.job);
            compare_roots(manifest, &roots, &root, problems);
            Some(root)
        }
        Err(error) => {
            problems.push(whole(MANIFEST, error.to_string(), REWRITE));
            None
        }
    }
}

/// The class of each of a ledger's channels, as the manifest says it.
fn classes_of(channels: &[Channel], manifest: &Manifest) -> ClassChannels {
    let main = manifest.class_of(Channel::leading(manifest.product)).unwrap_or(NumberClass::Exact);
    ClassChannels::new(channels, main, |channel| manifest.class_of(channel).unwrap_or(main))
}

/// Takes the rows of a ledger; `None` when one's object is unknown.
fn with_leaves_of(mut leaves: Vec<Leaf>, ledger: &Ledger, manifest: &Manifest, ranks: &Objects) -> Option<Vec<Leaf>> {
    let channels = classes_of(&ledger.channels, manifest);
    for row in &ledger.rows {
        let (rank, _, _) = ranks.get(&row.sample.subject)?;
        leaves.extend(Leaf::of_row(*rank, row, &channels));
    }
    Some(leaves)
}

/// The root over all, and that of each class.
fn compare_roots(manifest: &Manifest, roots: &Roots, root: &Digest, problems: &mut Vec<Problem>) {
    let mut compare = |what: &str, saved: &Digest, calculated: Option<&Digest>| {
        if calculated != Some(saved) {
            let calculated = calculated.map_or_else(|| "none".to_owned(), Digest::short);
            let what = format!("{what}: saved {}, calculated {calculated}", saved.short());
            problems.push(whole(MANIFEST, what, REWRITE));
        }
    };
    compare("root digest", &manifest.root, Some(root));
    for (class, saved) in &manifest.classes {
        compare(&format!("digest of class {}", class.name()), saved, roots.classes.get(class));
    }
}

fn whole(file: &str, what: String, remedy: &'static str) -> Problem {
    Problem { file: file.to_owned(), shard: None, place: String::new(), what, remedy }
}
