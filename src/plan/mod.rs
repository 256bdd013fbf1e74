//! From a job to an ordered list of work units and shards; pure, no I/O.
//!
//! Sample indices count the views of one subject after the other, in the job's order: the objects of a completion job and how
//! they are turned, the robot of a reachability job and the positions of its grid, objects and their grasps. A shard is a run of consecutive sample
//! indices; a work unit is the part of one subject's views that lies in one shard. Sample ids name the subject by content
//! and the view by its number, so shard size, threads and the other subjects change none of them.

use std::ops::Range;

use crate::{
    ids::{SampleId, SampleIndex, ShardId, UnitId, ViewId},
    job::Job,
};

mod share;
mod split;

pub use share::Share;
pub use split::{LeakReport, ModelRole, SampleRole, Sides, SplitTable};

/// What a job makes, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Index of each subject's first sample, and after the last the count of all.
    starts: Vec<u64>,
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
    /// The plan of a job: a function of the count of subjects, the count of views of each and the shard size alone.
    pub fn new(job: &Job) -> Self {
        Self::of_views((0..job.subjects()).map(|subject| job.views_of(subject)), job.shard_samples)
    }

    /// The plan for so many subjects, views a subject and samples a shard (at least 1).
    pub fn of_counts(subjects: usize, views: u32, shard_samples: u32) -> Self {
        Self::of_views(std::iter::repeat_n(views, subjects), shard_samples)
    }

    /// The plan for subjects with so many views each, some perhaps with none.
    pub fn of_views(views: impl Iterator<Item = u32>, shard_samples: u32) -> Self {
        let mut starts = vec![0];
        let mut samples = 0;
        starts.extend(views.map(|views| {
            samples += u64::from(views);
            samples
        }));
        let step = u64::from(shard_samples.max(1));
        let mut units = 0..;
        let shards = (0..samples.div_ceil(step)).map(|shard| {
            let range = shard * step..((shard + 1) * step).min(samples);
            ShardPlan { id: ShardId(shard as u32), units: units_of(&range, &starts, &mut units), samples: range }
        });
        let shards = shards.collect();
        Self { starts, samples, shards }
    }

    /// All work units, in order.
    pub fn units(&self) -> impl Iterator<Item = &WorkUnit> {
        self.shards.iter().flat_map(|shard| &shard.units)
    }

    /// The subject (its place in the job) and the view of a sample.
    pub fn locate(&self, sample: SampleIndex) -> (usize, ViewId) {
        let subject = subject_of(&self.starts, sample.0);
        (subject, ViewId((sample.0 - self.starts[subject]) as u32))
    }

    /// Views of a subject.
    ///
    /// # Panics
    /// When there are not so many subjects.
    pub fn views_of(&self, subject: usize) -> u32 {
        (self.starts[subject + 1] - self.starts[subject]) as u32
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

/// The subject whose views hold a sample: the last that begins at it or before. One without views begins where the next does.
fn subject_of(starts: &[u64], sample: u64) -> usize {
    starts[..starts.len() - 1].partition_point(|start| *start <= sample) - 1
}

/// Cuts a run of sample indices at the borders of the subjects.
fn units_of(samples: &Range<u64>, starts: &[u64], ids: &mut impl Iterator<Item = u32>) -> Vec<WorkUnit> {
    let mut units = Vec::new();
    let mut first = samples.start;
    while first < samples.end {
        let subject = subject_of(starts, first);
        let end = starts[subject + 1].min(samples.end);
        let start_view = (first - starts[subject]) as u32;
        units.push(WorkUnit {
            id: UnitId(ids.next().expect("an endless count")),
            subject,
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
        fn subjects_may_have_few_views_or_none(views in prop::collection::vec(0u32..5, 0..30), shard_samples in 1u32..20) {
            let plan = Plan::of_views(views.iter().copied(), shard_samples);
            let located: Vec<_> = (0..plan.samples).map(|index| plan.locate(SampleIndex(index))).collect();
            let expected = views.iter().enumerate().flat_map(|(subject, views)| {
                (0..*views).map(move |view| (subject, ViewId(view)))
            });
            prop_assert_eq!(&located, &expected.collect::<Vec<_>>());
            let of_units = plan.units().flat_map(|unit| unit.views.clone().map(move |view| (unit.subject, ViewId(view))));
            prop_assert_eq!(located, of_units.collect::<Vec<_>>());
            prop_assert!(views.iter().enumerate().all(|(subject, views)| plan.views_of(subject) == *views));
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
