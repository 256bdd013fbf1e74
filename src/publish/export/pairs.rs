//! Pairs of a completion dataset, streamed to the formats that support them.

use std::collections::BTreeMap;

use serde_json::{Map, Value};

use super::{
    error::ExportError,
    form::{ExportSelection, Written},
    names::object_folders,
    pair::PairSample,
    selected::SelectedSamples,
    table::SampleTable,
    target::Target,
};
use format::{
    VoxelPair,
    dataset::{AssetTable, DatasetReader},
};
use kernel::ids::ObjectId;

/// Facts about an export that a format needs before the first sample.
pub(super) struct PairStream {
    /// Number of samples.
    pub samples: u64,
    /// One byte per cell.
    pub unpacked: bool,
}

/// A format that pairs stream to.
pub(super) trait WritePairs {
    /// Whether each sample has separate files, named by [`PairSample::stem`].
    const FILE_PER_SAMPLE: bool;

    /// Writes a sample.
    ///
    /// # Errors
    /// When a file cannot be written, or the sample does not fit the format.
    fn write(&mut self, sample: &PairSample<'_>, target: &mut Target) -> Result<(), ExportError>;

    /// Closes the files; returns further facts for `export.json`.
    ///
    /// # Errors
    /// When a file cannot be written.
    fn finish(self, target: &mut Target) -> Result<Map<String, Value>, ExportError>;
}

/// Streams the selected samples to a format, in the dataset's order, and writes `samples.csv`.
pub(super) fn write_pairs<W: WritePairs>(
    reader: &DatasetReader,
    selection: &ExportSelection,
    target: &mut Target,
    open: impl FnOnce(PairStream) -> W,
) -> Result<Written, ExportError> {
    let AssetTable { objects, subjects, .. } = reader.assets()?;
    // The subjects of pairs in clutter are scenes.
    let assets = if reader.manifest().product.subjects_are_objects { objects } else { subjects };
    let selected = SelectedSamples::of(reader, &assets, selection)?;
    let samples = selected.count();
    let folders = object_folders(&assets);
    let mut table = SampleTable::create(target)?;
    let mut writer = open(PairStream { samples, unpacked: selection.unpacked });
    selected.each(|sample, names| {
        let (pair, touched) = (sample.read::<VoxelPair>()?, sample.touched()?);
        let stem = if W::FILE_PER_SAMPLE { stem(&folders, &pair) } else { String::new() };
        let sample = PairSample { sample, pair: &pair, touched: touched.as_ref(), names, stem: &stem };
        table.row(&sample)?;
        writer.write(&sample, target)
    })?;
    let facts = writer.finish(target)?;
    table.finish()?;
    let mut written = Written::selection(samples, "samples", selection);
    written.facts.extend(facts);
    Ok(written)
}

/// `<object>/view_00003`, with instance and camera if they are not the first.
fn stem(folders: &BTreeMap<ObjectId, String>, pair: &VoxelPair) -> String {
    let id = pair.sample;
    let folder = folders.get(&id.subject).cloned().unwrap_or_else(|| id.subject.0.short());
    let mut stem = format!("{folder}/view_{:05}", id.item.0);
    if (id.instance, id.camera) != (0, 0) {
        stem.push_str(&format!("_instance_{}_camera_{}", id.instance, id.camera));
    }
    stem
}
