//! Checks of heatmaps, and of their depth.

use super::{HeatmapFacts, SceneHeatmap};
use crate::{Channel, CheckSample, CheckedRecord, Depth, Facts, Product, ProductChecks, RecordError};

/// The checks of heatmaps.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::HEATMAPS, samples: || Box::new(HeatmapCheck::default()) };

/// Checks of one thread; remembers the grasps of the sample.
#[derive(Default)]
struct HeatmapCheck {
    seen: Option<SceneHeatmap>,
}

impl CheckSample for HeatmapCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        if channel == Channel::HEATMAP_GRASPS {
            self.seen = None;
            let heatmap = self.seen.insert(SceneHeatmap::decode(payload)?);
            let mut checked = CheckedRecord::without_facts(heatmap.sample);
            let facts = Facts::from(HeatmapFacts::from_heatmap(heatmap));
            checked.facts = facts.values().iter().copied().enumerate().collect();
            return Ok(checked);
        }
        let depth = Depth::decode(payload)?;
        if let Some(heatmap) = self.seen.as_ref().filter(|seen| seen.sample == depth.sample) {
            heatmap.check_depth(&depth)?;
        }
        Ok(CheckedRecord::without_facts(depth.sample))
    }
}
