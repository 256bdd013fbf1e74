//! Checks of runs and of their trials.

use super::{
    GraspLadders, GraspRun, GraspTrials,
    facts::{FIRST_OF_LADDER, FIRST_OF_TRIALS, LADDER_FACTS, TRIAL_FACTS},
};
use crate::{Channel, CheckSample, CheckedRecord, Facts, Product, ProductChecks, RecordError};
use kernel::{ids::SampleId, words::GraspVerdict};

/// The checks of grasps.
pub(crate) static CHECKS: ProductChecks =
    ProductChecks { product: Product::GRASPS, samples: || Box::new(RunCheck::default()) };

/// Checks of one thread; remembers whose run it saw, the verdicts on its states and the number of its resting poses.
#[derive(Default)]
struct RunCheck {
    seen: Option<(SampleId, Vec<GraspVerdict>, u32)>,
}

impl CheckSample for RunCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        if channel == Channel::GRASP_RUN {
            self.check_run(payload)
        } else if channel == Channel::GRASP_LADDERS {
            self.check_ladders(payload)
        } else {
            self.check_trials(payload)
        }
    }
}

impl RunCheck {
    fn check_run(&mut self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let run = GraspRun::decode(payload)?;
        let verdicts = run.grasps.iter().map(|grasp| grasp.verdict).collect();
        self.seen = Some((run.sample, verdicts, run.resting_poses));
        let facts = Facts::from(run.facts());
        let of_trials = FIRST_OF_TRIALS..FIRST_OF_TRIALS + TRIAL_FACTS;
        let of_ladder = FIRST_OF_LADDER..FIRST_OF_LADDER + LADDER_FACTS;
        let is_of_run = |fact: usize| !of_trials.contains(&fact) && !of_ladder.contains(&fact);
        let mut checked = CheckedRecord::without_facts(run.sample);
        checked.facts = facts.values().iter().copied().enumerate().filter(|(fact, _)| is_of_run(*fact)).collect();
        Ok(checked)
    }

    fn check_trials(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let trials = GraspTrials::decode(payload)?;
        if let Some((_, verdicts, poses)) = self.seen.as_ref().filter(|(sample, ..)| *sample == trials.sample) {
            trials.check_beside(verdicts, *poses)?;
        }
        let mut checked = CheckedRecord::without_facts(trials.sample);
        checked.facts = (FIRST_OF_TRIALS..).zip(trials.facts().values()).collect();
        Ok(checked)
    }

    fn check_ladders(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let ladders = GraspLadders::decode(payload)?;
        if let Some((_, verdicts, poses)) = self.seen.as_ref().filter(|(sample, ..)| *sample == ladders.sample) {
            ladders.check_beside(verdicts, *poses)?;
        }
        let mut checked = CheckedRecord::without_facts(ladders.sample);
        checked.facts = (FIRST_OF_LADDER..).zip(ladders.facts().values()).collect();
        Ok(checked)
    }
}
