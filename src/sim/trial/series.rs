//! A trial over time: forces of the links, and where the object was in the hand.

use nalgebra::{IsometryMatrix3, Point3};

use super::Phase;
use crate::{convert::angle_between, hand::closing::HandWorker, physics::STEP};

/// Steps of 2 ms from one sample to the next.
const STEPS_PER_SAMPLE: u32 = 10;

/// One moment of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct SeriesSample {
    /// Part of the trial.
    pub phase: Phase,
    /// Sum of the normal forces of each link on the object [N], in the order of the hand's links.
    pub forces: Vec<f64>,
    /// Distance of the object's centre of mass from where it was in the hand when the hand began to close, and once that is over
    /// from where it was when gravity came on [m].
    pub moved: f64,
    /// Rotation of the object in the hand since then [rad].
    pub turned: f64,
}

/// Forces and drift of a trial, sampled at every tenth step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// The samples; sample k is taken `(k + 1)` times [`Series::INTERVAL`] after the trial began.
    pub samples: Vec<SeriesSample>,
    /// Where the object was when the present part of the trial began, and whether the hand was still closing.
    reference: Option<(bool, IsometryMatrix3<f64>)>,
}

impl Series {
    /// Time from one sample to the next [s].
    pub const INTERVAL: f64 = STEPS_PER_SAMPLE as f64 * STEP;

    /// Notes where the object is before a step.
    pub(super) fn begin(&mut self, phase: Phase, hand: &HandWorker) {
        let closes = phase == Phase::Closing;
        if self.reference.is_none_or(|(closed, _)| closed != closes) {
            self.reference = Some((closes, hand.base_from_object()));
        }
    }

    /// Adds a sample after a step, at every tenth; `centre` is the object's centre of mass.
    pub(super) fn add(&mut self, phase: Phase, hand: &HandWorker, centre: &Point3<f64>) {
        let Some((_, reference)) = self.reference.filter(|_| hand.steps().is_multiple_of(STEPS_PER_SAMPLE)) else {
            return;
        };
        let mut forces = vec![0.0; hand.hand().links().len()];
        for touch in hand.touches() {
            forces[touch.link] += touch.force;
        }
        let now = hand.base_from_object();
        let moved = (now * centre - reference * centre).norm();
        self.samples.push(SeriesSample { phase, forces, moved, turned: angle_between(&reference, &now) });
    }
}
