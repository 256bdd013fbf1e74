//! From a job to an ordered list of work units and shards; pure, no I/O.
//!
//! Sample indices count the samples of one subject after the other, in the job's order: views of objects, positions of
//! a robot's grid, search runs, grasps. An item makes one sample or, in scenes, one per body and camera. A shard is a
//! run of consecutive sample indices that ends where an item ends; a work unit is the part of one subject's items that
//! is in one shard. Sample ids name the subject by content and the item by its number, so shard size, threads and the
//! other subjects change none of them.

use std::ops::Range;

use kernel::ids::{ItemId, SampleIndex, ShardId, UnitId};

mod share;
mod split;
mod subject;

pub use share::Share;
pub use split::{JobSplits, LeakReport};
pub use subject::SubjectItems;

/// Everything that a job makes, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Index of each subject's first sample, and after the last the count of all.
    starts: Vec<u64>,
    /// Samples per item of each subject.
    samples_per_item: Vec<u32>,
    /// Samples in all, kept and rejected.
    pub samples: u64,
    /// The shards, in the order of their samples.
    pub shards: Vec<ShardPlan>,
}

/// One shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShardPlan {
    /// Index of the shard.
    pub id: ShardId,
    /// Sample indices of the shard.
    pub samples: Range<u64>,
    /// Work of the shard, in the order of the samples.
    pub units: Vec<WorkUnit>,
}

/// Consecutive items of one subject inside one shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkUnit {
    /// Index of the unit, counted over all shards.
    pub id: UnitId,
    /// Index of the subject in the job.
    pub subject: usize,
    /// The items.
    pub items: Range<u32>,
    /// Samples per item.
    pub samples_per_item: u32,
    /// Index of the first item's first sample.
    pub first: SampleIndex,
}

impl Plan {
    /// The plan for the subjects of a job: a function of their counts of items and samples and of the shard size alone.
    pub fn new(subjects: &[SubjectItems], shard_samples: u32) -> Self {
        Self::of_counts(subjects.iter().map(|subject| (subject.items, subject.samples_per_item)), shard_samples)
    }

    /// The plan for subjects with these numbers of items and of samples per item, and for shards with this largest
    /// number of samples (but at least one item).
    pub fn of_counts(subjects: impl IntoIterator<Item = (u32, u32)>, shard_samples: u32) -> Self {
        let (mut starts, mut samples_per_item) = (vec![0], Vec::new());
        let (mut shards, mut shard) = (Vec::new(), ShardDraft::default());
        let mut samples = 0;
        for (subject, (items, each)) in subjects.into_iter().enumerate() {
            let each = each.max(1);
            let mut next = 0;
            while next < items {
                let room = (shard_samples.max(1) - shard.samples.min(shard_samples)) / each;
                let taken = room.max(u32::from(shard.samples == 0)).min(items - next);
                if taken == 0 {
                    shard.close(&mut shards);
                    continue;
                }
                shard.add(subject, next..next + taken, each, samples);
                samples += u64::from(taken) * u64::from(each);
                next += taken;
            }
            starts.push(samples);
            samples_per_item.push(each);
        }
        shard.close(&mut shards);
        Self { starts, samples_per_item, samples, shards }
    }

    /// All work units, in order.
    pub fn units(&self) -> impl Iterator<Item = &WorkUnit> {
        self.shards.iter().flat_map(|shard| &shard.units)
    }

    /// The subject (its index in the job) and the item of a sample.
    pub fn locate(&self, sample: SampleIndex) -> (usize, ItemId) {
        // The last subject that begins at the sample or before; one without items begins where the next does.
        let subject = self.starts[..self.starts.len() - 1].partition_point(|start| *start <= sample.0) - 1;
        let offset = sample.0 - self.starts[subject];
        (subject, ItemId((offset / u64::from(self.samples_per_item[subject])) as u32))
    }

    /// Items of a subject.
    ///
    /// # Panics
    /// When there are fewer subjects.
    pub fn items_of(&self, subject: usize) -> u32 {
        let samples = self.starts[subject + 1] - self.starts[subject];
        (samples / u64::from(self.samples_per_item[subject])) as u32
    }

    /// The shard that accounts for a sample; `None` past the end.
    pub fn shard_of(&self, sample: SampleIndex) -> Option<&ShardPlan> {
        let index = self.shards.partition_point(|shard| shard.samples.end <= sample.0);
        self.shards.get(index)
    }
}

/// A shard that is being filled.
#[derive(Default)]
struct ShardDraft {
    units: Vec<WorkUnit>,
    samples: u32,
    next_unit: u32,
}

impl ShardDraft {
    fn add(&mut self, subject: usize, items: Range<u32>, samples_per_item: u32, first: u64) {
        self.samples += items.len() as u32 * samples_per_item;
        let (id, first) = (UnitId(self.next_unit), SampleIndex(first));
        self.units.push(WorkUnit { id, subject, items, samples_per_item, first });
        self.next_unit += 1;
    }

    /// Adds the shard to the others, unless it is empty.
    fn close(&mut self, shards: &mut Vec<ShardPlan>) {
        let Some(first) = self.units.first().map(|unit| unit.first.0) else { return };
        let samples = first..first + u64::from(self.samples);
        let units = std::mem::take(&mut self.units);
        shards.push(ShardPlan { id: ShardId(shards.len() as u32), samples, units });
        self.samples = 0;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn uniform(subjects: usize, items: u32, shard_samples: u32) -> Plan {
        Plan::of_counts(std::iter::repeat_n((items, 1), subjects), shard_samples)
    }

    proptest! {
        #[test]
        fn every_sample_stands_in_one_unit_once_and_in_order(
            objects in 0usize..40, views in 1u32..30, each in 1u32..6, shard_samples in 1u32..200,
        ) {
            let plan = Plan::of_counts(std::iter::repeat_n((views, each), objects), shard_samples);
            let mut next = 0;
            for (index, shard) in plan.shards.iter().enumerate() {
                prop_assert_eq!(shard.id, ShardId(index as u32));
                prop_assert_eq!(shard.samples.start, next);
                let size = shard.samples.end - shard.samples.start;
                prop_assert!(size <= u64::from(shard_samples.max(each)) && size > 0);
                for unit in &shard.units {
                    prop_assert_eq!(unit.first, SampleIndex(next));
                    prop_assert!(!unit.items.is_empty() && unit.items.end <= views);
                    for item in unit.items.clone() {
                        for _ in 0..each {
                            prop_assert_eq!(plan.locate(SampleIndex(next)), (unit.subject, ItemId(item)));
                            prop_assert_eq!(plan.shard_of(SampleIndex(next)).map(|found| found.id), Some(shard.id));
                            next += 1;
                        }
                    }
                }
                prop_assert_eq!(shard.samples.end, next);
            }
            prop_assert_eq!(next, plan.samples);
            prop_assert_eq!(next, objects as u64 * u64::from(views) * u64::from(each));
            prop_assert!(plan.shard_of(SampleIndex(next)).is_none());
            prop_assert!(plan.units().enumerate().all(|(index, unit)| unit.id == UnitId(index as u32)));
        }

        #[test]
        fn subjects_may_have_few_items_or_none(items in prop::collection::vec(0u32..5, 0..30), shard_samples in 1u32..20) {
            let plan = Plan::of_counts(items.iter().map(|items| (*items, 1)), shard_samples);
            let located: Vec<_> = (0..plan.samples).map(|index| plan.locate(SampleIndex(index))).collect();
            let expected = items.iter().enumerate().flat_map(|(subject, items)| {
                (0..*items).map(move |item| (subject, ItemId(item)))
            });
            prop_assert_eq!(&located, &expected.collect::<Vec<_>>());
            let of_units = plan.units().flat_map(|unit| unit.items.clone().map(move |item| (unit.subject, ItemId(item))));
            prop_assert_eq!(located, of_units.collect::<Vec<_>>());
            prop_assert!(items.iter().enumerate().all(|(subject, items)| plan.items_of(subject) == *items));
        }

        #[test]
        fn the_shard_size_moves_no_sample(views in 1u32..30, a in 1u32..200, b in 1u32..200) {
            let (first, second) = (uniform(17, views, a), uniform(17, views, b));
            for sample in (0..first.samples).map(SampleIndex) {
                prop_assert_eq!(first.locate(sample), second.locate(sample));
            }
        }

        #[test]
        fn shards_of_single_samples_are_all_full_but_the_last(objects in 1usize..20, views in 1u32..30, size in 1u32..50) {
            let plan = uniform(objects, views, size);
            let (_, others) = plan.shards.split_last().expect("a shard");
            prop_assert!(others.iter().all(|shard| shard.samples.end - shard.samples.start == u64::from(size)));
        }
    }
}
