//! Parts of headlines: counts with their nouns, and numbers of samples that pass a test.

use super::chart::grouped;
use format::{
    Noun,
    dataset::{DatasetError, DatasetReader, Fate, LedgerRow},
};
use kernel::words::counted;

/// A count with its noun: "1 view", "1,200 views".
pub(super) fn of_noun(count: u64, noun: &Noun) -> String {
    format!("{} {}", grouped(count), noun.for_count(count))
}

/// Headline of a product that counts samples: "29 samples of 6 objects".
pub(super) fn stored_samples(reader: &DatasetReader) -> Result<String, DatasetError> {
    let manifest = reader.manifest();
    let product = manifest.product;
    let samples = of_noun(manifest.counts.kept, &product.samples);
    Ok(format!("{samples} of {}", of_noun(manifest.counts.objects, &product.subjects)))
}

/// Number of scenes of a dataset, as text: "1 scene", "12 scenes".
///
/// # Errors
/// When the asset table is missing or damaged.
pub(super) fn scenes_in_words(reader: &DatasetReader) -> Result<String, DatasetError> {
    Ok(counted(reader.assets()?.subjects.len() as u64, "scene"))
}

/// Number of kept samples whose row of the ledger passes a test. Reads the ledgers, one at a time.
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
