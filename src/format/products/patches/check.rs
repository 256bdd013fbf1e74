//! Checks of patches, of their images, and of the table of grasp types.

use std::collections::BTreeMap;

use super::{
    HeatmapPatch, PatchHeatmap, PatchMetric, PatchTable, PatchTrial, PatchVisibility, TYPES,
    facts::{OF_PATCHES, OUTCOME, TYPE, VISIBLE, outcome_number},
    types_file::read_types,
};
use crate::{
    Channel, CheckSample, CheckedRecord, Depth, Facts, FileCheck, FileContext, Product, ProductChecks, RecordError,
    dataset::{DatasetError, DatasetReader},
};
use kernel::ids::SampleId;

/// The checks of patches.
pub(crate) static CHECKS: ProductChecks = ProductChecks {
    product: Product::PATCHES,
    samples: || Box::new(PatchCheck::default()),
    files: &[FileCheck { name: TYPES, in_root: None, check: check_types }],
};

/// Checks of one thread; remembers the patches of the sample, and its heatmap.
#[derive(Default)]
struct PatchCheck {
    patch: Option<HeatmapPatch>,
    heatmap: Option<PatchHeatmap>,
}

impl CheckSample for PatchCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let sample = match channel {
            Channel::PATCH => return self.check_patch(payload),
            Channel::PATCH_TRIAL => return self.check_trial(payload),
            Channel::PATCH_VISIBILITY => return self.check_visibility(payload),
            Channel::PATCH_IMAGE => {
                let image = Depth::decode(payload)?;
                self.beside(image.sample, |patch| patch.check_image(&image))?;
                image.sample
            }
            Channel::PATCH_METRIC => {
                let metric = PatchMetric::decode(payload)?;
                self.beside(metric.sample, |patch| metric.check_beside(patch))?;
                metric.sample
            }
            Channel::PATCH_TABLE => {
                let table = PatchTable::decode(payload)?;
                self.beside(table.sample, |patch| table.check_beside(patch))?;
                table.sample
            }
            _ => {
                let heatmap = PatchHeatmap::decode(payload)?;
                self.beside(heatmap.sample, |patch| heatmap.check_beside(patch))?;
                self.heatmap.insert(heatmap).sample
            }
        };
        Ok(CheckedRecord::of(sample))
    }
}

impl PatchCheck {
    fn check_patch(&mut self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        (self.patch, self.heatmap) = (None, None);
        let patch = self.patch.insert(HeatmapPatch::decode(payload)?);
        let facts = Facts::from(patch.facts());
        let mut checked = CheckedRecord::of(patch.sample);
        checked.facts = facts.values().iter().copied().enumerate().take(OF_PATCHES).collect();
        Ok(checked)
    }

    fn check_trial(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let trial = PatchTrial::decode(payload)?;
        self.beside(trial.sample, |patch| trial.check_beside(patch))?;
        let mut checked = CheckedRecord::of(trial.sample);
        checked.facts = vec![(OUTCOME, f64::from(outcome_number(trial.outcome)))];
        Ok(checked)
    }

    fn check_visibility(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let visibility = PatchVisibility::decode(payload)?;
        let heatmap = self.heatmap.as_ref().filter(|heatmap| heatmap.sample == visibility.sample);
        self.beside(visibility.sample, |patch| visibility.check_beside(patch, heatmap))?;
        let mut checked = CheckedRecord::of(visibility.sample);
        checked.facts = vec![(VISIBLE, f64::from(visibility.count()))];
        Ok(checked)
    }

    /// Checks something against the patches of the same sample, where they were seen.
    fn beside(
        &self,
        sample: SampleId,
        check: impl FnOnce(&HeatmapPatch) -> Result<(), RecordError>,
    ) -> Result<(), RecordError> {
        self.patch.as_ref().filter(|patch| patch.sample == sample).map_or(Ok(()), check)
    }
}

/// Checks the counts of the chosen types against the samples: each grasp of a chosen type is one sample.
fn check_types(context: &FileContext<'_>) -> Vec<String> {
    let words = |error: DatasetError| match error {
        DatasetError::Invalid { problem, .. } => problem,
        other => other.to_string(),
    };
    let types = match read_types(context.folder) {
        Ok(types) => types,
        Err(error) => return vec![words(error)],
    };
    let Some(reader) = context.reader.filter(|_| context.shards_intact) else { return Vec::new() };
    let counted = match count_types(reader) {
        Ok(counted) => counted,
        Err(error) => return vec![words(error)],
    };
    let count_of = |kind: &u32| (*kind, types.counts.get(kind).copied().unwrap_or(0));
    let stated: BTreeMap<u32, u64> = types.chosen.iter().map(count_of).collect();
    let differs = stated != counted;
    let what = || format!("its grasps of the chosen types are {stated:?}, those of the samples {counted:?}");
    differs.then(what).into_iter().collect()
}

/// Samples of each grasp type, kept or rejected.
fn count_types(reader: &DatasetReader) -> Result<BTreeMap<u32, u64>, DatasetError> {
    let mut counts = BTreeMap::new();
    for shard in 0..reader.manifest().shards.len() {
        for row in reader.ledger(shard)?.rows {
            *counts.entry(row.facts.integer(TYPE)).or_default() += 1;
        }
    }
    Ok(counts)
}
