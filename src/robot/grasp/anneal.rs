//! Simulated annealing in the space of position, rotation and eigengrasps (Ciocarlie, Goldfeder and Allen 2007; Ingber 1989;
//! thesis, 4.2 and 7.3).

use std::sync::Arc;

use nalgebra::IsometryMatrix3;

use super::{
    best::{BestList, Candidate},
    energy::{Potential, contact_energy},
    found::{RatedGrasp, SearchInterval, SearchRun},
    frame::Frame,
    object::ObjectSearch,
    rate::{Rating, Start},
    settings::{Annealing, EnergyKind, Keeping, SearchFrame},
    state::{HandSearch, StateScratch, evaluate_contacts, is_feasible},
    variables::{Variables, search_from_approach},
    wrench::EpsilonLimits,
};
use kernel::{geom::SimdLevel, seed::Stream, words::STRETCHES};

/// The schedule of Ingber 1989 in eight dimensions: temperature k is INITIAL_TEMPERATURE exp(-DECAY k^(1/8)), with k from
/// FIRST_STEP to FIRST_STEP + SCHEDULE_STEPS.
const INITIAL_TEMPERATURE: f64 = 1e6;
const DECAY: f64 = 7.0;
const FIRST_STEP: f64 = 30_000.0;
const SCHEDULE_STEPS: f64 = 70_000.0;

/// Factor of energies in the acceptance test.
const ENERGY_SCALE: f64 = 1e-6;

/// Error of an energy that the acceptance test tolerates, as a share of the temperature.
const UNFELT: f64 = 0.1;

/// Largest number of neighbours that are evaluated per step.
const TRIES: u32 = 11;

/// Energy before the first feasible state, above all others: that state is accepted.
const NO_STATE_ENERGY: f64 = 1e8;

/// Distance of the hand from the seed at the start [m].
const STAND_OFF: f64 = 0.15;

/// Counts of a run.
#[derive(Clone, Debug, Default, PartialEq)]
struct Counts {
    steps: u32,
    failed: u32,
    tries: u64,
    potentials: u64,
    course: [SearchInterval; STRETCHES],
}

/// One thread's annealing of one hand.
pub struct Annealer {
    hand: Arc<HandSearch>,
    variables: Variables,
    settings: Annealing,
    /// Temperature and ln(1 + 1 / temperature) of every step.
    schedule: Vec<[f64; 2]>,
    scratch: StateScratch,
    level: SimdLevel,
    best: BestList,
    potential: Potential,
    rating: Rating,
}

impl Annealer {
    /// With vector instructions up to a level, which does not change the result.
    pub fn new(search: &Arc<HandSearch>, settings: &Annealing, keeping: &Keeping, level: SimdLevel) -> Self {
        let temperature = |step: u32| {
            let along = f64::from(step);
            let k = FIRST_STEP
                + if settings.whole_schedule { SCHEDULE_STEPS * along / f64::from(settings.steps) } else { along };
            let temperature = INITIAL_TEMPERATURE * libm::exp(-DECAY * k.sqrt().sqrt().sqrt());
            [temperature, libm::log(1.0 + 1.0 / temperature)]
        };
        Self {
            hand: Arc::clone(search),
            variables: Variables::new(&search.hand, settings),
            settings: *settings,
            schedule: (0..settings.steps).map(temperature).collect(),
            scratch: search.scratch(),
            level: level.usable(),
            best: BestList::new(settings.best as usize),
            potential: Potential::new(settings, level.usable()),
            rating: Rating::new(search, settings, keeping, level.usable()),
        }
    }

    /// One run from a seed: origin on the object's surface, z along the inward normal. The result does not depend on
    /// earlier runs.
    pub fn run(
        &mut self,
        object: &ObjectSearch,
        object_from_seed: &IsometryMatrix3<f64>,
        stream: &mut Stream,
    ) -> SearchRun {
        let counts = self.search(object, object_from_seed, stream);
        let rate = |candidate: &Candidate| {
            let amplitudes = self.variables.amplitudes(&candidate.state);
            let object_from_approach = candidate.object_from_approach.isometry();
            let posture = self.hand.hand.posture_of(amplitudes);
            self.rating.started(object, Start { object_from_approach, posture, amplitudes: amplitudes.to_vec() })
        };
        let mut grasps: Vec<RatedGrasp> = self.best.list().iter().map(rate).collect();
        // Exact energies may have another order than the ones of the search.
        grasps.sort_by(|one, other| one.energies.total.total_cmp(&other.energies.total));
        SearchRun {
            object_from_seed: *object_from_seed,
            steps: counts.steps,
            failed: counts.failed,
            tries: counts.tries,
            potentials: counts.potentials,
            course: counts.course,
            grasps,
            losses: None,
            approach_losses: None,
        }
    }

    /// Anneals; the best states end in `self.best`.
    fn search(
        &mut self,
        object: &ObjectSearch,
        object_from_seed: &IsometryMatrix3<f64>,
        stream: &mut Stream,
    ) -> Counts {
        // Frame of the search's variables: the seed's, or one at the middle of the object.
        let object_from_search = match self.settings.frame {
            SearchFrame::Seed => *object_from_seed,
            SearchFrame::Object => IsometryMatrix3::translation(object.middle.x, object.middle.y, object.middle.z),
        };
        // Initial state: the hand is backed off against the approach direction, all amplitudes 0.
        let start = object_from_seed * IsometryMatrix3::translation(0.0, 0.0, -STAND_OFF);
        let amplitudes = vec![0.0; self.variables.count() - 6];
        let start = Frame::of(&(object_from_search.inverse() * start));
        let mut state = self.variables.state_at(&start, &amplitudes);
        let object_from_search = Frame::of(&object_from_search);
        let base_from_approach = self.hand.base_from_approach.isometry();
        let approach_from_base = Frame::of(&base_from_approach.inverse());
        let mut energy = NO_STATE_ENERGY;
        let mut counts = Counts::default();
        let mut sums = [(0.0, 0u32); STRETCHES];
        let mut failures = 0;
        self.best.clear(object.radius);
        self.potential.forget();
        let field = object.field();
        for step in 0..self.settings.steps {
            let [temperature, log_span] = self.schedule[step as usize];
            let stretch = (u64::from(step) * STRETCHES as u64 / u64::from(self.settings.steps)) as usize;
            counts.steps += 1;
            // First feasible of a few neighbours, drawn by very fast simulated re-annealing (Ingber 1989).
            let mut found = None;
            for _ in 0..TRIES {
                counts.tries += 1;
                let next = self.variables.neighbour(&state, temperature, log_span, stream);
                let object_from_approach = object_from_search.times(&search_from_approach(&next));
                let object_from_base = object_from_approach.times(&approach_from_base);
                let amplitudes = self.variables.amplitudes(&next);
                if is_feasible(self.level, &self.hand, field, &object_from_base, amplitudes, &mut self.scratch) {
                    found = Some((next, object_from_approach));
                    break;
                }
            }
            // No feasible neighbour: the run ends after too many such steps in a row.
            let Some((next, object_from_approach)) = found else {
                counts.failed += 1;
                failures += 1;
                if failures == self.settings.max_failures {
                    break;
                }
                continue;
            };
            failures = 0;
            // Energies below this limit are accepted.
            let limit = if self.settings.descent || energy == NO_STATE_ENERGY {
                energy
            } else {
                // Metropolis criterion, solved for the energy: worse states pass with the probability of the temperature.
                energy - libm::log(stream.unit()) * temperature / ENERGY_SCALE
            };
            evaluate_contacts(self.level, &self.hand, field, &mut self.scratch);
            let rated = self.energy(object, temperature, limit, &mut counts);
            if rated < limit {
                (state, energy) = (next, rated);
                counts.course[stretch].accepted += 1;
                self.best.offer(energy, &object_from_approach, &state);
            }
            // Course of the run: mean energy of the current state per stretch of the steps.
            if energy < NO_STATE_ENERGY {
                sums[stretch].0 += energy;
                sums[stretch].1 += 1;
            }
        }
        for (stretch, (sum, count)) in counts.course.iter_mut().zip(sums) {
            stretch.mean_energy = if count == 0 { f64::NAN } else { sum / f64::from(count) };
        }
        counts
    }

    /// Energy of the state that was evaluated last; where it is not below `limit`, any number that is not.
    fn energy(&mut self, object: &ObjectSearch, temperature: f64, limit: f64, counts: &mut Counts) -> f64 {
        if self.settings.energy == EnergyKind::ContactAndPotential {
            let scale = self.settings.potential_scale;
            // Epsilon above which the energy is below the limit.
            let tolerance = self.potential.tolerance(UNFELT * temperature / ENERGY_SCALE / scale);
            let limits = EpsilonLimits { above: f64::INFINITY, below: -limit / scale, tolerance };
            let potential = self.potential.of(&self.scratch.contacts, &object.mass, &limits);
            counts.potentials += u64::from(potential.is_some());
            if let Some(potential) = potential.filter(|potential| *potential < 0.0) {
                return potential * scale;
            }
        }
        contact_energy(&self.scratch.contacts)
    }
}
