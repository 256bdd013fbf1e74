//! Pairs of a completion dataset, streamed to the formats that hold them.

use std::collections::BTreeMap;

use super::{
    error::ExportError,
    form::{ExportSelection, Written},
    names::object_folders,
    objects::wanted_objects,
    pair::PairSample,
    table::SampleTable,
    target::Target,
};
use format::{
    VoxelPair,
    dataset::{DatasetReader, Sample},
};
use kernel::ids::{ObjectId, SampleIndex};

/// Facts of an export that a format needs before its first sample.
pub(super) struct PairStream {
    /// Samples that will come.
    pub samples: u64,
    /// Root digest of the dataset.
    pub root: String,
    /// One byte per cell.
    pub unpacked: bool,
}

/// A format that pairs stream to.
pub(super) trait WritePairs {
    /// Whether samples have files of their own, named by [`PairSample::stem`].
    const FILE_PER_SAMPLE: bool;

    /// Writes a sample.
    ///
    /// # Errors
    /// When a file cannot be written, or the sample does not fit the format.
    fn write(&mut self, sample: &PairSample<'_>, target: &mut Target) -> Result<(), ExportError>;

    /// Closes the files.
    ///
    /// # Errors
    /// When a file cannot be written.
    fn finish(self) -> Result<(), ExportError>;
}

/// Streams the selected samples to a format, in the dataset's order, and writes `samples.csv`.
pub(super) fn write_pairs<W: WritePairs>(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
    open: impl FnOnce(PairStream) -> W,
) -> Result<Written, ExportError> {
    // 1. The samples, by index.
    let assets = reader.assets()?.objects;
    let wanted = wanted_objects(&assets, &selection.objects)?;
    let limit = selection.limit.map_or(usize::MAX, |limit| usize::try_from(limit).unwrap_or(usize::MAX));
    let indices: Vec<SampleIndex> = (reader.indices(selection.samples))
        .filter(|index| wanted.is_empty() || reader.id(*index).is_some_and(|sample| wanted.contains(&sample.subject)))
        .take(limit)
        .collect();
    if indices.is_empty() {
        return Err(ExportError::NothingSelected { kept: reader.manifest().counts.kept });
    }
    let samples = indices.len() as u64;
    // 2. One sample after the other.
    let names: BTreeMap<ObjectId, &str> = assets.iter().map(|row| (row.object, row.name.as_str())).collect();
    let folders = object_folders(&assets);
    let mut table = SampleTable::create(target)?;
    let root = reader.manifest().root.to_string();
    let mut writer = open(PairStream { samples, root, unpacked: selection.unpacked });
    let mut take = |sample: &Sample| -> Result<(), ExportError> {
        let (pair, touched) = (sample.pair()?, sample.touched()?);
        let object = names.get(&sample.id.subject).copied().unwrap_or_default();
        let split = reader.split(sample.index).map_or("", |split| split.name());
        let stem = if W::FILE_PER_SAMPLE { stem(&folders, &pair) } else { String::new() };
        let sample = PairSample { sample, pair: &pair, touched: touched.as_ref(), object, split, stem: &stem };
        table.row(&sample)?;
        writer.write(&sample, target)
    };
    // Shards are read from end to end where every object is wanted.
    if wanted.is_empty() {
        for sample in reader.iter(selection.samples).take(limit) {
            take(&sample?)?;
        }
    } else {
        for index in indices {
            if let Some(sample) = reader.sample(index)? {
                take(&sample)?;
            }
        }
    }
    writer.finish()?;
    table.finish()?;
    Ok(Written::selection(samples, "samples", selection))
}

/// `<object>/view_00003`, with instance and camera where they are not the first.
fn stem(folders: &BTreeMap<ObjectId, String>, pair: &VoxelPair) -> String {
    let id = pair.sample;
    let folder = folders.get(&id.subject).cloned().unwrap_or_else(|| id.subject.0.short());
    let mut stem = format!("{folder}/view_{:05}", id.item.0);
    if (id.instance, id.camera) != (0, 0) {
        stem.push_str(&format!("_instance_{}_camera_{}", id.instance, id.camera));
    }
    stem
}
