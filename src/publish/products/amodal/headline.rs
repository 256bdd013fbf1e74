//! Headline of a dataset.

use crate::{chart::grouped, headline::scenes_in_words};
use format::dataset::{DatasetError, DatasetReader};

/// Bodies in views that have a pair.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let (counts, scenes) = (&reader.manifest().counts, scenes_in_words(reader)?);
    let [pairs, bodies] = [counts.kept, counts.samples].map(grouped);
    Ok(format!("{pairs} of {bodies} bodies in views of {scenes} have a pair"))
}
