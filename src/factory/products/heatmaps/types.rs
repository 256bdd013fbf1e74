//! Types of the grasps of a dataset of picks.

use std::collections::BTreeMap;

use crate::products::picked::{BodyPicks, PickedHand};
use format::{
    HeatmapLabel, PickCandidates, PickState, PickTrials,
    dataset::{DatasetError, DatasetReader, Selection},
};
use kernel::words::GraspTypeCounts;

/// Counts the good grasps of a dataset by type, and chooses up to this number of the most common types: good are the
/// free grasps, with labels of trials those that held. One chunk of a shard is in memory at a time.
///
/// # Errors
/// When a shard is missing or damaged.
pub fn count_types(
    picks: &DatasetReader,
    hand: &PickedHand,
    label: HeatmapLabel,
    types: u32,
) -> Result<GraspTypeCounts, DatasetError> {
    let (mut counts, mut without) = (BTreeMap::new(), 0);
    for sample in picks.iter(Selection::default()) {
        let sample = sample?;
        let (candidates, trials) = (sample.read::<PickCandidates>()?, sample.find::<PickTrials>()?);
        let body = BodyPicks { body: candidates.body(), candidates, trials };
        for (candidate, state) in body.candidates.candidates.iter().zip(body.states()) {
            if !candidate.is_free() || label == HeatmapLabel::Trial && state != PickState::Held {
                continue;
            }
            match hand.kind(candidate) {
                Some(kind) => *counts.entry(kind).or_default() += 1,
                None => without += 1,
            }
        }
    }
    Ok(GraspTypeCounts::choose(counts, without, types))
}
