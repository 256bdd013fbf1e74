//! Headline of a dataset.

use crate::headline::of_noun;
use format::{
    Noun,
    dataset::{DatasetError, DatasetReader},
};

/// Bodies.
pub(super) const BODIES: Noun = Noun { one: "body", many: "bodies" };

/// Scenes, and the bodies in them.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let counts = &reader.manifest().counts;
    let scenes = of_noun(counts.kept, &reader.manifest().product.samples);
    Ok(format!("{scenes} with {}", of_noun(counts.fact("bodies"), &BODIES)))
}
