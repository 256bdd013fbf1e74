//! Checks of patches, of their images, and of the table of grasp types.

use super::{
    HeatmapPatch, PatchHeatmap, PatchMetric, PatchTable, PatchTrial, PatchVisibility,
    facts::{OF_PATCHES, OUTCOME, VISIBLE, outcome_number},
};
use crate::{Channel, CheckSample, CheckedRecord, Depth, Facts, Product, ProductChecks, RecordError};
use kernel::ids::SampleId;

/// The checks of patches.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::PATCHES, samples: || Box::new(PatchCheck::default()) };

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
        Ok(CheckedRecord::without_facts(sample))
    }
}

impl PatchCheck {
    fn check_patch(&mut self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        (self.patch, self.heatmap) = (None, None);
        let patch = self.patch.insert(HeatmapPatch::decode(payload)?);
        let facts = Facts::from(patch.facts());
        let mut checked = CheckedRecord::without_facts(patch.sample);
        checked.facts = facts.values().iter().copied().enumerate().take(OF_PATCHES).collect();
        Ok(checked)
    }

    fn check_trial(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let trial = PatchTrial::decode(payload)?;
        self.beside(trial.sample, |patch| trial.check_beside(patch))?;
        let mut checked = CheckedRecord::without_facts(trial.sample);
        checked.facts = vec![(OUTCOME, f64::from(outcome_number(trial.outcome)))];
        Ok(checked)
    }

    fn check_visibility(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let visibility = PatchVisibility::decode(payload)?;
        let heatmap = self.heatmap.as_ref().filter(|heatmap| heatmap.sample == visibility.sample);
        self.beside(visibility.sample, |patch| visibility.check_beside(patch, heatmap))?;
        let mut checked = CheckedRecord::without_facts(visibility.sample);
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
