//! Checks of scenes.

use super::Scene;
use crate::{Channel, CheckSample, CheckedRecord, Facts, Product, ProductChecks, RecordError};

/// The checks of scenes.
pub(crate) static CHECKS: ProductChecks = ProductChecks { product: Product::SCENES, samples: || Box::new(SceneCheck) };

/// Checks of one thread: a sample has one record.
struct SceneCheck;

impl CheckSample for SceneCheck {
    fn check(&mut self, _: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let record = Scene::decode(payload)?;
        let mut checked = CheckedRecord::without_facts(record.sample);
        checked.facts = Facts::from(record.facts()).values().iter().copied().enumerate().collect();
        Ok(checked)
    }
}
