//! Headline of a dataset.

use crate::{
    chart::grouped,
    headline::{of_noun, scenes_in_words},
};
use format::dataset::{DatasetError, DatasetReader};

/// Views, and the visible bodies in them.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let (manifest, scenes) = (reader.manifest(), scenes_in_words(reader)?);
    let views = of_noun(manifest.counts.kept, &manifest.product.samples);
    let bodies = manifest.counts.fact("bodies");
    let [seen, bodies] = [bodies.saturating_sub(manifest.counts.fact("unseen")), bodies].map(grouped);
    Ok(format!("{views} of {scenes}; {seen} of {bodies} bodies in them are visible"))
}
