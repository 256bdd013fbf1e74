//! Checks of the records of an amodal sample.

use super::{Clutter, facts::FIRST_OF_CLUTTER};
use crate::{
    BrokenRule, Channel, CheckSample, CheckedRecord, Facts, PARTIAL_INSIDE_COMPLETE, Product, ProductChecks,
    RecordError, VoxelPair, products::completion::check_touch,
};

/// The checks of amodal pairs.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::AMODAL, samples: || Box::new(AmodalCheck::default()) };

/// Checks of one thread; remembers the pair of the sample.
#[derive(Default)]
struct AmodalCheck {
    pair: Option<VoxelPair>,
}

impl CheckSample for AmodalCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        match channel {
            Channel::AMODAL_PAIR => self.check_pair(payload),
            Channel::CLUTTER => self.check_clutter(payload),
            touch => check_touch(touch, payload, self.pair.as_ref()),
        }
    }
}

impl AmodalCheck {
    fn check_pair(&mut self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        self.pair = None;
        let pair = self.pair.insert(VoxelPair::decode(payload)?);
        let mut checked = CheckedRecord::without_facts(pair.sample);
        let facts = Facts::from(pair.facts());
        checked.facts = facts.values().iter().copied().enumerate().take(FIRST_OF_CLUTTER).collect();
        let outside = pair.partial_cells - pair.both_cells;
        if outside > 0 {
            let what = format!("{outside} of {} partial cells are not in complete", pair.partial_cells);
            checked.broken_rules.push(BrokenRule { rule: PARTIAL_INSIDE_COMPLETE, what });
        }
        Ok(checked)
    }

    fn check_clutter(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let clutter = Clutter::decode(payload)?;
        if let Some(pair) = self.pair.as_ref().filter(|pair| pair.sample == clutter.sample) {
            clutter.check_beside(pair)?;
        }
        let mut checked = CheckedRecord::without_facts(clutter.sample);
        checked.facts = clutter.stated_facts();
        Ok(checked)
    }
}
