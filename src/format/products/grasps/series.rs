//! A trial over time: forces of the links, and where the object was in the hand.

use crate::codec::{
    RecordError,
    fields::{lengthy, ranged},
    proto, wire,
};

const MESSAGE: &str = "GraspTrials";

/// Phases of a trial whose hand lifts and shakes.
const LIFTED: [&str; 3] = ["closing", "lift", "shake"];
/// Phases of a trial under six directions of gravity: closing, then the direction in which it pulls along the object's axes.
const SIX: [&str; 7] = ["closing", "-z", "z", "-y", "y", "-x", "x"];

/// Names of the phases of a trial under a gravity: `lifted` or `six`.
pub fn trial_phases(gravity: &str) -> &'static [&'static str] {
    if gravity == "six" { &SIX } else { &LIFTED }
}

/// Forces of the links on the object and where it was in the hand, sampled at an even interval over a whole trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialSeries {
    /// Number of samples in each [phase](trial_phases).
    pub samples: Vec<u32>,
    /// Links that pressed on the object in any sample, ascending: indices in [`GraspTrials::links`](super::GraspTrials::links).
    pub links: Vec<u32>,
    /// Sum of the normal forces of each of these links [N]. Shape (samples, links).
    pub forces: Vec<f32>,
    /// Distance of the object's centre of mass in the hand [m], from where it was when the hand began to close; after that phase
    /// from where it was when gravity was switched on. One per sample.
    pub moved: Vec<f32>,
    /// Rotation of the object in the hand since then [rad]. One per sample.
    pub turned: Vec<f32>,
}

/// One sample of a series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesMoment<'s> {
    /// Index of its phase in [`trial_phases`].
    pub phase: usize,
    /// Number of the sample, from 0: it was taken `(number + 1)` intervals after the trial began.
    pub number: u32,
    /// Force of each of [`TrialSeries::links`] [N].
    pub forces: &'s [f32],
    /// See [`TrialSeries::moved`].
    pub moved: f32,
    /// See [`TrialSeries::turned`].
    pub turned: f32,
}

impl TrialSeries {
    /// The samples one after another.
    pub fn moments(&self) -> impl Iterator<Item = SeriesMoment<'_>> {
        let phases = self.samples.iter().enumerate();
        let phases = phases.flat_map(|(phase, count)| std::iter::repeat_n(phase, *count as usize));
        let width = self.links.len();
        phases.zip(0..).map(move |(phase, number)| {
            let index = number as usize;
            let forces = &self.forces[index * width..][..width];
            SeriesMoment { phase, number, forces, moved: self.moved[index], turned: self.turned[index] }
        })
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        wire::uint32s(out, 1, self.samples.iter().copied());
        wire::uint32s(out, 2, self.links.iter().copied());
        for (field, values) in [(3, &self.forces), (4, &self.moved), (5, &self.turned)] {
            wire::floats(out, field, values);
        }
    }

    /// Reads the series of a trial under a gravity, of a hand with this number of links, if present.
    pub(super) fn of(
        stored: Option<&proto::TrialSeries>,
        gravity: &str,
        links: usize,
    ) -> Result<Option<Self>, RecordError> {
        let Some(series) = stored else { return Ok(None) };
        lengthy(MESSAGE, "series.samples", trial_phases(gravity).len(), series.samples.len())?;
        let count: usize = series.samples.iter().map(|count| *count as usize).sum();
        let wrong = series.links.windows(2).find(|pair| pair[0] >= pair[1]).map(|pair| pair[1]);
        let wrong = wrong.or(series.links.iter().copied().find(|link| *link as usize >= links));
        let value = f64::from(wrong.unwrap_or_default());
        ranged(MESSAGE, "series.links", value, wrong.is_none(), "ascending indices into links")?;
        for (field, expected, values) in [
            ("series.forces", count.saturating_mul(series.links.len()), &series.forces),
            ("series.moved", count, &series.moved),
            ("series.turned", count, &series.turned),
        ] {
            lengthy(MESSAGE, field, expected, values.len())?;
            let wild = values.iter().copied().find(|value| !(*value >= 0.0 && value.is_finite()));
            ranged(MESSAGE, field, f64::from(wild.unwrap_or_default()), wild.is_none(), "0 or positive, and finite")?;
        }
        Ok(Some(Self {
            samples: series.samples.clone(),
            links: series.links.clone(),
            forces: series.forces.clone(),
            moved: series.moved.clone(),
            turned: series.turned.clone(),
        }))
    }
}
