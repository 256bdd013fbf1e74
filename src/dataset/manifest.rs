//! The manifest: what a dataset holds and the digests that prove it; as written, then as checked.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::{
    DatasetError, Split,
    layout::{MANIFEST, ShardName, files_of, has_splits},
    seal::unsealed,
};
use crate::{
    geom::{PoseLabel, Proof},
    ids::{Digest, JobDigest, Product},
    record::{BlockFacts, Channel, FORMAT_VERSION, GraspFacts, GraspVerdict, TrialFacts},
};

/// How equal the numbers of a product are on two machines.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NumberClass {
    /// The same bits on any machine: our own code.
    Exact,
    /// The same bits for one physics library, C library and processor level.
    Physics,
    /// The same bits for one graphics driver.
    Colour,
}

impl NumberClass {
    /// The name in files and in the root digest.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Physics => "physics",
            Self::Colour => "colour",
        }
    }
}

/// `manifest.json`, checked. Everything a dataset holds hangs on it by digests.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Format on disk.
    pub format_version: u32,
    /// Program and version that wrote it.
    pub generator: String,
    /// What it holds.
    pub product: Product,
    /// The digest that names the dataset, whatever its shards, threads, paths and clock.
    pub root: Digest,
    /// Digest of the samples of each class of numbers.
    pub classes: BTreeMap<NumberClass, Digest>,
    /// Topics of each class; empty where there is one class alone.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub class_topics: BTreeMap<NumberClass, Vec<String>>,
    /// What the numbers of class physics and colour depend on; empty for exact ones.
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
    /// Things a user should know.
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
    /// Of a reachability dataset: poses by label and proof.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<PoseCounts>,
    /// Of a dataset of grasps: grasps by verdict.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grasps: Option<GraspCounts>,
    /// Of a dataset of patches: the kept grasps that they were chosen from, by type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub types: Option<TypeCounts>,
}

/// Kept grasps of a whole dataset by type, and which types were chosen.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TypeCounts {
    /// Kept grasps of each type.
    pub counts: BTreeMap<u32, u64>,
    /// Kept grasps without a type.
    pub without: u64,
    /// The chosen types, the most common first.
    pub chosen: Vec<u32>,
}

impl TypeCounts {
    /// Kept grasps in all.
    pub fn grasps(&self) -> u64 {
        self.without + self.counts.values().sum::<u64>()
    }

    /// Kept grasps of the chosen types.
    pub fn covered(&self) -> u64 {
        self.chosen.iter().filter_map(|kind| self.counts.get(kind)).sum()
    }
}

/// Grasps, counted.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraspCounts {
    /// By name of the verdict.
    pub verdicts: BTreeMap<String, u64>,
    /// Runs whose seed was given up before they were over, rejected ones included.
    pub given_up: u64,
    /// What came of physical trials; absent without them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trials: Option<TrialCounts>,
}

/// Physical trials of kept grasps, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrialCounts {
    /// Grasps that were tried.
    pub tried: u64,
    /// Of them held.
    pub held: u64,
    /// Of them refused: the hand starts too deep.
    pub refused: u64,
}

impl GraspCounts {
    /// Grasps in all.
    pub fn found(&self) -> u64 {
        self.verdicts.values().sum()
    }

    /// Grasps with a verdict.
    pub fn of_verdict(&self, verdict: GraspVerdict) -> u64 {
        self.verdicts.get(verdict.name()).copied().unwrap_or(0)
    }

    pub(super) fn add(&mut self, facts: &GraspFacts) {
        for (verdict, count) in GraspVerdict::ALL.into_iter().zip(facts.verdicts) {
            *self.verdicts.entry(verdict.name().to_owned()).or_default() += u64::from(count);
        }
        self.given_up += u64::from(facts.given_up);
        let TrialFacts { tried, held, refused } = facts.trials;
        if tried > 0 {
            let counts = self.trials.get_or_insert_with(TrialCounts::default);
            counts.tried += u64::from(tried);
            counts.held += u64::from(held);
            counts.refused += u64::from(refused);
        }
    }
}

/// Poses of a reachability dataset, counted.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseCounts {
    /// By name of the label.
    pub labels: BTreeMap<String, u64>,
    /// By name of the proof: how the label is known.
    pub proofs: BTreeMap<String, u64>,
}

impl PoseCounts {
    /// Poses in all.
    pub fn cells(&self) -> u64 {
        self.labels.values().sum()
    }

    /// Poses with a label.
    pub fn of_label(&self, label: PoseLabel) -> u64 {
        self.labels.get(label.name()).copied().unwrap_or(0)
    }

    /// Poses whose label is known so.
    pub fn of_proof(&self, proof: Proof) -> u64 {
        self.proofs.get(proof.name()).copied().unwrap_or(0)
    }

    pub(super) fn add(&mut self, facts: &BlockFacts) {
        for (label, count) in PoseLabel::ALL.into_iter().zip(facts.labels) {
            *self.labels.entry(label.name().to_owned()).or_default() += u64::from(count);
        }
        for (proof, count) in Proof::ALL.into_iter().zip(facts.proofs) {
            *self.proofs.entry(proof.name().to_owned()).or_default() += u64::from(count);
        }
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
    pub fn read(folder: &Path) -> Result<Self, DatasetError> {
        #[derive(Deserialize)]
        struct Version {
            format_version: u32,
        }
        let path = folder.join(MANIFEST);
        let text = fs::read(&path).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => DatasetError::Unfinished { folder: folder.to_owned() },
            _ => DatasetError::io("reading", &path)(error),
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

    /// What every kept sample has.
    pub fn channels(&self) -> Vec<Channel> {
        self.topics.iter().filter_map(|topic| Channel::from_topic(topic)).collect()
    }

    /// The class of a channel's numbers; `None` of one that is not stored.
    pub fn class_of(&self, channel: Channel) -> Option<NumberClass> {
        let of = |(class, topics): (&NumberClass, &Vec<String>)| {
            topics.iter().any(|topic| topic == channel.topic()).then_some(*class)
        };
        match self.class_topics.is_empty() {
            true => self.topics.iter().find(|topic| *topic == channel.topic()).and(self.classes.keys().next().copied()),
            false => self.class_topics.iter().find_map(of),
        }
    }

    /// The files of the dataset by their paths inside its folder, sorted: run mark, manifest, tables and shards.
    pub fn paths(&self) -> Vec<String> {
        let mut paths: Vec<String> =
            self.entries().into_keys().chain([super::layout::RUN, MANIFEST].map(str::to_owned)).collect();
        paths.sort();
        paths
    }

    /// What it says of each table and shard, by paths inside the dataset's folder.
    pub fn entries(&self) -> BTreeMap<String, FileEntry> {
        let shards =
            self.shards.iter().map(|shard| (shard.path(), FileEntry { digest: shard.digest, bytes: shard.bytes }));
        let tables = self.files.iter().map(|(path, file)| (path.clone(), file.clone()));
        shards.chain(tables).collect()
    }

    /// Samples that memory may be taken for before any was read: a manifest may lie.
    pub(super) fn foreseen(&self) -> usize {
        self.counts.samples.min(1 << 24) as usize
    }

    /// Path of a shard's file.
    pub fn shard_path(&self, folder: &Path, shard: usize) -> PathBuf {
        folder.join(self.shards[shard].path())
    }

    /// Place of the shard that accounts for a sample index.
    pub fn shard_of(&self, index: u64) -> Option<usize> {
        let place = self.shards.partition_point(|shard| shard.first_sample + shard.samples <= index);
        (place < self.shards.len()).then_some(place)
    }

    fn check(&self, path: &Path) -> Result<(), DatasetError> {
        let refuse = |problem: String| Err(invalid(path, problem));
        if let Some(topic) = self.topics.iter().find(|topic| Channel::from_topic(topic).is_none()) {
            return refuse(format!("unknown topic '{topic}'"));
        }
        let leading = Channel::leading(self.product);
        if self.channels().first() != Some(&leading)
            || !self.topics.is_sorted_by_key(|topic| Channel::from_topic(topic))
            || self.channels().iter().any(|channel| channel.product() != self.product)
        {
            return refuse(format!("the topics are not those of {} in order, {} first", self.product, leading.topic()));
        }
        self.check_classes().map_err(|problem| invalid(path, problem))?;
        let mut next = 0;
        for (place, shard) in self.shards.iter().enumerate() {
            let named = ShardName::parse(&shard.file);
            let fits = named.is_some_and(|name| {
                name.product == self.product
                    && name.shard.0 as usize == place
                    && name.shards as usize == self.shards.len()
                    && name.short == shard.digest.short()
            });
            if !fits {
                return refuse(format!("shard {place} has the file name '{}'", shard.file));
            }
            if shard.first_sample != next || shard.samples == 0 || shard.kept > shard.samples {
                return refuse(format!("shard {place} begins at sample {}, expected {next}", shard.first_sample));
            }
            let Some(end) = shard.first_sample.checked_add(shard.samples) else {
                return refuse(format!("shard {place} has {} samples", shard.samples));
            };
            next = end;
        }
        let Counts { samples, kept, rejected, splits, poses, grasps, types, .. } = &self.counts;
        let of_shards: u64 = self.shards.iter().map(|shard| shard.kept).sum();
        let sums = [
            ("samples of the shards", next, *samples),
            ("kept samples of the shards", of_shards, *kept),
            ("kept samples of the splits", splits.values().sum(), if has_splits(self.product) { *kept } else { 0 }),
            ("kept and rejected samples", kept + rejected.values().sum::<u64>(), *samples),
        ];
        for (what, found, expected) in sums {
            if found != expected {
                return refuse(format!("{found} {what}, {expected} in all"));
            }
        }
        if poses.is_some() != (self.product == Product::Reachability) {
            return refuse(format!("a dataset of {} with counts of poses: {}", self.product, poses.is_some()));
        }
        if grasps.is_some() != (self.product == Product::Grasps) {
            return refuse(format!("a dataset of {} with counts of grasps: {}", self.product, grasps.is_some()));
        }
        if types.is_some() != (self.product == Product::Patches) {
            return refuse(format!("a dataset of {} with counts of types: {}", self.product, types.is_some()));
        }
        if let Some(types) = types
            && types.covered() != *samples
        {
            return refuse(format!("{samples} samples of {} grasps of the chosen types", types.covered()));
        }
        let names: Vec<&str> = self.files.keys().map(String::as_str).collect();
        if names != files_of(self.product) {
            return refuse(format!("it names the files {names:?}"));
        }
        Ok(())
    }

    /// Each topic is of one class; `Err` says in words which is not.
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

fn invalid(path: &Path, problem: String) -> DatasetError {
    DatasetError::Invalid {
        path: path.to_owned(),
        problem,
        remedy: "delete it and `run` the job again: finished shards are kept",
    }
}
