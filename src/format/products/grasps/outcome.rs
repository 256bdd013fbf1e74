//! Outcome of one trial of a grasp.

use super::TrialVerdict;
use crate::codec::{
    RecordError,
    fields::{lengthy, ranged},
    proto, wire,
};

pub(super) const MESSAGE: &str = "GraspTrials";

/// Outcome of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialOutcome {
    /// Verdict on the trial.
    pub verdict: TrialVerdict,
    /// Since it began, when it was decided [s].
    pub time: f64,
    /// Duration of closing [s].
    pub closing_time: f64,
    /// Whether it had come to rest then.
    pub closed_at_rest: bool,
    /// Penetration of the object by the hand [m]: when it began, when gravity was switched on, and the largest after that.
    pub penetration: [f64; 3],
    /// Largest distance of the object from where it was in the hand when gravity was switched on [m].
    pub farthest: f64,
    /// Translation [m] and rotation [rad] of the object per phase that it survived.
    pub slips: Vec<[f64; 2]>,
    /// Sum of the normal forces when gravity was switched on [N].
    pub force: f64,
    /// Links that touched in the end.
    pub links: u32,
    /// Share of their range that the fingers backed off before it began, 0 to 1.
    pub opened_by: f64,
    /// Distance that the hand drew back [m].
    pub drawn_back: f64,
    /// Number of MuJoCo's warnings.
    pub warnings: u32,
}

impl TrialOutcome {
    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        wire::uint32(out, 1, self.verdict as u32);
        wire::double(out, 2, self.time);
        wire::double(out, 3, self.closing_time);
        wire::uint32(out, 4, u32::from(self.closed_at_rest));
        for (field, depth) in (5..).zip(self.penetration) {
            wire::double(out, field, depth);
        }
        wire::double(out, 8, self.farthest);
        wire::doubles_of(out, 9, self.slips.iter().map(|[moved, _]| *moved));
        wire::doubles_of(out, 10, self.slips.iter().map(|[_, turned]| *turned));
        wire::double(out, 11, self.force);
        wire::uint32(out, 12, self.links);
        wire::double(out, 13, self.opened_by);
        wire::double(out, 14, self.drawn_back);
        wire::uint32(out, 15, self.warnings);
    }

    pub(super) fn of(outcome: Option<&proto::TrialOutcome>) -> Result<Self, RecordError> {
        let missing = RecordError::Missing { message: MESSAGE, field: "trials.outcome" };
        let outcome = outcome.ok_or(missing)?;
        let verdict = verdict_of("outcome.verdict", outcome.verdict)?;
        let penetration = [outcome.start_penetration, outcome.closed_penetration, outcome.shaken_penetration];
        for (field, value) in [
            ("outcome.time", outcome.time),
            ("outcome.closing_time", outcome.closing_time),
            ("outcome.farthest", outcome.farthest),
            ("outcome.force", outcome.force),
            ("outcome.opened_by", outcome.opened_by),
            ("outcome.drawn_back", outcome.drawn_back),
        ]
        .into_iter()
        .chain(penetration.map(|depth| ("outcome.penetration", depth)))
        {
            not_below_zero(field, value)?;
        }
        lengthy(MESSAGE, "outcome.turns", outcome.slips.len(), outcome.turns.len())?;
        finite("outcome.slips", &outcome.slips)?;
        finite("outcome.turns", &outcome.turns)?;
        Ok(Self {
            verdict,
            time: outcome.time,
            closing_time: outcome.closing_time,
            closed_at_rest: outcome.closed_at_rest,
            penetration,
            farthest: outcome.farthest,
            slips: outcome.slips.iter().zip(&outcome.turns).map(|(moved, turned)| [*moved, *turned]).collect(),
            force: outcome.force,
            links: outcome.links,
            opened_by: outcome.opened_by,
            drawn_back: outcome.drawn_back,
            warnings: outcome.warnings,
        })
    }
}

/// The verdict of a number on disk.
pub(super) fn verdict_of(field: &'static str, number: u32) -> Result<TrialVerdict, RecordError> {
    let unknown = RecordError::Range { message: MESSAGE, field, value: f64::from(number), allowed: "0 to 9" };
    TrialVerdict::ALL.get(number as usize).copied().ok_or(unknown)
}

pub(super) fn not_below_zero(field: &'static str, value: f64) -> Result<(), RecordError> {
    ranged(MESSAGE, field, value, value >= 0.0 && value.is_finite(), "0 or positive, and finite")
}

pub(super) fn finite(field: &'static str, values: &[f64]) -> Result<(), RecordError> {
    let wild = values.iter().find(|value| !value.is_finite());
    ranged(MESSAGE, field, wild.copied().unwrap_or_default(), wild.is_none(), "finite")
}
