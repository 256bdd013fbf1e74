//! Roots of a dataset from its shards' ledgers: one per class of numbers, one of the rejects, and one over all.

use std::collections::BTreeMap;

use super::{
    DatasetError, Fate, LedgerRow,
    merkle::{self, Tree},
    subjects::Subjects,
};
use crate::Channel;
use kernel::{
    ids::{Digest, JobDigest, SampleId, SampleIndex},
    words::NumberClass,
};

/// The channels of each class, sorted by topic as leaves require: indices among the shards' channels.
pub(crate) struct ClassChannels(BTreeMap<NumberClass, Vec<(&'static str, usize)>>);

impl ClassChannels {
    /// `main` is included even when no channel has it, or no shard has named the channels.
    pub fn new(channels: &[Channel], main: NumberClass, class_of: impl Fn(Channel) -> NumberClass) -> Self {
        let mut classes = BTreeMap::from([(main, Vec::new())]);
        for (index, channel) in channels.iter().enumerate() {
            classes.entry(class_of(*channel)).or_insert_with(Vec::new).push((channel.topic, index));
        }
        classes.values_mut().for_each(|topics| topics.sort_unstable());
        Self(classes)
    }

    /// Topics of each class, in the order of the shards; empty if all have the same class, which needs no list.
    pub fn topics(&self) -> BTreeMap<NumberClass, Vec<String>> {
        if self.0.len() == 1 {
            return BTreeMap::new();
        }
        let in_order = |topics: &Vec<(&'static str, usize)>| {
            let mut topics = topics.clone();
            topics.sort_unstable_by_key(|(_, index)| *index);
            topics.into_iter().map(|(topic, _)| topic.to_owned()).collect()
        };
        self.0.iter().map(|(class, topics)| (*class, in_order(topics))).collect()
    }
}

/// A sample's leaf of one root, small: subjects by rank, sorting as `SampleId` does.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Leaf {
    subject: u32,
    item: u32,
    instance: u32,
    camera: u32,
    index: u64,
    /// Class of the numbers; none for a rejected sample.
    class: Option<NumberClass>,
    digest: Digest,
}

impl Leaf {
    /// One leaf per class for a kept sample, one leaf for a rejected sample.
    pub fn of_row(rank: u32, row: &LedgerRow, channels: &ClassChannels) -> impl Iterator<Item = Self> {
        let SampleId { item, instance, camera, .. } = row.sample;
        let leaf = move |class, digest| Self {
            subject: rank,
            item: item.0,
            instance,
            camera,
            index: row.index.0,
            class,
            digest,
        };
        let (kept, rejected) = match &row.fate {
            Fate::Kept(digests) => (Some((&channels.0, digests)), None),
            Fate::Rejected { reason, detail } => (None, Some(merkle::reject_leaf(&row.sample, reason, detail))),
        };
        let kept = kept.into_iter().flat_map(move |(classes, digests)| {
            classes.iter().map(move |(class, topics)| {
                let payloads = topics.iter().map(|(topic, index)| (*topic, &digests[*index]));
                leaf(Some(*class), merkle::sample_leaf(&row.sample, payloads))
            })
        });
        kept.chain(rejected.map(|digest| leaf(None, digest)))
    }
}

/// Digests from which the root of a dataset is made, in addition to those of its tables.
pub(crate) struct Roots {
    /// Over the kept samples, one per class.
    pub classes: BTreeMap<NumberClass, Digest>,
    /// Over the rejects.
    pub rejects: Digest,
}

impl Roots {
    /// Computes the roots over all samples.
    ///
    /// # Errors
    /// When a sample has two indices.
    pub fn new(mut leaves: Vec<Leaf>, channels: &ClassChannels, subjects: &Subjects) -> Result<Self, DatasetError> {
        leaves.sort_unstable();
        let key = |leaf: &Leaf| (leaf.subject, leaf.item, leaf.instance, leaf.camera);
        let twice = |pair: &&[Leaf]| key(&pair[0]) == key(&pair[1]) && pair[0].index != pair[1].index;
        if let Some(pair) = leaves.windows(2).find(twice) {
            let subject =
                subjects.keys().nth(pair[0].subject as usize).map_or_else(String::new, |subject| subject.0.short());
            let Leaf { item, instance, camera, .. } = pair[0];
            return Err(DatasetError::DuplicateSample {
                id: format!("{subject}.{item}.{instance}.{camera}"),
                first: SampleIndex(pair[0].index),
                second: SampleIndex(pair[1].index),
            });
        }
        let mut classes: BTreeMap<NumberClass, Tree> =
            channels.0.keys().map(|class| (*class, Tree::default())).collect();
        let mut rejects = Tree::default();
        for Leaf { class, digest, .. } in leaves {
            class.and_then(|class| classes.get_mut(&class)).unwrap_or(&mut rejects).push(digest);
        }
        let classes = classes.into_iter().map(|(class, tree)| (class, tree.root())).collect();
        Ok(Self { classes, rejects: rejects.root() })
    }

    /// The digest that names the dataset; `files` are the words and digests of files that only its product has.
    pub fn dataset(&self, assets: &Digest, files: &[(&str, Digest)], job: &JobDigest) -> Digest {
        let mut classes: Vec<_> = self.classes.iter().map(|(class, root)| (class.name(), *root)).collect();
        classes.sort_unstable_by_key(|(name, _)| *name);
        merkle::dataset_root(&classes, &self.rejects, assets, files, job)
    }
}
