//! Counts of a dataset as text, for a first overview.

use super::{chart::grouped, headline::of_noun, products::pages_of};
use format::{
    Noun,
    dataset::{DatasetError, DatasetReader, Manifest},
};
use kernel::files::Folder;

/// Parts of the samples of a dataset, such as poses, if users count those.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CountedParts {
    /// Singular and plural noun of the parts.
    pub noun: Noun,
    /// Number of parts in all samples.
    pub count: u64,
}

/// Parts of a dataset's samples; `None` for a product that counts whole samples.
pub fn counted_parts(manifest: &Manifest) -> Option<CountedParts> {
    let parts = pages_of(manifest.product).parts.as_ref()?;
    Some(CountedParts { noun: parts.noun, count: (parts.count)(manifest) })
}

/// Warnings from the samples of a finished dataset, in addition to those of its manifest.
///
/// # Errors
/// When a file of the dataset is missing or damaged.
pub fn warnings(folder: &Folder) -> Result<Vec<String>, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    (pages_of(reader.manifest().product).warnings)(&reader)
}

/// Lines with the counts of the finished dataset in a folder: its headline, its samples, then further counts of its product.
///
/// # Errors
/// When a file with counts is missing or damaged.
pub fn counts_in_words(folder: &Folder) -> Result<Vec<String>, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    let pages = pages_of(reader.manifest().product);
    let mut lines = vec![(pages.headline)(&reader)?, samples_in_words(reader.manifest())];
    lines.extend((pages.counts_in_words)(folder, reader.manifest())?);
    Ok(lines)
}

/// Planned samples by result.
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
