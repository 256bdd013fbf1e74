//! Checks of suction.

use super::{SuctionFacts, SuctionPoses};
use crate::{Channel, CheckSample, CheckedRecord, Facts, Product, ProductChecks, RecordError};

/// The checks of suction.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::SUCTION, samples: || Box::new(SuctionCheck) };

/// Checks of one thread.
struct SuctionCheck;

impl CheckSample for SuctionCheck {
    fn check(&mut self, _: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let poses = SuctionPoses::decode(payload)?;
        let mut checked = CheckedRecord::without_facts(poses.sample);
        let facts = Facts::from(SuctionFacts::from_poses(&poses));
        checked.facts = facts.values().iter().copied().enumerate().collect();
        Ok(checked)
    }
}
