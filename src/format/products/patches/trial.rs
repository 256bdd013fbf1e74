//! Trials of the grasp of some patches, and the labels that they determine.

use prost::Message;

use super::{HeatmapPatch, PATCH_POINTS, TRIAL_LABEL, arrays::flags};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, named, ranged},
    proto, sample_from_proto, wire,
};
use crate::products::grasps::{GraspLabel, TrialVerdict};
use kernel::{
    ids::{Digest, SampleId},
    words::GraspVerdict,
};

const MESSAGE: &str = "PatchTrial";

/// Trial of the grasp of some patches, and which numbers of their labels it determines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PatchTrial {
    /// Which sample: that of the [`HeatmapPatch`].
    pub sample: SampleId,
    /// Root digest of the physics numbers of the dataset that holds the trial.
    pub trials: Digest,
    /// Combined label of all trials of the grasp.
    pub outcome: GraspLabel,
    /// End of the trial in the air.
    pub trial: TrialVerdict,
    /// Verdict of the analytic criteria.
    pub verdict: GraspVerdict,
    /// Whether trials determine a number of the label vectors: a mask for training. Shape (points, 4 * types), row-major.
    pub tested: Vec<bool>,
}

/// The number in a label vector: -1 for a grasp that held, 1 for one that failed, and 0 if trials do not decide.
pub fn trial_value(outcome: GraspLabel) -> f32 {
    match outcome {
        GraspLabel::Held => -1.0,
        GraspLabel::Failed => 1.0,
        GraspLabel::Borderline | GraspLabel::Untested | GraspLabel::Unconfirmed => 0.0,
    }
}

impl PatchTrial {
    /// The mask of labels: of the type at `type_index` of `types` each point's own number if trials decide.
    pub fn mask(outcome: GraspLabel, type_index: u32, types: usize) -> Vec<bool> {
        let each = PATCH_POINTS * types;
        let mut mask = vec![false; PATCH_POINTS * each];
        for point in 0..PATCH_POINTS {
            mask[point * each + PATCH_POINTS * type_index as usize + point] = trial_value(outcome) != 0.0;
        }
        mask
    }

    /// Checks that the labels of `patch` are those of these trials, and that the mask marks the known numbers.
    ///
    /// # Errors
    /// When they are not.
    pub fn check_beside(&self, patch: &HeatmapPatch) -> Result<(), RecordError> {
        named(MESSAGE, "label", &patch.label, &[TRIAL_LABEL])?;
        let value = f64::from(patch.value);
        ranged(MESSAGE, "outcome", value, patch.value == trial_value(self.outcome), "that of the labels")?;
        let mask = Self::mask(self.outcome, patch.type_index, patch.types.len());
        lengthy(MESSAGE, "tested", mask.len(), self.tested.len())?;
        let known = self.tested.iter().filter(|known| **known).count();
        ranged(MESSAGE, "tested", known as f64, self.tested == mask, "the numbers that the outcome determines")
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::bytes(out, 2, &self.trials.0);
        wire::bytes(out, 3, self.outcome.name().as_bytes());
        wire::bytes(out, 4, self.trial.name().as_bytes());
        wire::bytes(out, 5, self.verdict.name().as_bytes());
        wire::bytes_of(out, 6, self.tested.iter().map(|known| u8::from(*known)));
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a word is unknown, or a length or a number of the mask does not hold.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PatchTrial::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        lengthy(MESSAGE, "trials", 32, raw.trials.len())?;
        let outcome = worded("outcome", &raw.outcome, &GraspLabel::ALL, GraspLabel::name)?;
        let trial = worded("trial", &raw.trial, &TrialVerdict::ALL, TrialVerdict::name)?;
        let verdict = worded("verdict", &raw.verdict, &GraspVerdict::ALL, GraspVerdict::name)?;
        Ok(Self {
            sample,
            trials: Digest(raw.trials.try_into().unwrap_or_default()),
            outcome,
            trial,
            verdict,
            tested: flags(MESSAGE, "tested", &raw.tested)?,
        })
    }
}

/// The value that has this name.
fn worded<T: Copy>(
    field: &'static str,
    found: &str,
    values: &[T],
    name: fn(T) -> &'static str,
) -> Result<T, RecordError> {
    let names: Vec<&str> = values.iter().map(|value| name(*value)).collect();
    named(MESSAGE, field, found, &names)?;
    Ok(values[names.iter().position(|name| *name == found).expect("the name is known")])
}
