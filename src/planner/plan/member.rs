//! Members of the portfolio: each proposes states of the hand.

use std::sync::Arc;

use nalgebra::IsometryMatrix3;

use super::{
    funnel::{FunnelEnd, losses_of_approaches, losses_of_poses},
    inputs::PlanInputs,
    score::Score,
};
use kernel::{geom::SimdLevel, seed::Stream};
use robot::grasp::{
    Annealer, Annealing, ApproachDraws, GraspRater, GraspSampler, HandPassage, HandSearch, HandState, RatedGrasp,
    SceneSampler, SceneSampling, SceneTarget, SearchFrom, SurfacePoints, Surroundings,
};

/// Work of a rating, a path of the hand through the scene, a draw of an approach and a draw of a pair, in steps of a search.
pub(super) const RATING: u64 = 250;
pub(super) const PASSAGE: u64 = 100;
const APPROACH: u64 = 25;
const PAIR: u64 = 2;

/// Steps of a search from a state, and from a seed.
const STATE_STEPS: u32 = 500;
const SEED_STEPS: u32 = 2_000;

/// States that a search from a state, and from a seed, proposes at most.
const STATE_BEST: u32 = 3;
const SEED_BEST: u32 = 10;

/// Approaches and pairs that a task of a sampler draws at most, and the states after which it ends.
const APPROACHES: u32 = 24;
const PAIRS: u32 = 1_000;
const SAMPLED: u32 = 6;

/// Angle of the cone of approaches about the inward normal [rad], and friction of their sides.
const CONE: f64 = 0.5;
const SIDE_FRICTION: f64 = 0.4;

/// A member of the portfolio.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Member {
    /// Pairs between the pads of a gripper in the scene, or approaches of a hand with several fingers along normals of the object.
    Sampler,
    /// Annealing from states that the sampler found.
    FromStates,
    /// Annealing from seeds on the surface.
    FromSeeds,
}

impl Member {
    /// Every member.
    pub const ALL: [Self; 3] = [Self::Sampler, Self::FromStates, Self::FromSeeds];

    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sampler => "sampler",
            Self::FromStates => "from_states",
            Self::FromSeeds => "from_seeds",
        }
    }

    /// Work of one of its tasks, about.
    pub(super) fn work_of_task(self) -> u64 {
        match self {
            Self::Sampler => u64::from(SAMPLED) * RATING,
            Self::FromStates => u64::from(STATE_STEPS),
            Self::FromSeeds => u64::from(SEED_STEPS),
        }
    }
}

/// One task of a member, with its number in the plan.
#[derive(Clone, Debug)]
pub(super) enum Task {
    Sample(u64),
    FromState(u64, HandState),
    FromSeed(u64, IsometryMatrix3<f64>),
}

/// A state that a task proposes.
#[derive(Clone, Debug)]
pub(super) struct Proposal {
    pub(super) start: HandState,
    /// Energy of the search; infinite where there was none.
    pub(super) energy: f64,
    /// The rating, where the member made one.
    pub(super) rated: Option<RatedGrasp>,
}

/// Result of a task.
#[derive(Clone, Debug, Default)]
pub(super) struct Proposals {
    pub(super) states: Vec<Proposal>,
    pub(super) losses: Vec<(FunnelEnd, u64)>,
    pub(super) work: u64,
}

/// Data that all tasks of a plan share.
pub(super) struct Shared<'a> {
    pub(super) inputs: PlanInputs<'a>,
    /// Target and neighbours, the target first.
    pub(super) surroundings: Surroundings,
    /// Points between pads; of grippers alone.
    pub(super) points: Option<SurfacePoints>,
}

/// Sampler of a hand.
enum Draws {
    Pairs(Box<SceneSampler>),
    Approaches(Box<GraspSampler>),
}

/// Memory of one thread.
pub(super) struct Worker {
    warm: Annealer,
    cold: Annealer,
    draws: Draws,
    pub(super) rater: GraspRater,
    pub(super) passage: HandPassage,
    score: Score,
}

impl Worker {
    pub(super) fn new(inputs: &PlanInputs<'_>) -> Self {
        let (search, settings, level) = (inputs.hand, &inputs.settings, SimdLevel::detect());
        let annealing =
            |steps, best| Annealing { steps, best, whole_schedule: true, descent: false, ..settings.annealing };
        let keeping = &settings.keeping;
        let draws = match SceneSampler::new(search, settings.margin, level) {
            Some(pairs) => Draws::Pairs(Box::new(pairs)),
            None => Draws::Approaches(Box::new(GraspSampler::new(search, &settings.annealing, keeping, level))),
        };
        Self {
            warm: Annealer::warm(search, &annealing(STATE_STEPS, STATE_BEST), keeping, level),
            cold: Annealer::new(search, &annealing(SEED_STEPS, SEED_BEST), keeping, level),
            draws,
            rater: GraspRater::new(search, &settings.annealing, keeping, level),
            passage: HandPassage::new(search, settings.margin),
            score: Score::default(),
        }
    }

    /// Does a task. The result depends on nothing that this thread did before.
    pub(super) fn propose(&mut self, shared: &Shared<'_>, task: &Task) -> Proposals {
        let stream = |number: &u64, name: &str| Stream::of_job(shared.inputs.seed, &number.to_le_bytes(), name);
        match task {
            Task::Sample(number) => self.sample(shared, &mut stream(number, "plan sampler")),
            Task::FromState(number, start) => {
                let from = SearchFrom::State(start.clone());
                self.explore(shared, &from, &mut stream(number, "plan from state"))
            }
            Task::FromSeed(number, seed) => {
                self.explore(shared, &SearchFrom::Seed(*seed), &mut stream(number, "plan from seed"))
            }
        }
    }

    fn explore(&mut self, shared: &Shared<'_>, from: &SearchFrom, stream: &mut Stream) -> Proposals {
        let Self { warm, cold, score, .. } = self;
        let annealer = if matches!(from, SearchFrom::State(_)) { warm } else { cold };
        let object = shared.inputs.target.search();
        let found = annealer.explore(object, from, stream, |state| score.of(&shared.inputs, state));
        let propose =
            |state: robot::grasp::FoundState| Proposal { start: state.start, energy: state.energy, rated: None };
        let states = found.states.into_iter().map(propose).collect();
        Proposals { states, losses: Vec::new(), work: u64::from(found.steps) }
    }

    fn sample(&mut self, shared: &Shared<'_>, stream: &mut Stream) -> Proposals {
        let settings = &shared.inputs.settings;
        match &mut self.draws {
            Draws::Approaches(sampler) => {
                let draws = ApproachDraws { draws: APPROACHES, cone: CONE, friction: SIDE_FRICTION, best: SAMPLED };
                let run = sampler.approaches(shared.inputs.target.search(), &draws, stream);
                let losses = run.approach_losses.unwrap_or_default();
                // Every draw that came to a state was rated.
                let work = APPROACH * u64::from(losses.draws) + RATING * run.potentials;
                let propose = |grasp: RatedGrasp| {
                    let amplitudes = grasp.amplitudes.clone();
                    let start = HandState {
                        object_from_approach: grasp.object_from_approach,
                        posture: grasp.posture.clone(),
                        amplitudes,
                    };
                    Proposal { start, energy: grasp.energies.total, rated: Some(grasp) }
                };
                let states = run.grasps.into_iter().map(propose).collect();
                Proposals { states, losses: losses_of_approaches(&losses), work }
            }
            Draws::Pairs(sampler) => {
                let Some(points) = &shared.points else { return Proposals::default() };
                let floor = shared.surroundings.ground;
                let body = SceneTarget { scene: &shared.surroundings, target: 0, container: None, floor, points };
                let half_angle = settings.half_angle;
                let sampling = SceneSampling { poses: PAIRS, grasps: SAMPLED, half_angle, friction: SIDE_FRICTION };
                let found = sampler.sample(&mut self.passage, &body, &sampling, stream);
                let blocked: u32 = found.counts.blocked.iter().sum();
                let paths = u64::from(found.counts.free + blocked);
                let work = PAIR * u64::from(found.counts.poses) + PASSAGE * paths;
                let free = found.grasps.into_iter().filter(|grasp| grasp.ways.shaped.blocked.is_none());
                let propose = |grasp: robot::grasp::SampledGrasp| {
                    let start = start_of_base(shared.inputs.hand, &grasp.object_from_base, grasp.posture);
                    Proposal { start, energy: f64::INFINITY, rated: None }
                };
                let states = free.map(propose).collect();
                Proposals { states, losses: losses_of_poses(&found.counts), work }
            }
        }
    }
}

/// State of a hand by the pose of its base.
fn start_of_base(search: &Arc<HandSearch>, object_from_base: &IsometryMatrix3<f64>, posture: Vec<f64>) -> HandState {
    let hand = search.hand();
    let frames = hand.link_frames(&hand.posture_values(&posture));
    let object_from_approach = object_from_base * hand.approach_pose(&frames).isometry();
    let amplitudes = hand.amplitudes_of(&posture).unwrap_or_default();
    HandState { object_from_approach, posture, amplitudes }
}
