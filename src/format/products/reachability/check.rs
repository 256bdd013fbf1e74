//! Checks of blocks of poses.

use super::ReachabilityBlock;
use crate::{Channel, CheckSample, CheckedRecord, Facts, Product, ProductChecks, RecordError};

/// The checks of reachability.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::REACHABILITY, samples: || Box::new(BlockCheck) };

/// Checks of one thread: a position has one record.
struct BlockCheck;

impl CheckSample for BlockCheck {
    fn check(&mut self, _: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let block = ReachabilityBlock::decode(payload)?;
        let facts = Facts::from(block.facts());
        let mut checked = CheckedRecord::without_facts(block.sample);
        checked.facts = facts.values().iter().copied().enumerate().collect();
        Ok(checked)
    }
}
