//! Simulated annealing in the space of position, rotation and eigengrasps (Ciocarlie, Goldfeder and Allen 2007; Ingber 1989;
//! thesis, 4.2 and 7.3).

use std::sync::Arc;

use nalgebra::IsometryMatrix3;

use super::{
    best::{BestList, Candidate},
    energy::Potential,
    found::{RatedGrasp, SearchInterval, SearchRun},
    frame::Frame,
    object::ObjectSearch,
    rate::{HandState, Rating},
    searched::SearchedState,
    settings::{Annealing, Keeping, SearchFrame},
    state::{HandSearch, StateScratch, evaluate_contacts, is_feasible},
    variables::{Variables, search_from_approach},
};
use kernel::{geom::SimdLevel, seed::Stream, words::STRETCHES};

/// The schedule of Ingber 1989 in eight dimensions: temperature k is INITIAL_TEMPERATURE exp(-DECAY k^(1/8)), with k from
/// FIRST_STEP to FIRST_STEP + SCHEDULE_STEPS.
const INITIAL_TEMPERATURE: f64 = 1e6;
const DECAY: f64 = 7.0;
const FIRST_STEP: f64 = 30_000.0;
const SCHEDULE_STEPS: f64 = 70_000.0;

/// Step of the schedule at which a search from a known state begins: effective temperature 1.
const WARM_STEP: f64 = 60_000.0;

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

/// Where a search begins.
struct Beginning {
    object_from_search: IsometryMatrix3<f64>,
    search_from_start: IsometryMatrix3<f64>,
    amplitudes: Vec<f64>,
}

/// Where a search by an energy of the caller begins.
#[derive(Clone, Debug, PartialEq)]
pub enum SearchFrom {
    /// A seed expressed in the object's frame: origin on the surface, z along the inward normal. The hand starts 150 mm before it.
    Seed(IsometryMatrix3<f64>),
    /// A known state, in its own frame, with one amplitude per eigengrasp.
    State(HandState),
}

/// A state that a search found, neither closed nor rated.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundState {
    /// Energy that the search minimised, with the distances of its lattice.
    pub energy: f64,
    /// The hand before it closes.
    pub start: HandState,
}

/// Result of a search by an energy of the caller.
#[derive(Clone, Debug, PartialEq)]
pub struct Exploration {
    /// Steps of the search.
    pub steps: u32,
    /// Steps that found no legal neighbour.
    pub failed: u32,
    /// The best states, best first; no two are duplicates.
    pub states: Vec<FoundState>,
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
        Self::from_step(FIRST_STEP, search, settings, keeping, level)
    }

    /// Like [`Self::new`] for searches from known states: the schedule begins at step 60,000, where the effective temperature is 1.
    pub fn warm(search: &Arc<HandSearch>, settings: &Annealing, keeping: &Keeping, level: SimdLevel) -> Self {
        Self::from_step(WARM_STEP, search, settings, keeping, level)
    }

    fn from_step(
        first: f64,
        search: &Arc<HandSearch>,
        settings: &Annealing,
        keeping: &Keeping,
        level: SimdLevel,
    ) -> Self {
        let whole = FIRST_STEP + SCHEDULE_STEPS - first;
        let temperature = |step: u32| {
            let along = f64::from(step);
            let k = first + if settings.whole_schedule { whole * along / f64::from(settings.steps) } else { along };
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
        let kind = self.settings.energy;
        let counts =
            self.search(object, &self.beginning_at(object, object_from_seed), stream, |state| state.energy(kind));
        let states = self.found();
        let rate = |state: FoundState| self.rating.started(object, state.start);
        let mut grasps: Vec<RatedGrasp> = states.into_iter().map(rate).collect();
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

    /// One search by an energy of the caller, without rating: the best states, best first by that energy. `energy` returns the
    /// energy of a state; what is not below [`SearchedState::limit`] need not be exact. The result does not depend on earlier runs.
    pub fn explore(
        &mut self,
        object: &ObjectSearch,
        from: &SearchFrom,
        stream: &mut Stream,
        energy: impl FnMut(&mut SearchedState<'_>) -> f64,
    ) -> Exploration {
        let from = match from {
            SearchFrom::Seed(object_from_seed) => self.beginning_at(object, object_from_seed),
            SearchFrom::State(start) => Beginning {
                object_from_search: start.object_from_approach,
                search_from_start: IsometryMatrix3::identity(),
                amplitudes: start.amplitudes.clone(),
            },
        };
        let counts = self.search(object, &from, stream, energy);
        Exploration { steps: counts.steps, failed: counts.failed, states: self.found() }
    }

    /// The best states of the last search.
    fn found(&self) -> Vec<FoundState> {
        let state = |candidate: &Candidate| {
            let amplitudes = self.variables.amplitudes(&candidate.state);
            let start = HandState {
                object_from_approach: candidate.object_from_approach.isometry(),
                posture: self.hand.hand.posture_of(amplitudes),
                amplitudes: amplitudes.to_vec(),
            };
            FoundState { energy: candidate.energy, start }
        };
        self.best.list().iter().map(state).collect()
    }

    /// Beginning of a search from a seed: the hand is backed off against the approach direction, all amplitudes 0.
    fn beginning_at(&self, object: &ObjectSearch, object_from_seed: &IsometryMatrix3<f64>) -> Beginning {
        // Frame of the search's variables: the seed's, or one at the middle of the object.
        let object_from_search = match self.settings.frame {
            SearchFrame::Seed => *object_from_seed,
            SearchFrame::Object => IsometryMatrix3::translation(object.middle.x, object.middle.y, object.middle.z),
        };
        let start = object_from_seed * IsometryMatrix3::translation(0.0, 0.0, -STAND_OFF);
        let search_from_start = object_from_search.inverse() * start;
        Beginning { object_from_search, search_from_start, amplitudes: vec![0.0; self.variables.count() - 6] }
    }

    /// Anneals; the best states end in `self.best`.
    fn search(
        &mut self,
        object: &ObjectSearch,
        from: &Beginning,
        stream: &mut Stream,
        mut energy_of: impl FnMut(&mut SearchedState<'_>) -> f64,
    ) -> Counts {
        let mut state = self.variables.state_at(&Frame::of(&from.search_from_start), &from.amplitudes);
        let object_from_search = Frame::of(&from.object_from_search);
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
            let rated = energy_of(&mut SearchedState {
                level: self.level,
                field,
                mass: &object.mass,
                hand: &self.hand,
                contacts: &self.scratch.contacts,
                values: &self.scratch.values,
                potential: &mut self.potential,
                potential_scale: self.settings.potential_scale,
                unfelt: UNFELT * temperature / ENERGY_SCALE,
                limit,
                object_from_approach: &object_from_approach,
                amplitudes: self.variables.amplitudes(&next),
                potentials: &mut counts.potentials,
            });
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
}
