//! Counts of a run that evaluates states one by one.

use nalgebra::IsometryMatrix3;

use super::found::{RatedGrasp, SearchInterval, SearchRun};
use kernel::words::STRETCHES;

/// Counts a run's steps as they go.
pub(super) struct Tally {
    steps: u32,
    failed: u32,
    stretches: [(u32, f64); STRETCHES],
}

impl Tally {
    /// Counts for a run with this number of steps, none of them counted yet.
    pub(super) fn new(steps: u32) -> Self {
        Self { steps, failed: 0, stretches: [(0, 0.0); STRETCHES] }
    }

    /// Step `index` came to a state of this energy, or to none.
    pub(super) fn count(&mut self, index: u32, energy: Option<f64>) {
        let stretch = &mut self.stretches[(u64::from(index) * STRETCHES as u64 / u64::from(self.steps)) as usize];
        match energy {
            Some(energy) => *stretch = (stretch.0 + 1, stretch.1 + energy),
            None => self.failed += 1,
        }
    }

    /// The run with these counts, its states in the order of their energies.
    pub(super) fn run(self, object_from_seed: &IsometryMatrix3<f64>, mut grasps: Vec<RatedGrasp>) -> SearchRun {
        grasps.sort_by(|one, other| one.energies.total.total_cmp(&other.energies.total));
        let mean = |(count, sum): (u32, f64)| if count == 0 { f64::NAN } else { sum / f64::from(count) };
        SearchRun {
            object_from_seed: *object_from_seed,
            steps: self.steps,
            failed: self.failed,
            tries: u64::from(self.steps),
            potentials: u64::from(self.steps - self.failed),
            course: self.stretches.map(|stretch| SearchInterval { accepted: stretch.0, mean_energy: mean(stretch) }),
            grasps,
            losses: None,
            approach_losses: None,
        }
    }
}
