//! Reading a dataset back: by id, by index, by split, shuffled by chunk.

use std::{
    collections::VecDeque,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use super::{
    DatasetError, Ledger, Manifest, ShardEntry,
    error::REWRITE,
    folder::shards_folder,
    layout::SPLITS,
    ledger::{LedgerOutline, Run},
    shard_file::{ShardFile, StoredMessage, invalid},
};
use crate::{Channel, Record, RecordError};
use kernel::{
    files::{Bound, Folder},
    ids::{ItemId, ObjectId, SampleId, SampleIndex},
    words::{ObjectSplit, Split, SplitTable},
};

/// A finished dataset, open for reading; any number of threads may read at once.
///
/// Keeps one byte per sample, a few bytes per chunk and no file open; a read holds one chunk.
pub struct DatasetReader {
    folder: Folder,
    manifest: Manifest,
    /// Channels of every kept sample, in order.
    channels: Vec<Channel>,
    splits: SplitTable,
    table: SampleTable,
    shards: Vec<OnceLock<ShardFile>>,
}

/// Which samples to read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Selects only this split.
    pub split: Option<Split>,
    /// Selects only the objects of this nested training subset (an index into [`SplitTable::training_subsets`]).
    pub subset: Option<u32>,
}

impl Selection {
    /// The samples of one split.
    pub fn from_split(split: Split) -> Self {
        Self { split: Some(split), subset: None }
    }

    /// The training views of a nested training subset.
    pub fn training_subset(subset: u32) -> Self {
        Self { split: Some(Split::Training), subset: Some(subset) }
    }
}

impl DatasetReader {
    /// Opens a finished dataset: reads manifest, splits, and the identities from the shards' ledgers.
    ///
    /// # Errors
    /// When the dataset is not finished, a table or shard is missing or damaged, or the format version is another one.
    pub fn open(folder: &Folder) -> Result<Self, DatasetError> {
        let manifest = Manifest::read(folder)?;
        let splits = if manifest.product.has_splits { read_splits(folder)? } else { SplitTable::default() };
        let shards = manifest.shards.iter().map(|_| OnceLock::new()).collect();
        let table = SampleTable { flags: Vec::with_capacity(manifest.foreseen()), ..SampleTable::default() };
        let channels = manifest.channels();
        let mut reader = Self { folder: folder.clone(), channels, splits, manifest, table, shards };
        for shard in 0..reader.shards.len() {
            reader.take_outline(shard)?;
        }
        reader.table.sort();
        Ok(reader)
    }

    /// Enters the samples of the next shard into the table.
    fn take_outline(&mut self, shard: usize) -> Result<(), DatasetError> {
        let file = self.shard(shard)?;
        let outline = file.outline()?;
        let ShardEntry { first_sample, samples, kept, .. } = self.manifest.shards[shard];
        let found = (outline.first.0, u64::from(outline.rows), u64::from(outline.rows) - outline.rejects.len() as u64);
        if found != (first_sample, samples, kept) {
            let words = |(first, samples, kept)| format!("{samples} samples from {first}, {kept} kept");
            let problem =
                format!("its ledger has {}, the manifest {}", words(found), words((first_sample, samples, kept)));
            return Err(invalid(&file.path, problem));
        }
        let split_of = |subject: &ObjectId| {
            let known = self.splits.object(subject);
            let problem = || format!("its ledger names subject {subject}, which is not in splits.json");
            if self.manifest.product.has_splits && known.is_none() {
                Err(invalid(&file.path, problem()))
            } else {
                Ok(known)
            }
        };
        let splits: Vec<Option<&ObjectSplit>> =
            outline.runs.iter().map(|run| split_of(&run.subject)).collect::<Result<_, _>>()?;
        self.table.push(&outline, &splits);
        Ok(())
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Split of each object; empty where the product has no splits.
    pub fn splits(&self) -> &SplitTable {
        &self.splits
    }

    /// The folder.
    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// The ledger of a shard (an index in [`Manifest::shards`]): outcome of each of its samples, with digests.
    ///
    /// # Errors
    /// When the shard is missing or damaged.
    pub fn ledger(&self, shard: usize) -> Result<Ledger, DatasetError> {
        self.shard(shard)?.ledger()
    }

    /// Index of a sample in the dataset, kept or rejected; `None` when the dataset does not contain it.
    pub fn find(&self, sample: &SampleId) -> Option<SampleIndex> {
        self.table.find(sample)
    }

    /// The sample at an index; `None` past the end.
    pub fn id(&self, index: SampleIndex) -> Option<SampleId> {
        self.table.id(index)
    }

    /// Whether the sample at an index is stored (not rejected).
    pub fn is_kept(&self, index: SampleIndex) -> bool {
        self.table.kept(index)
    }

    /// The split of the sample at an index; `None` past the end, and where the product has no splits.
    pub fn split(&self, index: SampleIndex) -> Option<Split> {
        self.table.split(index)
    }

    /// The stored samples of a selection, in order.
    pub fn indices(&self, selection: Selection) -> impl Iterator<Item = SampleIndex> + '_ {
        (0..self.manifest.counts.samples).map(SampleIndex).filter(move |index| self.selected(*index, selection))
    }

    /// Reads one sample with all its channels; `None` when it was rejected or is past the end.
    ///
    /// # Errors
    /// When its shard is missing or damaged.
    pub fn sample(&self, index: SampleIndex) -> Result<Option<Sample>, DatasetError> {
        if !self.table.kept(index) {
            return Ok(None);
        }
        let Some((shard, chunk)) = self.chunk_of(index)? else { return Ok(None) };
        Ok(self.samples_of(shard, chunk, |other| other == index)?.into_iter().next())
    }

    /// Reads the sample of an id, as [`DatasetReader::sample`]; also `None` when the dataset does not contain it. Use it to join
    /// the samples of one id in two datasets, such as pairs and another kind of touch.
    ///
    /// # Errors
    /// When its shard is missing or damaged.
    pub fn sample_of(&self, id: &SampleId) -> Result<Option<Sample>, DatasetError> {
        self.find(id).map_or(Ok(None), |index| self.sample(index))
    }

    /// Reads a selection in order, one chunk at a time.
    pub fn iter(&self, selection: Selection) -> Samples<'_> {
        let mut chunks = Vec::new();
        let failed = self.all_chunks(&mut chunks).err();
        Samples { reader: self, selection, chunks: chunks.into_iter(), ready: VecDeque::new(), failed, shuffle: None }
    }

    /// Reads a selection in an order drawn from `seed` (which can include the epoch): chunks in random order, the few samples of
    /// a chunk in random order. One chunk is in memory at a time; samples of a chunk stay together, so mix them in a buffer where
    /// that matters.
    pub fn shuffled(&self, selection: Selection, seed: u64) -> Samples<'_> {
        let mut samples = self.iter(selection);
        let mut shuffle = Shuffle::new(seed);
        let mut chunks: Vec<_> = samples.chunks.collect();
        shuffle.shuffle(&mut chunks);
        samples.chunks = chunks.into_iter();
        samples.shuffle = Some(shuffle);
        samples
    }

    fn selected(&self, index: SampleIndex, selection: Selection) -> bool {
        let Selection { split, subset } = selection;
        self.table.kept(index)
            && split.is_none_or(|split| self.table.split(index) == Some(split))
            && subset.is_none_or(|subset| {
                let row = self.table.id(index).and_then(|sample| self.splits.object(&sample.subject));
                row.and_then(|row| row.subset).is_some_and(|of| of <= subset)
            })
    }

    /// Every chunk of every shard; an error if a kept sample is in none.
    fn all_chunks(&self, chunks: &mut Vec<(usize, usize)>) -> Result<(), DatasetError> {
        for (shard, entry) in self.manifest.shards.iter().enumerate() {
            let file = self.shard(shard)?;
            let mut samples = (entry.first_sample..entry.first_sample + entry.samples).map(SampleIndex);
            let lost = samples.find(|index| self.table.kept(*index) && file.chunk_of(*index).is_none());
            if let Some(index) = lost {
                return Err(not_stored(file, index));
            }
            chunks.extend((0..file.chunks.len()).map(|chunk| (shard, chunk)));
        }
        Ok(())
    }

    fn shard(&self, shard: usize) -> Result<&ShardFile, DatasetError> {
        if let Some(file) = self.shards[shard].get() {
            return Ok(file);
        }
        let ShardEntry { bytes: saved, first_sample, samples, file: name, .. } = &self.manifest.shards[shard];
        let (folder, path) = (shards_folder(&self.folder), self.manifest.shard_path(self.folder.path(), shard));
        match folder.size(name) {
            Ok(found) if found != *saved => {
                return Err(invalid(&path, format!("it has {found} bytes, the manifest lists {saved}")));
            }
            _ => {}
        }
        let file = ShardFile::open(&folder, name)?;
        let end = first_sample + samples;
        if let Some((first, last)) = file.samples()
            && (first < *first_sample || last >= end)
        {
            let problem = format!(
                "its chunks hold samples {first} to {last}, the manifest lists {first_sample} to {end}, exclusive"
            );
            return Err(invalid(&path, problem));
        }
        Ok(self.shards[shard].get_or_init(|| file))
    }

    fn chunk_of(&self, index: SampleIndex) -> Result<Option<(usize, usize)>, DatasetError> {
        let Some(shard) = self.manifest.shard_of(index.0) else { return Ok(None) };
        let file = self.shard(shard)?;
        match file.chunk_of(index) {
            Some(chunk) => Ok(Some((shard, chunk))),
            None => Err(not_stored(file, index)),
        }
    }

    /// The samples of a chunk that pass `wanted`, in order: all that the chunk should hold, each whole. Only kept samples pass.
    fn samples_of(
        &self,
        shard: usize,
        chunk: usize,
        wanted: impl Fn(SampleIndex) -> bool,
    ) -> Result<Vec<Sample>, DatasetError> {
        let file = self.shard(shard)?;
        let mut samples: Vec<Sample> = Vec::new();
        for StoredMessage { index, channel, payload } in file.read_chunk(chunk)? {
            if !wanted(index) {
                continue;
            }
            if samples.last().is_none_or(|sample| sample.index != index) {
                let id = (self.table.id(index))
                    .ok_or_else(|| invalid(&file.path, format!("sample {index} is in a chunk, not in a ledger")))?;
                samples.push(Sample { index, id, shard: file.path.clone(), payloads: Vec::new() });
            }
            if let Some(sample) = samples.last_mut() {
                sample.payloads.push((channel, payload));
            }
        }
        let (first, last) = file.chunks[chunk].samples;
        let mut found = samples.iter();
        for index in (first..=last).map(SampleIndex).filter(|index| wanted(*index)) {
            let sample = found.next().filter(|sample| sample.index == index).ok_or_else(|| not_stored(file, index))?;
            if !sample.channels().eq(self.channels.iter().copied()) {
                let (found, expected) = (sample.payloads.len(), self.channels.len());
                let problem = format!("sample {index} has {found} messages, expected one on each of {expected} topics");
                return Err(invalid(&file.path, problem));
            }
        }
        match found.next() {
            Some(Sample { index, .. }) => {
                Err(invalid(&file.path, format!("sample {index} is out of order in chunk {chunk}")))
            }
            None => Ok(samples),
        }
    }
}

/// The error for a kept sample whose messages are not where the shard's index locates them.
fn not_stored(file: &ShardFile, index: SampleIndex) -> DatasetError {
    invalid(&file.path, format!("sample {index} is in the ledger, not in a chunk"))
}

/// One stored sample, all channels joined; channels are decoded on demand.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Index in the dataset.
    pub index: SampleIndex,
    /// Which sample.
    pub id: SampleId,
    shard: PathBuf,
    payloads: Vec<(Channel, Vec<u8>)>,
}

impl Sample {
    /// The bytes of a channel; `None` when the dataset does not store it.
    pub fn payload(&self, channel: Channel) -> Option<&[u8]> {
        self.payloads.iter().find(|(stored, _)| *stored == channel).map(|(_, payload)| payload.as_slice())
    }

    /// The channels that are stored, in order.
    pub fn channels(&self) -> impl Iterator<Item = Channel> + '_ {
        self.payloads.iter().map(|(channel, _)| *channel)
    }

    /// The stored channel with the same name and message as another channel: products that share a kind of record have separate
    /// topics for it. Returns the other channel itself if there is none.
    pub fn alike(&self, channel: Channel) -> Channel {
        let is_alike = |stored: &Channel| stored.name() == channel.name() && stored.message == channel.message;
        self.channels().find(is_alike).unwrap_or(channel)
    }

    /// The record of a type, which every sample of a product with such records has.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn read<R: Record>(&self) -> Result<R, DatasetError> {
        self.leading(self.alike(R::CHANNEL), R::DECODE)
    }

    /// The record of a type; `None` when the dataset does not store it.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn find<R: Record>(&self) -> Result<Option<R>, DatasetError> {
        self.find_at(self.alike(R::CHANNEL))
    }

    /// The record on a channel, of a type that has several channels in one product; `None` when the dataset does not store it.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn find_at<R: Record>(&self, channel: Channel) -> Result<Option<R>, DatasetError> {
        self.decoded(channel, R::DECODE)
    }

    /// The record of a channel; `None` when the dataset does not store it.
    ///
    /// # Errors
    /// When the payload is not a valid record.
    pub fn decoded<T>(
        &self,
        channel: Channel,
        decode: impl Fn(&[u8]) -> Result<T, RecordError>,
    ) -> Result<Option<T>, DatasetError> {
        self.payload(channel).map(decode).transpose().map_err(|source| self.broken(source))
    }

    /// The record of a product's leading channel, which each of its samples has.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is not a valid record.
    pub fn leading<T>(
        &self,
        channel: Channel,
        decode: impl Fn(&[u8]) -> Result<T, RecordError>,
    ) -> Result<T, DatasetError> {
        self.decoded(channel, decode)?.ok_or_else(|| self.without(channel))
    }

    /// Why there is no message of a channel that a product's samples all have: the sample is of another product, or damaged.
    fn without(&self, channel: Channel) -> DatasetError {
        let found = self.channels().next().map(Channel::product);
        match found.filter(|found| channel.products().all(|product| product != *found)) {
            Some(found) => DatasetError::OtherProduct {
                path: self.shard.clone(),
                found,
                record: channel.name(),
                of: channel.products().map(|product| product.name).collect(),
            },
            None => invalid(&self.shard, format!("sample {} has no message on {}", self.index, channel.topic)),
        }
    }

    pub(crate) fn broken(&self, source: RecordError) -> DatasetError {
        DatasetError::Record { path: self.shard.clone(), index: self.index, source }
    }
}

/// Samples of a selection, one chunk in memory at a time; ends after the first error.
pub struct Samples<'a> {
    reader: &'a DatasetReader,
    selection: Selection,
    chunks: std::vec::IntoIter<(usize, usize)>,
    ready: VecDeque<Sample>,
    failed: Option<DatasetError>,
    shuffle: Option<Shuffle>,
}

impl Iterator for Samples<'_> {
    type Item = Result<Sample, DatasetError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(error) = self.failed.take() {
                self.chunks = Vec::new().into_iter();
                return Some(Err(error));
            }
            if let Some(sample) = self.ready.pop_front() {
                return Some(Ok(sample));
            }
            let (shard, chunk) = self.chunks.next()?;
            if let Err(error) = self.fill(shard, chunk) {
                self.failed = Some(error);
            }
        }
    }
}

impl Samples<'_> {
    fn fill(&mut self, shard: usize, chunk: usize) -> Result<(), DatasetError> {
        let (first, last) = self.reader.shard(shard)?.chunks[chunk].samples;
        let wanted = |index| self.reader.selected(index, self.selection);
        // A chunk none of whose samples is wanted need not be read.
        if !(first..=last).any(|index| wanted(SampleIndex(index))) {
            return Ok(());
        }
        let mut samples = self.reader.samples_of(shard, chunk, wanted)?;
        if let Some(shuffle) = &mut self.shuffle {
            shuffle.shuffle(&mut samples);
        }
        self.ready.extend(samples);
        Ok(())
    }
}

/// A seeded order, the same in every version: BLAKE3 in its counter mode as the source of numbers.
struct Shuffle(blake3::OutputReader);

impl Shuffle {
    fn new(seed: u64) -> Self {
        Self(blake3::Hasher::new().update(b"graspmill shuffle").update(&seed.to_le_bytes()).finalize_xof())
    }

    fn shuffle<T>(&mut self, items: &mut [T]) {
        for last in (1..items.len()).rev() {
            let mut bytes = [0; 8];
            self.0.fill(&mut bytes);
            // Multiply and shift: for fewer than 2^32 items the bias is below 2^-32.
            let pick = (u128::from(u64::from_le_bytes(bytes)) * (last as u128 + 1)) >> 64;
            items.swap(last, pick as usize);
        }
    }
}

/// Identity, fate and split of every sample, in memory: runs of consecutive items, and a byte per sample.
#[derive(Default)]
struct SampleTable {
    /// In the order of their first sample index, with that.
    runs: Vec<(u64, Run)>,
    /// Indices into `runs`, in the order of (subject, instance, camera, first item).
    by_id: Vec<u32>,
    /// Split, and bit 7 for a kept sample.
    flags: Vec<u8>,
}

/// Order of runs by identity.
fn run_key(run: &Run) -> (ObjectId, u32, u32, u32) {
    (run.subject, run.instance, run.camera, run.first_item)
}

const KEPT: u8 = 0x80;
/// Marks a sample without a split.
const NO_SPLIT: u8 = 0x7f;

pub(crate) fn read_splits(folder: &Folder) -> Result<SplitTable, DatasetError> {
    let path = folder.path_of(SPLITS);
    let text = folder.read(SPLITS, Bound::DATASET_TABLE).map_err(DatasetError::io("reading", &path))?;
    let splits: SplitTable = serde_json::from_slice(&text).map_err(|error| DatasetError::Invalid {
        path: path.clone(),
        problem: error.to_string(),
        remedy: REWRITE,
    })?;
    checked_splits(splits, &path)
}

/// Sorts a table of splits and checks it.
pub(crate) fn checked_splits(splits: SplitTable, path: &Path) -> Result<SplitTable, DatasetError> {
    splits.checked().map_err(|error| DatasetError::Invalid {
        path: path.to_owned(),
        problem: error.to_string(),
        remedy: REWRITE,
    })
}

impl SampleTable {
    /// Adds the samples of a shard; `splits` are the rows of its runs' subjects, where the product has splits.
    fn push(&mut self, outline: &LedgerOutline, splits: &[Option<&ObjectSplit>]) {
        let begin = self.flags.len();
        for (run, split) in outline.runs.iter().zip(splits) {
            let first_index = self.flags.len() as u64;
            let split_of = |item: u32| split.map_or(NO_SPLIT, |row| row.split_of(item) as u8);
            self.flags.extend((run.first_item..=run.first_item + (run.rows - 1)).map(|item| split_of(item) | KEPT));
            match self.runs.last_mut() {
                // An object that continues in the next shard is one run.
                Some((_, last))
                    if (last.subject, last.instance, last.camera) == (run.subject, run.instance, run.camera)
                        && last.first_item.checked_add(last.rows) == Some(run.first_item) =>
                {
                    last.rows += run.rows;
                }
                _ => self.runs.push((first_index, *run)),
            }
        }
        for (row, ..) in &outline.rejects {
            self.flags[begin + *row as usize] &= !KEPT;
        }
    }

    /// Orders the runs by identity, after all were pushed.
    fn sort(&mut self) {
        self.by_id = (0..self.runs.len() as u32).collect();
        let runs = &self.runs;
        self.by_id.sort_unstable_by_key(|index| run_key(&runs[*index as usize].1));
    }

    fn find(&self, sample: &SampleId) -> Option<SampleIndex> {
        let key = (sample.subject, sample.instance, sample.camera, sample.item.0);
        let after = self.by_id.partition_point(|index| run_key(&self.runs[*index as usize].1) <= key);
        let (first_index, run) = self.runs[*self.by_id.get(after.checked_sub(1)?)? as usize];
        let offset = sample.item.0.checked_sub(run.first_item)?;
        let fits = (run.subject, run.instance, run.camera) == (key.0, key.1, key.2) && offset < run.rows;
        fits.then(|| SampleIndex(first_index + u64::from(offset)))
    }

    fn id(&self, index: SampleIndex) -> Option<SampleId> {
        let after = self.runs.partition_point(|(first_index, _)| *first_index <= index.0);
        let (first_index, run) = self.runs.get(after.checked_sub(1)?)?;
        let offset = u32::try_from(index.0 - first_index).ok().filter(|offset| *offset < run.rows)?;
        let Run { subject, instance, camera, first_item, .. } = *run;
        Some(SampleId { subject, item: ItemId(first_item + offset), instance, camera })
    }

    fn kept(&self, index: SampleIndex) -> bool {
        usize::try_from(index.0).ok().and_then(|index| self.flags.get(index)).is_some_and(|flags| flags & KEPT != 0)
    }

    fn split(&self, index: SampleIndex) -> Option<Split> {
        let flags = *self.flags.get(usize::try_from(index.0).ok()?)?;
        Split::ALL.get(usize::from(flags & !KEPT)).copied()
    }
}
