//! Checks of volumes.

use super::{GraspsInVolume, SceneVolume, VolumeAffordance, VolumeTruth, facts::FIRST_OF_GRASPS};
use crate::{Channel, CheckSample, CheckedRecord, Product, ProductChecks, RecordError};

/// The checks of volumes.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::VOLUMES, samples: || Box::new(VolumeCheck::default()) };

/// Checks of one thread; remembers the volume of the sample.
#[derive(Default)]
struct VolumeCheck {
    volume: Option<SceneVolume>,
}

impl CheckSample for VolumeCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        if channel == Channel::VOLUME_FUSION {
            self.volume = None;
            let volume = self.volume.insert(SceneVolume::decode(payload)?);
            let mut checked = CheckedRecord::without_facts(volume.sample);
            checked.facts = volume.stated_facts();
            return Ok(checked);
        }
        if channel == Channel::VOLUME_AFFORDANCE {
            let affordance = VolumeAffordance::decode(payload)?;
            if let Some(volume) = self.volume.as_ref().filter(|volume| volume.sample == affordance.sample) {
                affordance.check_beside(volume)?;
            }
            let mut checked = CheckedRecord::without_facts(affordance.sample);
            let counts = GraspsInVolume::from_affordance(&affordance).values();
            checked.facts = (FIRST_OF_GRASPS..).zip(counts.map(f64::from)).collect();
            return Ok(checked);
        }
        let truth = VolumeTruth::decode(payload)?;
        if let Some(volume) = self.volume.as_ref().filter(|volume| volume.sample == truth.sample) {
            truth.check_beside(volume)?;
        }
        let mut checked = CheckedRecord::without_facts(truth.sample);
        checked.facts = truth.stated_facts();
        Ok(checked)
    }
}
