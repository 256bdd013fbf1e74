//! Checks of runs, of their trials, and of the shapes beside them.

use super::{GraspRun, GraspTrials, SHAPES, Shapes, facts::FIRST_OF_TRIALS};
use crate::{
    Channel, CheckSample, CheckedRecord, Facts, FileCheck, FileContext, Product, ProductChecks, RecordError,
    dataset::DatasetError,
};
use kernel::{
    ids::{ObjectId, SampleId},
    words::GraspVerdict,
};

/// The checks of grasps.
pub(crate) static CHECKS: ProductChecks = ProductChecks {
    product: Product::GRASPS,
    samples: || Box::new(RunCheck::default()),
    files: &[FileCheck { name: SHAPES, in_root: None, check: check_shapes }],
};

/// Checks of one thread; remembers whose run it saw, and the indices of its kept grasps.
#[derive(Default)]
struct RunCheck {
    kept: Option<(SampleId, Vec<u32>)>,
}

impl CheckSample for RunCheck {
    fn check(&mut self, channel: Channel, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        if channel == Channel::GRASP_RUN { self.check_run(payload) } else { self.check_trials(payload) }
    }
}

impl RunCheck {
    fn check_run(&mut self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let run = GraspRun::decode(payload)?;
        let kept = (0..).zip(&run.grasps).filter(|(_, grasp)| grasp.verdict == GraspVerdict::Kept);
        self.kept = Some((run.sample, kept.map(|(index, _)| index).collect()));
        let facts = Facts::from(run.facts());
        let of_trials = FIRST_OF_TRIALS..FIRST_OF_TRIALS + 3;
        let mut checked = CheckedRecord::of(run.sample);
        checked.facts =
            (facts.values().iter().copied().enumerate()).filter(|(fact, _)| !of_trials.contains(fact)).collect();
        Ok(checked)
    }

    fn check_trials(&self, payload: &[u8]) -> Result<CheckedRecord, RecordError> {
        let trials = GraspTrials::decode(payload)?;
        if let Some((_, kept)) = self.kept.as_ref().filter(|(sample, _)| *sample == trials.sample) {
            trials.check_beside(kept)?;
        }
        let mut checked = CheckedRecord::of(trials.sample);
        checked.facts = (FIRST_OF_TRIALS..).zip(trials.facts().values()).collect();
        Ok(checked)
    }
}

/// Checks the shapes against the asset table.
fn check_shapes(context: &FileContext<'_>) -> Vec<String> {
    if !context.full {
        return Vec::new();
    }
    let mut objects: Vec<ObjectId> = context.objects.to_vec();
    objects.sort_unstable();
    let checked = Shapes::open(context.folder).and_then(|shapes| {
        shapes.check(context.hands.first().copied(), &objects)?;
        shapes.trial_hand()
    });
    match checked {
        Ok(_) => Vec::new(),
        Err(DatasetError::Invalid { problem, .. }) => vec![problem],
        Err(error) => vec![error.to_string()],
    }
}
