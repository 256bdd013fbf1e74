//! Headline of a dataset.

use crate::{chart::grouped, headline::count_kept};
use format::{
    HeatmapFacts,
    dataset::{DatasetError, DatasetReader},
};

/// Images with a free grasp, and the outcomes of trials of these grasps.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let counts = &reader.manifest().counts;
    let with_grasps = count_kept(reader, |row| HeatmapFacts::from(&row.facts).grasps() > 0)?;
    let images = format!("{} of {} images have a free grasp", grouped(with_grasps), grouped(counts.kept));
    let [held, failed, untried] = ["held", "failed", "untried"].map(|state| grouped(counts.fact(state)));
    Ok(format!("{images}; of the free grasps {held} held, {failed} failed and {untried} are untried"))
}
