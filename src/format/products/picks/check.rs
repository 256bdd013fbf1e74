//! Checks of picks.

use super::{
    PickCandidates, PickFacts, PickSampling, PickTrials,
    facts::{FIRST_OF_SAMPLING, FIRST_OF_TRIALS, PickSamplingFacts, PickTrialFacts},
};
use crate::{Channel, CheckSample, CheckedRecord, Product, ProductChecks, RecordError};

/// The checks of picks.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::PICKS, samples: || Box::new(PickCheck::default()) };

/// Checks of one thread; remembers the candidates of the sample.
#[derive(Default)]
struct PickCheck {
    seen: Option<PickCandidates>,
}

impl CheckSample for PickCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        if channel == Channel::PICK_CANDIDATES {
            self.seen = None;
            let candidates = self.seen.insert(PickCandidates::decode(payload)?);
            let mut checked = CheckedRecord::without_facts(candidates.sample);
            checked.facts =
                PickFacts::from_candidates(candidates, None, None).values().into_iter().enumerate().collect();
            return Ok(checked);
        }
        if channel == Channel::PICK_SAMPLING {
            let sampling = PickSampling::decode(payload)?;
            if let Some(candidates) = self.seen.as_ref().filter(|seen| seen.sample == sampling.sample) {
                sampling.check_beside(candidates)?;
            }
            let mut checked = CheckedRecord::without_facts(sampling.sample);
            checked.facts = (FIRST_OF_SAMPLING..).zip(PickSamplingFacts::from_sampling(&sampling).values()).collect();
            return Ok(checked);
        }
        let trials = PickTrials::decode(payload)?;
        if let Some(candidates) = self.seen.as_ref().filter(|seen| seen.sample == trials.sample) {
            trials.check_beside(candidates)?;
        }
        let mut checked = CheckedRecord::without_facts(trials.sample);
        checked.facts = (FIRST_OF_TRIALS..).zip(PickTrialFacts::from_trials(&trials).values()).collect();
        Ok(checked)
    }
}
