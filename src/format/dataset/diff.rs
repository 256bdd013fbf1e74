//! Differences between two datasets, sample by sample and by channel, computed from manifests, ledgers and tables only: no
//! payload is read, and no mesh is needed. [`verify`](super::verify()) checks whether a dataset matches its ledgers.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use serde::Serialize;

use super::finish::root_parts;
use crate::{
    Channel, Product,
    storage::{AssetRow, DatasetError, DatasetReader, Fate, Ledger, LedgerRow, Manifest},
};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId, SampleIndex},
};

/// Ledgers of the second dataset in memory at a time: objects have about the same order in both, shards may not.
const LEDGERS: usize = 4;

/// Differences between two datasets, the first called `a`, the second `b`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DatasetDifference {
    /// Both hold the same: every sample, reject, row of the asset table, field and job; the roots are equal.
    pub equal: bool,
    /// Product of each.
    pub products: [Product; 2],
    /// Root digest of each.
    pub roots: [Digest; 2],
    /// Sample indices of each.
    pub samples: [u64; 2],
    /// Samples in both, by outcome.
    pub both: SampleCounts,
    /// Samples only in `b`.
    pub appeared: u64,
    /// Samples only in `a`.
    pub vanished: u64,
    /// Payloads of samples kept in both, by topic.
    pub channels: BTreeMap<String, ChannelCounts>,
    /// Objects whose samples differ, by name; and hands, containers and robots.
    pub objects: BTreeMap<String, ObjectDifference>,
    /// Some of the samples that differ, by id, at most [`DatasetDifference::MAX`].
    pub examples: Vec<String>,
    /// Reasons, from the manifests of the two.
    pub reasons: Vec<Reason>,
    /// Differences in files that change no sample.
    pub packaging: Vec<String>,
}

impl DatasetDifference {
    /// Samples that are listed.
    pub const MAX: usize = 20;
}

/// Samples that both datasets have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct SampleCounts {
    /// Identical payloads on every topic that both store, or rejected for the same reason with the same numbers.
    pub same: u64,
    /// Kept by both, with different payloads on a topic that both store.
    pub changed: u64,
    /// Kept by `a`, rejected by `b`.
    pub now_rejected: u64,
    /// Rejected by `a`, kept by `b`.
    pub now_kept: u64,
    /// Rejected by both, for different reasons or with different numbers.
    pub other_reason: u64,
}

/// Payloads of one topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ChannelCounts {
    /// Payloads with equal digests.
    pub same: u64,
    /// Payloads with different digests.
    pub changed: u64,
    /// Stored only by `a`.
    pub only_a: u64,
    /// Stored only by `b`.
    pub only_b: u64,
}

/// Differences of an object, a hand or a robot.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct ObjectDifference {
    /// Content in `a`; `None` where `a` has none of this name.
    pub a: Option<ObjectId>,
    /// Content in `b`.
    pub b: Option<ObjectId>,
    /// Keys of its row of the asset table that differ, where the content is the same.
    pub facts: BTreeSet<String>,
    /// Samples of it that differ, vanished or appeared.
    pub samples: u64,
}

/// Why two datasets can differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "what", rename_all = "snake_case")]
pub enum Reason {
    /// The resolved jobs differ; compare the job files to find the settings.
    Job {
        /// Job of `a`.
        a: Digest,
        /// Job of `b`.
        b: Digest,
    },
    /// Written by other programs.
    Program {
        /// Program of `a`.
        a: String,
        /// Program of `b`.
        b: String,
    },
    /// Numbers of class physics or colour were made on different platforms.
    Platform {
        /// Key of the platform's table.
        key: String,
        /// Value of `a`; `None` where it does not depend on the key.
        a: Option<String>,
        /// Value of `b`.
        b: Option<String>,
    },
    /// Numbers of a class differ.
    Class {
        /// Name of the class.
        class: &'static str,
    },
    /// Objects, hands or robots of one name have different content, or are in only one dataset.
    Assets {
        /// Their names.
        names: Vec<String>,
    },
    /// The contents of a file that only their product has differ.
    File {
        /// Word for the file in the root digest.
        word: &'static str,
    },
}

/// Compares two finished datasets. Memory: a byte per sample, and a few ledgers.
///
/// # Errors
/// When one is not finished or a table or ledger of it can't be read.
pub fn diff(a: &Folder, b: &Folder) -> Result<DatasetDifference, DatasetError> {
    let (a, b) = (DatasetReader::open(a)?, DatasetReader::open(b)?);
    let mut pass = Pass {
        names: [names_of(&a)?, names_of(&b)?],
        b: Ledgers { reader: &b, kept: VecDeque::new() },
        both: SampleCounts::default(),
        vanished: 0,
        appeared: 0,
        channels: BTreeMap::new(),
        objects: objects_of(&a, &b)?,
        examples: Vec::new(),
    };
    for shard in 0..a.manifest().shards.len() {
        let ledger = a.ledger(shard)?;
        for row in &ledger.rows {
            pass.row(&ledger.channels, row)?;
        }
    }
    for id in (0..b.manifest().counts.samples).filter_map(|index| b.id(SampleIndex(index))) {
        if a.find(&id).is_none() {
            pass.appeared += 1;
            pass.differs(&id.subject, 1, || format!("{id} appeared"));
        }
    }
    let Pass { both, vanished, appeared, channels, objects, examples, .. } = pass;
    let (a_said, b_said) = (a.manifest(), b.manifest());
    let SampleCounts { changed, now_rejected, now_kept, other_reason, .. } = both;
    let same_samples = changed + now_rejected + now_kept + other_reason + vanished + appeared == 0
        && channels.values().all(|counts| counts.only_a + counts.only_b == 0);
    let reasons = reasons(&a, &b, &objects)?;
    Ok(DatasetDifference {
        equal: same_samples && objects.is_empty() && a_said.root == b_said.root,
        products: [a_said.product, b_said.product],
        roots: [a_said.root, b_said.root],
        samples: [a_said.counts.samples, b_said.counts.samples],
        both,
        appeared,
        vanished,
        channels: channels.into_iter().map(|(channel, counts)| (channel.topic.to_owned(), counts)).collect(),
        objects,
        examples,
        reasons,
        packaging: packaging(a_said, b_said),
    })
}

/// Names of objects by content.
fn names_of(reader: &DatasetReader) -> Result<BTreeMap<ObjectId, String>, DatasetError> {
    Ok(reader.assets()?.objects.into_iter().map(|row| (row.object, row.name)).collect())
}

/// Objects, hands, containers and robots that are not the same in both.
fn objects_of(a: &DatasetReader, b: &DatasetReader) -> Result<BTreeMap<String, ObjectDifference>, DatasetError> {
    let (a, b) = (a.assets()?, b.assets()?);
    let mut found: BTreeMap<String, ObjectDifference> = BTreeMap::new();
    for (a, b) in [(&a.objects, &b.objects), (&a.hands, &b.hands), (&a.containers, &b.containers)] {
        // A hand can have the name of an object: the first row with a name counts.
        let named = |rows: &[AssetRow]| {
            rows.iter().rev().map(|row| (row.name.clone(), row.clone())).collect::<BTreeMap<_, _>>()
        };
        let (a, b) = (named(a), named(b));
        for name in a.keys().chain(b.keys()).collect::<BTreeSet<_>>() {
            let (a, b) = (a.get(name), b.get(name));
            let mut facts = BTreeSet::new();
            if let (Some(a), Some(b)) = (a, b)
                && a.object == b.object
            {
                let keys = a.facts.keys().chain(b.facts.keys());
                facts.extend(keys.filter(|key| a.facts.get(*key) != b.facts.get(*key)).cloned());
                if facts.is_empty() {
                    continue;
                }
            }
            let (a, b) = (a.map(|row| row.object), b.map(|row| row.object));
            found.entry(name.clone()).or_insert(ObjectDifference { a, b, facts, samples: 0 });
        }
    }
    Ok(found)
}

/// One pass over the ledgers of the first dataset.
struct Pass<'a> {
    /// Names of objects by content, for each dataset.
    names: [BTreeMap<ObjectId, String>; 2],
    b: Ledgers<'a>,
    both: SampleCounts,
    vanished: u64,
    appeared: u64,
    channels: BTreeMap<Channel, ChannelCounts>,
    objects: BTreeMap<String, ObjectDifference>,
    examples: Vec<String>,
}

impl Pass<'_> {
    fn row(&mut self, channels: &[Channel], row: &LedgerRow) -> Result<(), DatasetError> {
        let id = row.sample;
        let Some(index) = self.b.reader.find(&id) else {
            self.vanished += 1;
            self.differs(&id.subject, 0, || format!("{id} vanished"));
            return Ok(());
        };
        let ledger = self.b.of(index)?;
        let Some(other) = index.0.checked_sub(ledger.first.0).and_then(|position| ledger.rows.get(position as usize))
        else {
            return Err(unknown(self.b.reader, index));
        };
        let (fate, in_b) = (other.fate.clone(), ledger.channels.clone());
        let what = match (&row.fate, &fate) {
            (Fate::Kept(a), Fate::Kept(b)) => {
                let changed = self.payloads((channels, a), (&in_b, b));
                if changed.is_empty() {
                    self.both.same += 1;
                    return Ok(());
                }
                self.both.changed += 1;
                format!("{id} has other bytes in {}", changed.join(", "))
            }
            (Fate::Kept(_), Fate::Rejected { reason, .. }) => {
                self.both.now_rejected += 1;
                format!("{id} was kept and is rejected: {reason}")
            }
            (Fate::Rejected { reason, .. }, Fate::Kept(_)) => {
                self.both.now_kept += 1;
                format!("{id} was rejected ({reason}) and is kept")
            }
            (a, b) if a == b => {
                self.both.same += 1;
                return Ok(());
            }
            _ => {
                self.both.other_reason += 1;
                format!("{id} is rejected for another reason or with other numbers")
            }
        };
        self.differs(&id.subject, 0, || what);
        Ok(())
    }

    /// Counts payloads; names of the channels that both store, with other bytes.
    fn payloads(&mut self, a: (&[Channel], &[Digest]), b: (&[Channel], &[Digest])) -> Vec<&'static str> {
        let mut changed = Vec::new();
        let digest = |(channels, digests): (&[Channel], &[Digest]), channel: Channel| {
            channels.iter().zip(digests).find(|(stored, _)| **stored == channel).map(|(_, digest)| *digest)
        };
        for channel in a.0.iter().chain(b.0).copied().collect::<BTreeSet<_>>() {
            let counts = self.channels.entry(channel).or_default();
            match (digest(a, channel), digest(b, channel)) {
                (Some(a), Some(b)) if a == b => counts.same += 1,
                (Some(_), Some(_)) => {
                    counts.changed += 1;
                    changed.push(channel.name());
                }
                (Some(_), None) => counts.only_a += 1,
                (None, _) => counts.only_b += 1,
            }
        }
        changed
    }

    /// A sample of a subject of dataset `side` differs.
    fn differs(&mut self, subject: &ObjectId, side: usize, example: impl FnOnce() -> String) {
        let name = self.names[side].get(subject).cloned().unwrap_or_else(|| subject.to_string());
        if self.examples.len() < DatasetDifference::MAX {
            self.examples.push(format!("{name}: {}", example()));
        }
        if let Some(object) = self.objects.get_mut(&name) {
            object.samples += 1;
            return;
        }
        let content = |names: &BTreeMap<ObjectId, String>| names.contains_key(subject).then_some(*subject);
        let object = ObjectDifference {
            a: content(&self.names[0]),
            b: content(&self.names[1]),
            samples: 1,
            ..Default::default()
        };
        self.objects.insert(name, object);
    }
}

/// The most recently used ledgers.
struct Ledgers<'a> {
    reader: &'a DatasetReader,
    /// By index among the shards; the most recently used one is last.
    kept: VecDeque<(usize, Ledger)>,
}

impl Ledgers<'_> {
    fn of(&mut self, index: SampleIndex) -> Result<&Ledger, DatasetError> {
        let shard = self.reader.manifest().shard_of(index.0).ok_or_else(|| unknown(self.reader, index))?;
        match self.kept.iter().position(|(kept, _)| *kept == shard) {
            Some(position) if position + 1 == self.kept.len() => {}
            Some(position) => {
                let ledger = self.kept.remove(position);
                self.kept.extend(ledger);
            }
            None => {
                let ledger = self.reader.ledger(shard)?;
                self.kept.push_back((shard, ledger));
                if self.kept.len() > LEDGERS {
                    self.kept.pop_front();
                }
            }
        }
        self.kept.back().map(|(_, ledger)| ledger).ok_or_else(|| unknown(self.reader, index))
    }
}

fn unknown(reader: &DatasetReader, index: SampleIndex) -> DatasetError {
    DatasetError::Invalid {
        path: reader.folder().path().to_owned(),
        problem: format!("sample {index} is in the index but in no ledger"),
        remedy: "run `graspmill verify` to find the damage",
    }
}

/// Reasons why the two can differ, from their manifests.
fn reasons(
    a: &DatasetReader,
    b: &DatasetReader,
    objects: &BTreeMap<String, ObjectDifference>,
) -> Result<Vec<Reason>, DatasetError> {
    let (said_a, said_b) = (a.manifest(), b.manifest());
    let mut reasons = Vec::new();
    if said_a.job != said_b.job {
        reasons.push(Reason::Job { a: said_a.job.0, b: said_b.job.0 });
    }
    let names: Vec<String> = objects
        .iter()
        .filter(|(_, object)| object.a != object.b || !object.facts.is_empty())
        .map(|(name, _)| name.clone())
        .collect();
    if !names.is_empty() {
        reasons.push(Reason::Assets { names });
    }
    if said_a.generator != said_b.generator {
        reasons.push(Reason::Program { a: said_a.generator.clone(), b: said_b.generator.clone() });
    }
    let platform = other_platform(&said_a.platform, &said_b.platform);
    reasons.extend(platform.into_iter().map(|(key, [a, b])| Reason::Platform { key, a, b }));
    for class in said_a.classes.keys().chain(said_b.classes.keys()).collect::<BTreeSet<_>>() {
        if said_a.classes.get(class) != said_b.classes.get(class) {
            reasons.push(Reason::Class { class: class.name() });
        }
    }
    if said_a.product == said_b.product {
        let [parts_a, parts_b] = [a, b].map(|reader| root_parts(reader.folder(), said_a.product));
        let differs = parts_a?.into_iter().zip(parts_b?).filter(|(a, b)| a != b);
        reasons.extend(differs.map(|((word, _), _)| Reason::File { word }));
    }
    Ok(reasons)
}

/// Platform facts that differ, by key, with the value of each platform.
pub fn other_platform(
    a: &BTreeMap<String, String>,
    b: &BTreeMap<String, String>,
) -> BTreeMap<String, [Option<String>; 2]> {
    let both = a.keys().chain(b.keys()).map(|key| (key.clone(), [a, b].map(|facts| facts.get(key).cloned())));
    both.filter(|(_, [a, b])| a != b).collect()
}

/// Differences in files that change no sample: how they are cut and compressed.
fn packaging(a: &Manifest, b: &Manifest) -> Vec<String> {
    let mut found = Vec::new();
    let cut = |manifest: &Manifest| manifest.shards.iter().map(|shard| shard.samples).collect::<Vec<_>>();
    if cut(a) != cut(b) {
        let words = |manifest: &Manifest| {
            let largest = manifest.shards.iter().map(|shard| shard.samples).max().unwrap_or(0);
            format!("{} shards of at most {largest} samples", manifest.shards.len())
        };
        found.push(format!("{}, {}", words(a), words(b)));
    } else {
        let others = a.shards.iter().zip(&b.shards).filter(|(a, b)| a.digest != b.digest).count();
        if others > 0 {
            found.push(format!("{others} of {} shards have other bytes", a.shards.len()));
        }
    }
    let tables: Vec<&str> = (a.files.iter())
        .filter(|(name, entry)| b.files.get(*name).is_some_and(|other| other.digest != entry.digest))
        .map(|(name, _)| name.as_str())
        .collect();
    if !tables.is_empty() {
        found.push(format!("other bytes in {}", tables.join(", ")));
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn platforms_are_told_apart_by_fact() {
        let facts = |list: &[(&str, &str)]| -> BTreeMap<String, String> {
            list.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
        };
        let there = facts(&[("libc", "glibc 2.36"), ("libmujoco", "aa")]);
        let here = facts(&[("libc", "glibc 2.36"), ("libmujoco", "bb"), ("gl_renderer", "llvmpipe")]);
        let found = other_platform(&there, &here);
        assert_eq!(found["libmujoco"], [Some("aa".to_owned()), Some("bb".to_owned())]);
        assert_eq!(found["gl_renderer"], [None, Some("llvmpipe".to_owned())]);
        assert!(found.len() == 2 && other_platform(&there, &there).is_empty());
    }
}
