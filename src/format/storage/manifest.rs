//! The manifest: what a dataset holds and the digests that prove it; as written, then as checked.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError,
    folder::RunMark,
    layout::{MANIFEST, RUN, SET, ShardName, files_of},
    seal::unsealed,
};
use crate::{Channel, FORMAT_VERSION, FactKind, Product};
use kernel::{
    files::{Bound, Folder, is_absent},
    ids::{Digest, JobDigest},
    words::{NumberClass, Split},
};

/// The error of a folder that has no manifest: no folder, no dataset, or one that is not finished.
pub fn without_manifest(folder: &Folder) -> DatasetError {
    let path = folder.path().to_owned();
    if folder.is_another_file() {
        return DatasetError::NotAFolder { path };
    }
    let mut names = match folder.names() {
        Err(error) if is_absent(&error) => return DatasetError::NoFolder { folder: path },
        Err(error) => return DatasetError::io("reading", &path)(error),
        Ok(names) => names,
    };
    let is_dataset = |folder: &Folder| [MANIFEST, RUN, SET].iter().any(|name| folder.contains(name));
    if is_dataset(folder) {
        return DatasetError::Unfinished { folder: path };
    }
    names.retain(|name| is_dataset(&folder.subfolder(name)));
    let inside = names.into_iter().map(|name| name.to_string_lossy().into_owned()).collect();
    DatasetError::NoDataset { folder: path, inside }
}

/// `manifest.json`, checked. Its digests cover everything in the dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format on disk.
    pub format_version: u32,
    /// Program and version that wrote it.
    pub generator: String,
    /// Product of the dataset.
    pub product: Product,
    /// The digest that names the dataset, independent of shards, threads, paths and clock.
    pub root: Digest,
    /// Digest of the samples of each class of numbers.
    pub classes: BTreeMap<NumberClass, Digest>,
    /// Topics of each class; empty if there is only one class.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub class_topics: BTreeMap<NumberClass, Vec<String>>,
    /// Platform that the numbers of class physics and colour depend on; empty for exact ones.
    pub platform: BTreeMap<String, String>,
    /// The job.
    pub job: JobDigest,
    /// Topics of every kept sample.
    pub topics: Vec<String>,
    /// Counts.
    pub counts: Counts,
    /// The shards, in order.
    pub shards: Vec<ShardEntry>,
    /// The other files, by name.
    pub files: BTreeMap<String, FileEntry>,
    /// Warnings for users.
    pub warnings: Vec<String>,
}

/// Counts of a dataset.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counts {
    /// Sample indices: kept + rejected.
    pub samples: u64,
    /// Stored samples.
    pub kept: u64,
    /// Rejected samples by reason.
    pub rejected: BTreeMap<String, u64>,
    /// Objects.
    pub objects: u64,
    /// Meshes that could not be used.
    pub refused_meshes: u64,
    /// Stored samples by split.
    pub splits: BTreeMap<Split, u64>,
    /// Sums of the facts that add up, by name.
    pub facts: BTreeMap<String, u64>,
}

impl Counts {
    /// Sum of a fact that adds up; 0 where the dataset has no such fact.
    pub fn fact(&self, name: &str) -> u64 {
        self.facts.get(name).copied().unwrap_or(0)
    }
}

/// One shard of a manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ShardEntry {
    /// File name inside `shards/`.
    pub file: String,
    /// BLAKE3 of the file.
    pub digest: Digest,
    /// Size [bytes].
    pub bytes: u64,
    /// First sample index.
    pub first_sample: u64,
    /// Sample indices.
    pub samples: u64,
    /// Stored samples.
    pub kept: u64,
}

impl ShardEntry {
    /// Path of its file inside the dataset's folder.
    pub fn path(&self) -> String {
        format!("{}/{}", super::layout::SHARDS, self.file)
    }

    /// Smallest size of a shard with these samples [bytes]: a digest per kept sample and topic, a reason per rejected one. `None`
    /// on overflow.
    fn least_bytes(&self, topics: usize) -> Option<u64> {
        let digests = self.kept.checked_mul((size_of::<Digest>() * topics) as u64)?;
        digests.checked_add(self.samples.checked_sub(self.kept)?)
    }
}

/// One other file of a manifest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// BLAKE3 of the file.
    pub digest: Digest,
    /// Size [bytes].
    pub bytes: u64,
}

impl Manifest {
    /// Reads and checks a folder's manifest.
    ///
    /// # Errors
    /// When it is missing (the dataset is not finished), can't be read, is of another version or contradicts itself.
    pub fn read(folder: &Folder) -> Result<Self, DatasetError> {
        #[derive(Deserialize)]
        struct Version {
            format_version: u32,
        }
        let path = folder.path_of(MANIFEST);
        let text = folder.read(MANIFEST, Bound::MANIFEST).map_err(|error| match is_absent(&error) {
            true => without_manifest(folder),
            false => DatasetError::io("reading", &path)(error),
        })?;
        let unreadable = |error: serde_json::Error| invalid(&path, error.to_string());
        let Version { format_version: found } = serde_json::from_slice(&text).map_err(unreadable)?;
        if found != FORMAT_VERSION {
            return Err(DatasetError::Version { path, found, expected: FORMAT_VERSION });
        }
        let text = unsealed(&text).map_err(|problem| invalid(&path, problem))?;
        let manifest: Self = serde_json::from_slice(&text).map_err(unreadable)?;
        manifest.check(&path)?;
        Ok(manifest)
    }

    /// Channels of every kept sample.
    pub fn channels(&self) -> Vec<Channel> {
        self.topics.iter().filter_map(|topic| Channel::from_topic(topic)).collect()
    }

    /// The class of a channel's numbers; `None` for a channel that is not stored.
    pub fn class_of(&self, channel: Channel) -> Option<NumberClass> {
        let of = |(class, topics): (&NumberClass, &Vec<String>)| {
            topics.iter().any(|topic| topic == channel.topic).then_some(*class)
        };
        match self.class_topics.is_empty() {
            true => self.topics.iter().find(|topic| *topic == channel.topic).and(self.classes.keys().next().copied()),
            false => self.class_topics.iter().find_map(of),
        }
    }

    /// Whether the dataset is the one that a folder was begun for. A dataset of one shard does not show the size of shards, nor
    /// does one whose shards end where the samples of an item end.
    pub(crate) fn is_of(&self, mark: &RunMark) -> bool {
        let largest = self.shards.iter().map(|shard| shard.samples).max().unwrap_or(0);
        let size = match &self.shards[..] {
            [first, _, ..] if !self.product.has_instances => u64::from(mark.shard_samples) == first.samples,
            _ => u64::from(mark.shard_samples) >= largest,
        };
        let plan = (self.product, self.job, self.counts.samples, self.shards.len());
        size && plan == (mark.product, mark.job, mark.samples, mark.shards as usize)
    }

    /// The files of the dataset by their paths inside its folder, sorted: run mark, manifest, tables and shards.
    pub fn paths(&self) -> Vec<String> {
        let mut paths: Vec<String> =
            self.entries().into_keys().chain([super::layout::RUN, MANIFEST].map(str::to_owned)).collect();
        paths.sort();
        paths
    }

    /// Size and digest of each table and shard, by paths inside the dataset's folder.
    pub fn entries(&self) -> BTreeMap<String, FileEntry> {
        let shards =
            self.shards.iter().map(|shard| (shard.path(), FileEntry { digest: shard.digest, bytes: shard.bytes }));
        let tables = self.files.iter().map(|(path, file)| (path.clone(), file.clone()));
        shards.chain(tables).collect()
    }

    /// Samples to allocate memory for before any is read, at most: a damaged manifest can state any number.
    pub(crate) fn foreseen(&self) -> usize {
        self.counts.samples.min(1 << 24) as usize
    }

    /// Names of all shards' files in their folder, in order.
    pub fn shard_names(&self) -> Vec<String> {
        self.shards.iter().map(|shard| shard.file.clone()).collect()
    }

    /// Path of a shard's file, for messages.
    pub fn shard_path(&self, folder: &Path, shard: usize) -> PathBuf {
        folder.join(self.shards[shard].path())
    }

    /// Index of the shard that accounts for a sample index.
    pub fn shard_of(&self, index: u64) -> Option<usize> {
        let shard_index = self.shards.partition_point(|shard| shard.first_sample + shard.samples <= index);
        (shard_index < self.shards.len()).then_some(shard_index)
    }

    fn check(&self, path: &Path) -> Result<(), DatasetError> {
        let refuse = |problem: String| Err(invalid(path, problem));
        if let Some(topic) = self.topics.iter().find(|topic| Channel::from_topic(topic).is_none()) {
            return refuse(format!("unknown topic '{topic}'"));
        }
        let leading = self.product.leading();
        if self.channels().first() != Some(&leading)
            || !self.topics.is_sorted_by_key(|topic| Channel::from_topic(topic))
            || self.channels().iter().any(|channel| channel.product() != self.product)
        {
            return refuse(format!("the topics are not those of {} in order, {} first", self.product, leading.topic));
        }
        self.check_classes().map_err(|problem| invalid(path, problem))?;
        let mut next = 0;
        for (number, shard) in self.shards.iter().enumerate() {
            let named = ShardName::parse(&shard.file);
            let fits = named.is_some_and(|name| {
                name.product == self.product
                    && name.shard.0 as usize == number
                    && name.shards as usize == self.shards.len()
                    && name.short == shard.digest.short()
            });
            if !fits {
                return refuse(format!("shard {number} has the file name '{}'", shard.file));
            }
            if shard.first_sample != next || shard.samples == 0 || shard.kept > shard.samples {
                return refuse(format!("shard {number} begins at sample {}, expected {next}", shard.first_sample));
            }
            // Memory is allocated per sample: refuse a small file that states many samples before that.
            let least = shard.least_bytes(self.topics.len());
            let (Some(end), Some(true)) =
                (shard.first_sample.checked_add(shard.samples), least.map(|least| least <= shard.bytes))
            else {
                let ShardEntry { bytes, samples, kept, .. } = shard;
                return refuse(format!("shard {number} has {bytes} bytes, too few for {samples} samples, {kept} kept"));
            };
            next = end;
        }
        let Counts { samples, kept, rejected, splits, facts, .. } = &self.counts;
        let of_shards = sum(self.shards.iter().map(|shard| shard.kept));
        let of_splits = sum(splits.values().copied());
        let of_fates = sum(rejected.values().copied().chain([*kept]));
        let sums = [
            ("samples of the shards", next, *samples),
            ("kept samples of the shards", of_shards, *kept),
            ("kept samples of the splits", of_splits, if self.product.has_splits { *kept } else { 0 }),
            ("kept and rejected samples", of_fates, *samples),
        ];
        for (what, found, expected) in sums {
            if found != expected {
                return refuse(format!("{found} {what}, {expected} in all"));
            }
        }
        let channels = self.channels();
        let counted = self.product.facts_of(&channels).filter(|(_, fact)| fact.kind == FactKind::Count);
        let mut expected: Vec<&str> = counted.map(|(_, fact)| fact.name).collect();
        expected.sort_unstable();
        // A dataset without samples has counted nothing.
        if facts.keys().ne(expected.iter()) && *samples > 0 {
            return refuse(format!("it counts {:?}, a dataset of {} {expected:?}", facts.keys(), self.product));
        }
        let names: Vec<&str> = self.files.keys().map(String::as_str).collect();
        if names != files_of(self.product) {
            return refuse(format!("it names the files {names:?}"));
        }
        Ok(())
    }

    /// Checks that each topic has one class; `Err` has the problem in words.
    fn check_classes(&self) -> Result<(), String> {
        let named: Vec<&NumberClass> = self.class_topics.keys().collect();
        let classes: Vec<&NumberClass> = self.classes.keys().collect();
        match classes.len() {
            0 => return Err("it names no class of numbers".to_owned()),
            1 if named.is_empty() => return Ok(()),
            _ if named != classes || classes.len() == 1 => {
                return Err(format!("it has roots of {classes:?} and topics of {named:?}"));
            }
            _ => {}
        }
        let mut topics: Vec<&String> = self.class_topics.values().flatten().collect();
        topics.sort_by_key(|topic| Channel::from_topic(topic));
        if topics != self.topics.iter().collect::<Vec<_>>() || self.class_topics.values().any(Vec::is_empty) {
            return Err(format!("its classes are of the topics {topics:?}, it has {:?}", self.topics));
        }
        Ok(())
    }
}

/// Sum of counts, saturating; no dataset is that large.
fn sum(mut counts: impl Iterator<Item = u64>) -> u64 {
    counts.try_fold(0u64, u64::checked_add).unwrap_or(u64::MAX)
}

fn invalid(path: &Path, problem: String) -> DatasetError {
    DatasetError::Invalid {
        path: path.to_owned(),
        problem,
        remedy: "delete it and `run` the job again: finished shards are kept",
    }
}
