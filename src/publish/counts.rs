//! Counts of a manifest in words.

use super::products::pages_of;
use format::{
    Noun,
    dataset::{DatasetError, DatasetReader, Manifest},
};
use kernel::files::Folder;

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

/// Warnings of what the samples of a finished dataset show, beside those of its manifest.
///
/// # Errors
/// When a file of the dataset is missing or damaged.
pub fn warnings(folder: &Folder) -> Result<Vec<String>, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    (pages_of(reader.manifest().product).warnings)(&reader)
}

/// Lines with the counts of a finished dataset.
///
/// # Errors
/// When a file of the dataset that holds counts is missing or damaged.
pub fn counts_in_words(folder: &Folder, manifest: &Manifest) -> Result<Vec<String>, DatasetError> {
    let (product, counts) = (manifest.product, &manifest.counts);
    let samples = product.samples.of(counts.samples);
    let mut lines = Vec::new();
    match counted_parts(manifest) {
        Some(CountedParts { noun, count }) => {
            lines.push(format!("{count} {} at {} {samples}", noun.of(count), counts.samples));
        }
        None => {
            let rejects: Vec<String> =
                counts.rejected.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
            let rejects = if rejects.is_empty() { String::new() } else { format!(" ({})", rejects.join(", ")) };
            // The manifest counts objects, not scenes.
            let about = match product.subjects_are_objects {
                true => format!("{} {}", counts.objects, product.subjects.of(counts.objects)),
                false => format!("{} objects in scenes", counts.objects),
            };
            lines.push(format!(
                "{} {samples} of {about}: {} kept, {} rejected{rejects}",
                counts.samples,
                counts.kept,
                counts.samples - counts.kept
            ));
        }
    }
    lines.extend((pages_of(product).counts_in_words)(folder, manifest)?);
    Ok(lines)
}
