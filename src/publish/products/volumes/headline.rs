//! Headline of a dataset.

use crate::{
    chart::grouped,
    headline::{of_noun, scenes_in_words},
};
use format::{
    Channel, Noun,
    dataset::{DatasetError, DatasetReader},
};

/// Volumes with their images, and the outcomes of trials of the grasps in them.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let (manifest, scenes) = (reader.manifest(), scenes_in_words(reader)?);
    let counts = &manifest.counts;
    let volumes = of_noun(counts.kept, &manifest.product.samples);
    let images = of_noun(counts.fact("images"), &Noun { one: "image", many: "images" });
    let fused = format!("{volumes} fused from {images} of {scenes}");
    let has_grasps = manifest.channels().contains(&Channel::VOLUME_AFFORDANCE);
    let [held, failed, untried] = ["held", "failed", "untried"].map(|state| grouped(counts.fact(state)));
    let grasps = format!("; of the free grasps in them {held} held, {failed} failed and {untried} are untried");
    Ok(if has_grasps { fused + &grasps } else { fused })
}
