//! Checks of patches, of the images beside them, and of the table of grasp types.

use std::collections::BTreeMap;

use super::{HeatmapPatch, PatchHeatmap, TYPES, facts::TYPE, types_file::read_types};
use crate::{
    Channel, CheckSample, CheckedRecord, Depth, Facts, FileCheck, FileContext, Product, ProductChecks, RecordError,
    dataset::{DatasetError, DatasetReader},
};

/// The checks of patches.
pub(crate) static CHECKS: ProductChecks = ProductChecks {
    product: Product::PATCHES,
    samples: || Box::new(PatchCheck::default()),
    files: &[FileCheck { name: TYPES, in_root: None, check: check_types }],
};

/// Checks of one thread; remembers the patches of the sample.
#[derive(Default)]
struct PatchCheck {
    patch: Option<HeatmapPatch>,
}

impl CheckSample for PatchCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let sample = match channel {
            Channel::PATCH => return self.check_patch(payload),
            Channel::PATCH_IMAGE => {
                let image = Depth::decode(payload)?;
                if let Some(patch) = self.patch.as_ref().filter(|patch| patch.sample == image.sample) {
                    patch.check_image(&image)?;
                }
                image.sample
            }
            _ => {
                let heatmap = PatchHeatmap::decode(payload)?;
                if let Some(patch) = self.patch.as_ref().filter(|patch| patch.sample == heatmap.sample) {
                    heatmap.check_beside(patch)?;
                }
                heatmap.sample
            }
        };
        Ok(CheckedRecord::of(sample))
    }
}

impl PatchCheck {
    fn check_patch(&mut self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        self.patch = None;
        let patch = self.patch.insert(HeatmapPatch::decode(payload)?);
        let facts = Facts::from(patch.facts());
        let mut checked = CheckedRecord::of(patch.sample);
        checked.facts = facts.values().iter().copied().enumerate().collect();
        Ok(checked)
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
