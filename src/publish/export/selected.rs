//! The selected samples of an export, one after the other.

use std::collections::BTreeMap;

use super::{error::ExportError, form::ExportSelection, objects::wanted_objects};
use format::{
    Facts,
    dataset::{AssetRow, DatasetError, DatasetReader, Ledger, LedgerRow, Sample, Selection},
};
use kernel::ids::{ObjectId, SampleId, SampleIndex};

/// Names and facts of a selected sample, for tables.
pub(super) struct SelectedSample<'a> {
    /// Index in the dataset.
    pub index: SampleIndex,
    /// The sample.
    pub id: SampleId,
    /// The subject, 64 hexadecimal digits.
    pub subject: String,
    /// Name of the subject.
    pub object: &'a str,
    /// Name of the split; empty if the product has none.
    pub split: &'static str,
    /// Values of the product's facts.
    pub facts: Facts,
}

/// The selected samples of a dataset, in its order.
pub(super) struct SelectedSamples<'a> {
    reader: &'a DatasetReader,
    selection: Selection,
    indices: Vec<SampleIndex>,
    /// Whether every object is selected; shards are then read sequentially.
    all_objects: bool,
    names: BTreeMap<ObjectId, &'a str>,
}

impl<'a> SelectedSamples<'a> {
    /// The samples of a selection; `assets` are the rows of the dataset's asset table.
    ///
    /// # Errors
    /// When an object is unknown, or nothing is selected.
    pub fn of(
        reader: &'a DatasetReader,
        assets: &'a [AssetRow],
        selection: &ExportSelection,
    ) -> Result<Self, ExportError> {
        let wanted = wanted_objects(assets, &selection.objects, reader.manifest().product.subjects.one)?;
        let limit = selection.limit.map_or(usize::MAX, |limit| usize::try_from(limit).unwrap_or(usize::MAX));
        let is_wanted = |index: &SampleIndex| {
            wanted.is_empty() || reader.id(*index).is_some_and(|sample| wanted.contains(&sample.subject))
        };
        let indices: Vec<SampleIndex> = reader.indices(selection.samples).filter(is_wanted).take(limit).collect();
        if indices.is_empty() {
            return Err(ExportError::NothingSelected { kept: reader.manifest().counts.kept });
        }
        let names = assets.iter().map(|row| (row.object, row.name.as_str())).collect();
        Ok(Self { reader, selection: selection.samples, indices, all_objects: wanted.is_empty(), names })
    }

    /// Count of the samples.
    pub fn count(&self) -> u64 {
        self.indices.len() as u64
    }

    /// The samples of each object.
    pub fn by_object(&self) -> BTreeMap<ObjectId, Vec<SampleIndex>> {
        let mut samples = BTreeMap::<_, Vec<_>>::new();
        for index in &self.indices {
            if let Some(id) = self.reader.id(*index) {
                samples.entry(id.subject).or_default().push(*index);
            }
        }
        samples
    }

    /// Calls `take` with every sample, its names and its facts; one chunk and the ledger of one shard are in memory at a time.
    ///
    /// # Errors
    /// When a sample can't be read, and the errors of `take`.
    pub fn each(
        &self,
        mut take: impl FnMut(&Sample, &SelectedSample<'a>) -> Result<(), ExportError>,
    ) -> Result<(), ExportError> {
        let mut ledger: Option<Ledger> = None;
        let mut named = |sample: &Sample| {
            let (index, id) = (sample.index, sample.id);
            let object = self.names.get(&id.subject).copied().unwrap_or_default();
            let split = self.reader.split(index).map_or("", |split| split.name());
            let facts = self.facts_of(index, &mut ledger)?;
            take(sample, &SelectedSample { index, id, subject: id.subject.to_string(), object, split, facts })
        };
        if self.all_objects {
            for sample in self.reader.iter(self.selection).take(self.indices.len()) {
                named(&sample?)?;
            }
        } else {
            for index in &self.indices {
                if let Some(sample) = self.reader.sample(*index)? {
                    named(&sample)?;
                }
            }
        }
        Ok(())
    }

    /// Facts of a sample from the ledger of its shard, which is kept for the next sample.
    fn facts_of(&self, index: SampleIndex, kept: &mut Option<Ledger>) -> Result<Facts, ExportError> {
        let manifest = self.reader.manifest();
        let ledger = match kept.take().filter(|ledger| row_of(ledger, index).is_some()) {
            Some(ledger) => ledger,
            None => self.reader.ledger(manifest.shard_of(index.0).unwrap_or_default())?,
        };
        let ledger = kept.insert(ledger);
        row_of(ledger, index).map(|row| row.facts.clone()).ok_or_else(|| {
            let (path, problem) = (self.reader.folder().path().to_owned(), format!("no ledger has sample {index}"));
            DatasetError::Invalid { path, problem, remedy: "`verify` the dataset" }.into()
        })
    }
}

/// The row of a sample in a ledger; `None` if the ledger is of another shard.
fn row_of(ledger: &Ledger, index: SampleIndex) -> Option<&LedgerRow> {
    ledger.rows.get(usize::try_from(index.0.checked_sub(ledger.first.0)?).ok()?)
}
