//! From a job to an ordered list of work units and shards; pure, no I/O.
//!
//! Sample index = place of the subject in the job * count of views + view: the objects of a completion job and how they
//! are turned, or the robot of a reachability job and the positions of its grid. A shard is a run of consecutive sample
//! indices; a work unit is the part of one subject's views that lies in one shard. Sample ids name the subject by content
//! and the view by its number, so shard size, threads and the other subjects change none of them.

use std::ops::Range;

use crate::{
    ids::{SampleId, SampleIndex, ShardId, UnitId, ViewId},
    job::Job,
};

mod split;

pub use split::{LeakReport, ModelRole, SampleRole, Sides, SplitTable};

/// What a job makes, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Views of each subject.
    pub views: u32,
    /// Samples in all, kept and rejected.
    pub samples: u64,
    /// The shards, in the order of their samples.
    pub shards: Vec<ShardPlan>,
}

/// One shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardPlan {
    /// Its place in the plan.
    pub id: ShardId,
    /// The sample indices that it holds.
    pub samples: Range<u64>,
    /// Its work, in the order of the samples.
    pub units: Vec<WorkUnit>,
}

/// A run of views of one subject inside one shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkUnit {
    /// Its place in the plan, counted over all shards.
    pub id: UnitId,
    /// Place of the subject in the job.
    pub subject: usize,
    /// The views.
    pub views: Range<u32>,
    /// Index of the first view's sample.
    pub first: SampleIndex,
}

impl Plan {
    /// The plan of a job: a function of the count of subjects, the count of views and the shard size alone.
    pub fn new(job: &Job) -> Self {
        Self::of_counts(job.subjects(), job.views(), job.shard_samples)
    }

    /// The plan for so many subjects, views a subject and samples a shard (at least 1).
    pub fn of_counts(subjects: usize, views: u32, shard_samples: u32) -> Self {
        let samples = subjects as u64 * u64::from(views);
        let step = u64::from(shard_samples.max(1));
        let mut units = 0..;
        let shards = (0..samples.div_ceil(step)).map(|shard| {
            let range = shard * step..((shard + 1) * step).min(samples);
            ShardPlan { id: ShardId(shard as u32), units: units_of(&range, views, &mut units), samples: range }
        });
        Self { views, samples, shards: shards.collect() }
    }

    /// All work units, in order.
    pub fn units(&self) -> impl Iterator<Item = &WorkUnit> {
        self.shards.iter().flat_map(|shard| &shard.units)
    }

    /// The subject (its place in the job) and the view of a sample.
    pub fn locate(&self, sample: SampleIndex) -> (usize, ViewId) {
        let views = u64::from(self.views);
        ((sample.0 / views) as usize, ViewId((sample.0 % views) as u32))
    }

    /// The shard that holds a sample; `None` past the end.
    pub fn shard_of(&self, sample: SampleIndex) -> Option<&ShardPlan> {
        let step = self.shards.first()?.samples.end;
        let shard = self.shards.get(usize::try_from(sample.0 / step).ok()?)?;
        shard.samples.contains(&sample.0).then_some(shard)
    }

    /// The name of a sample of this job.
    pub fn sample_id(&self, job: &Job, sample: SampleIndex) -> SampleId {
        let (subject, view) = self.locate(sample);
        SampleId::of_object(job.subject(subject), view)
    }
}

/// Cuts a run of sample indices at the borders of the subjects.
fn units_of(samples: &Range<u64>, views: u32, ids: &mut impl Iterator<Item = u32>) -> Vec<WorkUnit> {
    let per_subject = u64::from(views);
    let mut units = Vec::new();
    let mut first = samples.start;
    while first < samples.end {
        let subject = first / per_subject;
        let end = ((subject + 1) * per_subject).min(samples.end);
        let start_view = (first % per_subject) as u32;
        units.push(WorkUnit {
            id: UnitId(ids.next().expect("an endless count")),
            subject: subject as usize,
            views: start_view..start_view + (end - first) as u32,
            first: SampleIndex(first),
        });
        first = end;
    }
    units
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn every_sample_stands_in_one_unit_once_and_in_order(
            objects in 0usize..40, views in 1u32..30, shard_samples in 1u32..200,
        ) {
            let plan = Plan::of_counts(objects, views, shard_samples);
            let mut next = 0;
            for (place, shard) in plan.shards.iter().enumerate() {
                prop_assert_eq!(shard.id, ShardId(place as u32));
                prop_assert_eq!(shard.samples.start, next);
                prop_assert!(shard.samples.end - shard.samples.start <= u64::from(shard_samples));
                for unit in &shard.units {
                    prop_assert_eq!(unit.first, SampleIndex(next));
                    prop_assert!(!unit.views.is_empty() && unit.views.end <= views);
                    for view in unit.views.clone() {
                        prop_assert_eq!(plan.locate(SampleIndex(next)), (unit.subject, ViewId(view)));
                        prop_assert_eq!(plan.shard_of(SampleIndex(next)).map(|found| found.id), Some(shard.id));
                        next += 1;
                    }
                }
                prop_assert_eq!(shard.samples.end, next);
            }
            prop_assert_eq!(next, plan.samples);
            prop_assert_eq!(next, objects as u64 * u64::from(views));
            prop_assert!(plan.shard_of(SampleIndex(next)).is_none());
            prop_assert!(plan.units().enumerate().all(|(place, unit)| unit.id == UnitId(place as u32)));
        }

        #[test]
        fn the_shard_size_moves_no_sample(views in 1u32..30, a in 1u32..200, b in 1u32..200) {
            let (first, second) = (Plan::of_counts(17, views, a), Plan::of_counts(17, views, b));
            for sample in (0..first.samples).map(SampleIndex) {
                prop_assert_eq!(first.locate(sample), second.locate(sample));
            }
        }
    }
}
