//! Counts of a dataset in words, what its user wants to know first.

use super::{chart::grouped, products::pages_of};
use format::{
    Noun,
    dataset::{DatasetError, DatasetReader, Fate, LedgerRow, Manifest},
};
use std::path::Path;

/// Parts that the samples of a dataset consist of, such as poses, where people count those.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CountedParts {
    /// Noun of one part and of several.
    pub noun: Noun,
    /// Parts of all samples.
    pub count: u64,
}

/// The parts of a dataset's samples; `None` for a product whose samples are counted whole.
pub fn counted_parts(manifest: &Manifest) -> Option<CountedParts> {
    let parts = pages_of(manifest.product).parts.as_ref()?;
    Some(CountedParts { noun: parts.noun, count: (parts.count)(manifest) })
}

/// Lines with the counts of the finished dataset in a folder: its headline, its samples, then what its product counts besides.
///
/// # Errors
/// When a file of the dataset that holds counts is missing or damaged.
pub fn counts_in_words(folder: &Path) -> Result<Vec<String>, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    let pages = pages_of(reader.manifest().product);
    let mut lines = vec![(pages.headline)(&reader)?, samples_in_words(reader.manifest())];
    lines.extend((pages.counts_in_words)(folder, reader.manifest())?);
    Ok(lines)
}

/// Samples of the plan, and what became of them.
fn samples_in_words(manifest: &Manifest) -> String {
    let counts = &manifest.counts;
    let rejects: Vec<String> =
        counts.rejected.iter().map(|(reason, count)| format!("{} {reason}", grouped(*count))).collect();
    let rejects = if rejects.is_empty() { String::new() } else { format!(" ({})", rejects.join(", ")) };
    format!(
        "{}: {} kept, {} rejected{rejects}",
        of_noun(counts.samples, &manifest.product.samples),
        grouped(counts.kept),
        grouped(counts.samples - counts.kept)
    )
}

/// A count with its noun: "1 view", "1,200 views".
pub(super) fn of_noun(count: u64, noun: &Noun) -> String {
    format!("{} {}", grouped(count), noun.of(count))
}

/// Headline of a product whose samples speak for themselves: "29 samples of 6 objects".
pub(super) fn stored_samples(reader: &DatasetReader) -> Result<String, DatasetError> {
    let manifest = reader.manifest();
    let product = manifest.product;
    let samples = of_noun(manifest.counts.kept, &product.samples);
    Ok(format!("{samples} of {}", of_noun(manifest.counts.objects, &product.subjects)))
}

/// Scenes that the samples of a dataset show: "1 scene", "12 scenes".
///
/// # Errors
/// When the asset table is missing or damaged.
pub(super) fn scenes_in_words(reader: &DatasetReader) -> Result<String, DatasetError> {
    Ok(of_noun(reader.assets()?.subjects.len() as u64, &Noun { one: "scene", many: "scenes" }))
}

/// Count of the kept samples whose row of the ledger passes. Reads the ledgers, one at a time.
///
/// # Errors
/// When a shard is missing or damaged.
pub(super) fn count_kept(reader: &DatasetReader, passes: impl Fn(&LedgerRow) -> bool) -> Result<u64, DatasetError> {
    let mut count = 0;
    for shard in 0..reader.manifest().shards.len() {
        let rows = reader.ledger(shard)?.rows;
        count += rows.iter().filter(|row| matches!(row.fate, Fate::Kept(_)) && passes(row)).count() as u64;
    }
    Ok(count)
}
