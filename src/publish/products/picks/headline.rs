//! Headline of a dataset.

use crate::{chart::grouped, headline::count_kept};
use format::{
    Channel, PickFacts, PickVerdict,
    dataset::{Counts, DatasetError, DatasetReader},
};

/// Bodies with a free grasp, and the trials that held.
pub(super) fn headline(reader: &DatasetReader) -> Result<String, DatasetError> {
    let manifest = reader.manifest();
    let counts = &manifest.counts;
    let with_free = count_kept(reader, |row| PickFacts::from(&row.facts).free > 0)?;
    let [with_free, bodies] = [with_free, counts.kept].map(grouped);
    let [free, candidates] = ["free", "candidates"].map(|fact| grouped(counts.fact(fact)));
    let [held, tried] = [counts.fact(PickVerdict::Held.name()), tried(counts)].map(grouped);
    Ok(match manifest.channels().contains(&Channel::PICK_TRIALS) {
        true => format!("{with_free} of {bodies} bodies have a free grasp; {held} of {tried} trials held"),
        false => {
            format!("{with_free} of {bodies} bodies have a free grasp; {free} of {candidates} grasps are free")
        }
    })
}

/// Trials of every verdict.
fn tried(counts: &Counts) -> u64 {
    PickVerdict::ALL.iter().map(|verdict| counts.fact(verdict.name())).sum()
}
