//! Reading a dataset back: by id, by index, by split, shuffled by chunk.

use std::{
    collections::VecDeque,
    fs,
    path::{Path, PathBuf},
    sync::OnceLock,
};

use super::{
    DatasetError, Ledger, Manifest, ShardEntry, Split, SplitTable,
    index::{IndexEntry, REMAKE_INDEX, read_index},
    layout::{INDEX, SPLITS, has_splits},
    shard_file::{ShardFile, StoredMessage, invalid},
};
use crate::{
    geom::OccupancyGrid,
    ids::{ObjectId, SampleId, SampleIndex, ViewId},
    record::{
        Channel, Cloud, Coverage, Depth, GraspRun, GraspTrials, HeatmapPatch, Implicit, ReachabilityBlock, RecordError,
        TactileContacts, Tsdf, Visibility, VoxelPair,
    },
};

/// A finished dataset, open for reading; any number of threads may read at once.
///
/// Keeps one byte a sample, a few bytes a chunk and no file open; a read holds one chunk.
pub struct DatasetReader {
    folder: PathBuf,
    manifest: Manifest,
    splits: SplitTable,
    table: SampleTable,
    shards: Vec<OnceLock<ShardFile>>,
}

/// Which samples to read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Selection {
    /// Of this split alone.
    pub split: Option<Split>,
    /// Of the models of this nested training subset (a place in [`SplitTable::training_subsets`]) alone.
    pub subset: Option<u32>,
}

impl Selection {
    /// The samples of one split.
    pub fn of(split: Split) -> Self {
        Self { split: Some(split), subset: None }
    }

    /// The training views of a nested training subset.
    pub fn training_subset(subset: u32) -> Self {
        Self { split: Some(Split::Training), subset: Some(subset) }
    }
}

impl DatasetReader {
    /// Opens a finished dataset: reads manifest, splits and index; shards are opened when they are first asked for.
    ///
    /// # Errors
    /// When the dataset is not finished, a table is missing or damaged, or the version is another.
    pub fn open(folder: &Path) -> Result<Self, DatasetError> {
        let manifest = Manifest::read(folder)?;
        let splits = if has_splits(manifest.product) { read_splits(folder)? } else { SplitTable::default() };
        let table = SampleTable::read(&folder.join(INDEX), &manifest)?;
        let shards = manifest.shards.iter().map(|_| OnceLock::new()).collect();
        Ok(Self { folder: folder.to_owned(), splits, manifest, table, shards })
    }

    /// The manifest.
    pub fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    /// Who trains and who tests; empty where the product has no splits.
    pub fn splits(&self) -> &SplitTable {
        &self.splits
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The ledger of a shard (a place in [`Manifest::shards`]): what became of each of its samples, with digests.
    ///
    /// # Errors
    /// When the shard is missing or damaged.
    pub fn ledger(&self, shard: usize) -> Result<Ledger, DatasetError> {
        self.shard(shard)?.ledger()
    }

    /// Place of a sample in the dataset, kept or rejected; `None` when the dataset does not know it.
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

    /// Reads one sample with all its channels; `None` when it was rejected or lies past the end.
    ///
    /// # Errors
    /// When its shard is missing or damaged.
    pub fn sample(&self, index: SampleIndex) -> Result<Option<Sample>, DatasetError> {
        if !self.table.kept(index) {
            return Ok(None);
        }
        let Some((shard, chunk)) = self.place(index)? else { return Ok(None) };
        let samples = self.samples_of(shard, chunk, |other| other == index)?;
        samples.into_iter().next().map_or_else(
            || Err(invalid(&self.shard(shard)?.path, format!("sample {index} is in the index, not in the shard"))),
            |sample| Ok(Some(sample)),
        )
    }

    /// Reads the sample of an id, as [`DatasetReader::sample`]; `None` also when the dataset does not know it. Samples of
    /// one id in two datasets, say pairs here and another kind of touch there, are joined so.
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

    /// Reads a selection in an order drawn from `seed` (and, say, the epoch): chunks in random order, the few samples of
    /// a chunk in random order. One chunk is in memory at a time; neighbours of a chunk stay neighbours, so mix them in
    /// a buffer where that matters.
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

    fn all_chunks(&self, chunks: &mut Vec<(usize, usize)>) -> Result<(), DatasetError> {
        for shard in 0..self.shards.len() {
            let count = self.shard(shard)?.chunks.len();
            chunks.extend((0..count).map(|chunk| (shard, chunk)));
        }
        Ok(())
    }

    fn shard(&self, shard: usize) -> Result<&ShardFile, DatasetError> {
        if let Some(file) = self.shards[shard].get() {
            return Ok(file);
        }
        let path = self.manifest.shard_path(&self.folder, shard);
        let ShardEntry { bytes: saved, first_sample, samples, .. } = self.manifest.shards[shard];
        match fs::metadata(&path) {
            Ok(found) if found.len() != saved => {
                return Err(invalid(&path, format!("it has {} bytes, the manifest says {saved}", found.len())));
            }
            _ => {}
        }
        let file = ShardFile::open(&path)?;
        let end = first_sample + samples;
        if let Some((first, last)) = file.samples()
            && (first < first_sample || last >= end)
        {
            let problem = format!(
                "its chunks hold samples {first} to {last}, the manifest says {first_sample} to {end}, exclusive"
            );
            return Err(invalid(&path, problem));
        }
        Ok(self.shards[shard].get_or_init(|| file))
    }

    fn place(&self, index: SampleIndex) -> Result<Option<(usize, usize)>, DatasetError> {
        let Some(shard) = self.manifest.shard_of(index.0) else { return Ok(None) };
        let file = self.shard(shard)?;
        match file.chunk_of(index) {
            Some(chunk) => Ok(Some((shard, chunk))),
            None => Err(invalid(&file.path, format!("sample {index} is in the index, not in the shard"))),
        }
    }

    /// The samples of a chunk that pass `wanted`, in order.
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
                    .ok_or_else(|| invalid(&file.path, format!("sample {index} is in the shard, not in the index")))?;
                samples.push(Sample { index, id, shard: file.path.clone(), payloads: Vec::new() });
            }
            if let Some(sample) = samples.last_mut() {
                sample.payloads.push((channel, payload));
            }
        }
        Ok(samples)
    }
}

/// One stored sample, all channels joined; channels are decoded when they are asked for.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Place in the dataset.
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

    /// Partial and complete grid, camera, poses.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn pair(&self) -> Result<VoxelPair, DatasetError> {
        let payload = (self.payload(Channel::Pair))
            .ok_or_else(|| invalid(&self.shard, format!("sample {} has no pair", self.index)))?;
        VoxelPair::decode(payload).map_err(|source| self.broken(source))
    }

    /// Cells seen to be free; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn visibility(&self) -> Result<Option<Visibility>, DatasetError> {
        self.decoded(Channel::Visibility, Visibility::decode)
    }

    /// The depth crop; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn depth(&self) -> Result<Option<Depth>, DatasetError> {
        self.decoded(Channel::Depth, Depth::decode)
    }

    /// The partial point cloud; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn cloud(&self) -> Result<Option<Cloud>, DatasetError> {
        self.decoded(Channel::Cloud, Cloud::decode)
    }

    /// Truncated signed distance; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn tsdf(&self) -> Result<Option<Tsdf>, DatasetError> {
        self.decoded(Channel::Tsdf, Tsdf::decode)
    }

    /// Share of each cell that is solid; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn coverage(&self) -> Result<Option<Coverage>, DatasetError> {
        self.decoded(Channel::Coverage, Coverage::decode)
    }

    /// Samples for implicit networks; `None` when not stored.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn implicit(&self) -> Result<Option<Implicit>, DatasetError> {
        self.decoded(Channel::Implicit, Implicit::decode)
    }

    /// Contacts of every kind of touch that is stored, by channel.
    ///
    /// # Errors
    /// When a payload is no valid record.
    pub fn touch(&self) -> Result<Vec<(Channel, TactileContacts)>, DatasetError> {
        let stored = self.payloads.iter().filter(|(channel, _)| channel.is_touch());
        stored
            .map(|(channel, payload)| Ok((*channel, TactileContacts::decode_of(*channel, payload)?)))
            .collect::<Result<_, _>>()
            .map_err(|source| self.broken(source))
    }

    /// The pair joined with all touch of the sample; `None` when no touch is stored.
    ///
    /// # Errors
    /// When a payload is no valid record, or contacts do not fit the pair.
    pub fn touched(&self) -> Result<Option<TouchedPair>, DatasetError> {
        let touch = self.touch()?;
        if touch.is_empty() {
            return Ok(None);
        }
        let pair = self.pair()?;
        let mut tactile = OccupancyGrid::new(pair.grid.resolution);
        for (_, contacts) in &touch {
            contacts.check_beside(&pair).map_err(|source| self.broken(source))?;
            tactile = tactile.either(&contacts.tactile());
        }
        let partial_or_tactile = pair.partial.either(&tactile);
        Ok(Some(TouchedPair { pair, touch, tactile, partial_or_tactile }))
    }

    /// Labels, proofs and witnesses of the poses at one position.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is no valid record.
    pub fn block(&self) -> Result<ReachabilityBlock, DatasetError> {
        let payload = (self.payload(Channel::Block))
            .ok_or_else(|| invalid(&self.shard, format!("sample {} has no block of poses", self.index)))?;
        ReachabilityBlock::decode(payload).map_err(|source| self.broken(source))
    }

    /// One run of annealing and its grasps.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is no valid record.
    pub fn grasp_run(&self) -> Result<GraspRun, DatasetError> {
        let payload = (self.payload(Channel::GraspRun))
            .ok_or_else(|| invalid(&self.shard, format!("sample {} has no run of grasps", self.index)))?;
        GraspRun::decode(payload).map_err(|source| self.broken(source))
    }

    /// Depth and labels around the palm and the fingertips of a grasp.
    ///
    /// # Errors
    /// When the sample is of another product, or the payload is no valid record.
    pub fn heatmap_patch(&self) -> Result<HeatmapPatch, DatasetError> {
        let payload = (self.payload(Channel::Patch))
            .ok_or_else(|| invalid(&self.shard, format!("sample {} has no patches", self.index)))?;
        HeatmapPatch::decode(payload).map_err(|source| self.broken(source))
    }

    /// Trials of the grasps that the run kept; `None` where the dataset has none.
    ///
    /// # Errors
    /// When the payload is no valid record.
    pub fn grasp_trials(&self) -> Result<Option<GraspTrials>, DatasetError> {
        self.decoded(Channel::GraspTrials, GraspTrials::decode)
    }

    pub(super) fn decoded<T>(
        &self,
        channel: Channel,
        decode: impl Fn(&[u8]) -> Result<T, RecordError>,
    ) -> Result<Option<T>, DatasetError> {
        self.payload(channel).map(decode).transpose().map_err(|source| self.broken(source))
    }

    fn broken(&self, source: RecordError) -> DatasetError {
        DatasetError::Record { path: self.shard.clone(), index: self.index, source }
    }
}

/// What a visual-tactile network is trained on: seen, touched, both, and the whole solid, on the pair's grid.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchedPair {
    /// Partial and complete grid, camera, poses.
    pub pair: VoxelPair,
    /// Contacts of each kind of touch.
    pub touch: Vec<(Channel, TactileContacts)>,
    /// Cells that hold a contact of any kind.
    pub tactile: OccupancyGrid,
    /// Cells that were seen or touched: the network's input.
    pub partial_or_tactile: OccupancyGrid,
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
            let place = (u128::from(u64::from_le_bytes(bytes)) * (last as u128 + 1)) >> 64;
            items.swap(last, place as usize);
        }
    }
}

/// The index in memory: runs of consecutive views, and a byte a sample.
#[derive(Default)]
struct SampleTable {
    /// In order of their first sample index.
    runs: Vec<Run>,
    /// Places in `runs`, in order of (subject, instance, camera, first view).
    by_id: Vec<u32>,
    /// Split, and bit 7 for a kept sample.
    flags: Vec<u8>,
}

/// Samples of one subject, instance and camera whose views follow each other as their indices do.
#[derive(Clone, Copy)]
struct Run {
    subject: ObjectId,
    instance: u32,
    camera: u32,
    first_view: u32,
    first_index: u64,
    samples: u32,
}

impl Run {
    fn key(&self) -> (ObjectId, u32, u32, u32) {
        (self.subject, self.instance, self.camera, self.first_view)
    }
}

const KEPT: u8 = 0x80;
/// Instead of a split.
const NO_SPLIT: u8 = 0x7f;

fn read_splits(folder: &Path) -> Result<SplitTable, DatasetError> {
    let path = folder.join(SPLITS);
    let text = fs::read(&path).map_err(DatasetError::io("reading", &path))?;
    let splits: SplitTable = serde_json::from_slice(&text).map_err(|error| DatasetError::Invalid {
        path: path.clone(),
        problem: error.to_string(),
        remedy: "delete manifest.json and `run` the job again: the shards are kept",
    })?;
    splits.checked(&path)
}

impl SampleTable {
    fn read(path: &Path, manifest: &Manifest) -> Result<Self, DatasetError> {
        let (product, samples) = (manifest.product, manifest.counts.samples);
        let mut table = Self { flags: Vec::with_capacity(manifest.foreseen()), ..Self::default() };
        let mut in_order = true;
        read_index(path, product, |index, entry| {
            in_order &= index == table.flags.len() as u64;
            table.push(&entry);
        })?;
        if !in_order || table.flags.len() as u64 != samples {
            let problem = format!("it has {} rows, the manifest says {samples}, in order", table.flags.len());
            return Err(DatasetError::Invalid { path: path.to_owned(), problem, remedy: REMAKE_INDEX });
        }
        table.by_id = (0..table.runs.len() as u32).collect();
        let runs = &table.runs;
        table.by_id.sort_unstable_by_key(|place| runs[*place as usize].key());
        Ok(table)
    }

    fn push(&mut self, entry: &IndexEntry) {
        let index = self.flags.len() as u64;
        self.flags.push(entry.split.map_or(NO_SPLIT, |split| split as u8) | if entry.kept { KEPT } else { 0 });
        let SampleId { subject, instance, view, camera } = entry.sample;
        match self.runs.last_mut() {
            Some(run)
                if (run.subject, run.instance, run.camera) == (subject, instance, camera)
                    && run.first_view.checked_add(run.samples) == Some(view.0) =>
            {
                run.samples += 1;
            }
            _ => self.runs.push(Run { subject, instance, camera, first_view: view.0, first_index: index, samples: 1 }),
        }
    }

    fn find(&self, sample: &SampleId) -> Option<SampleIndex> {
        let key = (sample.subject, sample.instance, sample.camera, sample.view.0);
        let place = self.by_id.partition_point(|place| self.runs[*place as usize].key() <= key);
        let run = self.runs[*self.by_id.get(place.checked_sub(1)?)? as usize];
        let offset = sample.view.0.checked_sub(run.first_view)?;
        let fits = (run.subject, run.instance, run.camera) == (key.0, key.1, key.2) && offset < run.samples;
        fits.then(|| SampleIndex(run.first_index + u64::from(offset)))
    }

    fn id(&self, index: SampleIndex) -> Option<SampleId> {
        let place = self.runs.partition_point(|run| run.first_index <= index.0);
        let run = self.runs.get(place.checked_sub(1)?)?;
        let offset = u32::try_from(index.0 - run.first_index).ok().filter(|offset| *offset < run.samples)?;
        let Run { subject, instance, camera, first_view, .. } = *run;
        Some(SampleId { subject, instance, view: ViewId(first_view + offset), camera })
    }

    fn kept(&self, index: SampleIndex) -> bool {
        usize::try_from(index.0).ok().and_then(|index| self.flags.get(index)).is_some_and(|flags| flags & KEPT != 0)
    }

    fn split(&self, index: SampleIndex) -> Option<Split> {
        let flags = *self.flags.get(usize::try_from(index.0).ok()?)?;
        Split::ALL.get(usize::from(flags & !KEPT)).copied()
    }
}
