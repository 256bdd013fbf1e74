//! The checked keys of a product, before its meshes are read.

use std::{fmt, ops::RangeInclusive, sync::Arc};

use crate::{
    plan::SubjectItems,
    sections::{JobObjects, ObjectsDraft},
    work::Work,
};

/// The checked keys of a product, before its meshes are read.
pub struct DraftWork {
    /// Samples per shard.
    pub shard_samples: ShardSamples,
    /// Whether the job draws with OpenGL.
    pub draws_colours: bool,
    /// Rules that every record of the job obeys, by name, for `verify`.
    pub rules: Vec<&'static str>,
    /// Notes for the user.
    pub notes: Vec<String>,
    /// The objects, for a product that has some.
    pub objects: Option<ObjectsDraft>,
    /// Whether something depends on the mass of each object.
    pub with_masses: bool,
    /// Whether each object must have a solid: a mesh of which no cell is inside is refused.
    pub with_solids: bool,
    /// Whether each object must hang together: a mesh in loose parts is refused unless the job joins them.
    pub of_one_body: bool,
    /// Makes the work of the prepared objects.
    pub make: MakeWork,
}

/// Makes the work of a job from its prepared objects and the notes for the user, to which it can add. Objects are
/// `None` for a product without objects.
pub type MakeWork = Box<dyn FnOnce(Option<JobObjects>, &mut Vec<String>) -> Arc<dyn Work> + Send>;

impl DraftWork {
    /// Work that is complete: no mesh is to be read.
    pub fn ready(work: impl Work, shard_samples: impl Into<ShardSamples>) -> Self {
        Self {
            shard_samples: shard_samples.into(),
            draws_colours: false,
            rules: Vec::new(),
            notes: Vec::new(),
            objects: None,
            with_masses: false,
            with_solids: false,
            of_one_body: false,
            make: Box::new(move |_, _| Arc::new(work)),
        }
    }

    /// Work about objects.
    pub fn of_objects<W: Work>(
        (objects, notes): (ObjectsDraft, Vec<String>),
        shard_samples: impl Into<ShardSamples>,
        make: impl FnOnce(JobObjects, &mut Vec<String>) -> W + Send + 'static,
    ) -> Self {
        let make = move |objects: Option<JobObjects>, notes: &mut Vec<String>| -> Arc<dyn Work> {
            Arc::new(make(objects.expect("a draft with objects resolves them"), notes))
        };
        let objects = Some(objects);
        Self {
            shard_samples: shard_samples.into(),
            draws_colours: false,
            rules: Vec::new(),
            notes,
            objects,
            with_masses: false,
            with_solids: false,
            of_one_body: false,
            make: Box::new(make),
        }
    }
}

impl fmt::Debug for DraftWork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            shard_samples,
            draws_colours,
            rules,
            notes,
            objects,
            with_masses,
            with_solids,
            of_one_body,
            make: _,
        } = self;
        f.debug_struct("DraftWork")
            .field("shard_samples", shard_samples)
            .field("draws_colours", draws_colours)
            .field("rules", rules)
            .field("notes", notes)
            .field("objects", objects)
            .field("with_masses", with_masses)
            .field("with_solids", with_solids)
            .field("of_one_body", of_one_body)
            .finish_non_exhaustive()
    }
}

/// Count of samples in each shard.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ShardSamples {
    /// Limits the count.
    Most(u32),
    /// A thirty-second of all samples at most, within a range: threads and tasks take whole shards, so that even a small job
    /// keeps many of them busy, while a large one does not fall into many files.
    Share(RangeInclusive<u32>),
}

impl ShardSamples {
    /// The count that a job sets, else its share within a range.
    pub fn or_share(asked: Option<u32>, range: RangeInclusive<u32>) -> Self {
        asked.map_or(Self::Share(range), Self::Most)
    }

    /// Raises the count to at least this number.
    pub fn at_least(self, least: u32) -> Self {
        match self {
            Self::Most(most) => Self::Most(most.max(least)),
            Self::Share(range) => Self::Share(*range.start().max(&least)..=*range.end().max(&least)),
        }
    }

    /// Samples per shard of a job with these subjects.
    pub fn per_shard(&self, subjects: &[SubjectItems]) -> u32 {
        match self {
            Self::Most(most) => *most,
            Self::Share(range) => {
                let samples = |subject: &SubjectItems| u64::from(subject.items) * u64::from(subject.samples_per_item);
                let share = subjects.iter().map(samples).sum::<u64>().div_ceil(SHARDS);
                u32::try_from(share).unwrap_or(u32::MAX).clamp(*range.start(), *range.end())
            }
        }
    }
}

impl From<u32> for ShardSamples {
    fn from(most: u32) -> Self {
        Self::Most(most)
    }
}

/// Shards of a job with at least this number of samples.
const SHARDS: u64 = 32;

/// The multiple of the items per object that is nearest below 4,096, so that shards end where objects end; 4,096 when an
/// object has more items than that.
pub fn default_shard_samples(items: u32) -> u32 {
    const ABOUT: u32 = 4096;
    if items == 0 || items > ABOUT { ABOUT } else { ABOUT / items * items }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::ids::{Digest, ObjectId};

    fn subjects(count: u32, items: u32, samples_per_item: u32) -> Vec<SubjectItems> {
        (0..count).map(|_| SubjectItems { id: ObjectId(Digest::hash(b"any")), items, samples_per_item }).collect()
    }

    #[test]
    fn a_small_job_has_many_shards_and_a_large_one_full_ones() {
        let share = ShardSamples::or_share(None, 4..=64);
        for (samples, expected) in [(0, 4), (12, 4), (40, 4), (320, 10), (321, 11), (2048, 64), (10_000, 64)] {
            assert_eq!(share.per_shard(&subjects(samples, 1, 1)), expected, "{samples}");
        }
        assert_eq!(share.per_shard(&subjects(10, 8, 4)), 10, "samples count, not items");
        assert_eq!(share.per_shard(&subjects(2, u32::MAX, u32::MAX)), 64);
        assert_eq!(ShardSamples::or_share(Some(7), 4..=64).per_shard(&subjects(10_000, 1, 1)), 7);
    }

    #[test]
    fn a_shard_has_room_for_what_belongs_together() {
        assert_eq!(ShardSamples::from(3).at_least(15), ShardSamples::Most(15));
        assert_eq!(ShardSamples::from(30).at_least(15), ShardSamples::Most(30));
        assert_eq!(ShardSamples::Share(4..=8).at_least(6), ShardSamples::Share(6..=8));
        assert_eq!(ShardSamples::Share(4..=8).at_least(20), ShardSamples::Share(20..=20));
    }
}
