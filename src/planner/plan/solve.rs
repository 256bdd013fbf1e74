//! The rounds of a plan.

use nalgebra::{IsometryMatrix3, Translation3, Vector3};

use super::{
    funnel::{Funnel, FunnelEnd},
    inputs::{MotionVerdict, PlanInputs, Ranking, SearchEnergy},
    member::{Member, PASSAGE, Proposals, RATING, Shared, Task, Worker},
    order::{Waiting, sort_by_rank},
    ranked::{GraspPlan, RankedEnergies, RankedGrasp, RoundReport},
    score::{field_distance, room_above_table},
    shares::{FIRST, MEMBERS, next_shares},
    workers::run_tasks,
};
use crate::energy::{EnergyForm, grasp_energy};
use kernel::{geom::SimdLevel, seed::Stream, words::BothWays};
use robot::grasp::{
    DistinctGrasps, HandState, PathObstacle, RatedGrasp, STAND_OFF, SceneObstacle, SceneSampler, SurfacePoints,
    Surroundings, WrenchSpace, seeds,
};

/// Rounds in which the budget is spent, unless the list stays short.
const ROUNDS: u64 = 4;

/// States that are rated together.
const BATCH: usize = 8;

/// Farther outside of the reachable set, states are dropped, and seeds of searches [cells].
const MAX_OUTSIDE: f64 = 0.5;
const MAX_SEED_OUTSIDE: f64 = 2.0;

/// Seeds on the surface, spread evenly; searches take them one after another.
const SEEDS: u32 = 64;

/// Why a hand cannot be planned for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnplannableHand {
    /// Searches need eigengrasps.
    #[error("the hand has no eigengrasps: add the section `eigengrasps` to its table (docs/hands.md)")]
    NoEigengrasps,
    /// An energy whose input is missing.
    #[error("the energy of the plan needs {0}")]
    Missing(&'static str),
}

/// State of a plan.
struct Solver<'a> {
    shared: Shared<'a>,
    workers: Vec<Worker>,
    seeds: Vec<IsometryMatrix3<f64>>,
    /// Tasks of each member so far.
    tasks: [u64; MEMBERS],
    /// States of the sampler that searches may start from, the first `started` of them taken.
    states: Vec<HandState>,
    started: usize,
    starts: DistinctGrasps,
    waiting: Vec<Waiting>,
    kept: DistinctGrasps,
    plan: GraspPlan,
}

/// Result of rating a state.
enum Rated {
    Lost(FunnelEnd),
    Passed { grasp: Box<RatedGrasp>, clearance: f64, opened_is_free: bool },
}

/// Plans grasps of an object: rounds of a portfolio until the list is full or the budget spent.
///
/// The list is ordered by P(reach) P(held), or by energy. The same inputs give the same plan, bit for bit, on any number of threads.
///
/// ```
/// use std::{path::Path, sync::Arc};
///
/// use graspmill_planner::plan::{FunnelEnd, PlanInputs, PlanObject, PlanSettings, plan_grasps};
/// use kernel::geom::{GridPlacement, OccupancyGrid};
/// use nalgebra::{IsometryMatrix3, Point3};
/// use robot::grasp::HandSearch;
///
/// // A hand, and a box of 12 x 12 x 20 cells of 4 mm.
/// let model = sim::HandModel::open(Path::new("../../scenes/barrett_bh8_280.xml"))?;
/// let hand = Arc::new(HandSearch::new(model.hand(), &model.bodies()?.0)?);
/// let mut cells = OccupancyGrid::new(40);
/// (0..12 * 12 * 20).for_each(|cell| cells.set([14 + cell % 12, 14 + cell / 12 % 12, 10 + cell / 144]));
/// let placement = GridPlacement { resolution: 40, centre: Point3::origin(), cell_size: 0.004 };
/// let target = PlanObject::from_grid(&cells, &placement)?;
///
/// let inputs = PlanInputs {
///     hand: &hand,
///     target: &target,
///     scene_from_target: IsometryMatrix3::identity(),
///     neighbours: &[],
///     table: None,
///     camera: None,
///     heatmaps: None,
///     reach: None,
///     motion: None,
///     settings: PlanSettings { best: 3, budget: 20_000, ..PlanSettings::STANDARD },
///     seed: 1,
/// };
/// let plan = plan_grasps(&inputs)?;
/// assert!(plan.grasps.is_sorted_by(|one, other| one.p_held >= other.p_held));
/// let ends: u64 = plan.funnel.counts().map(|(_, count)| count).sum();
/// assert_eq!(ends, plan.funnel.proposed());
/// println!("{} kept of {}", plan.funnel.count(FunnelEnd::Kept), plan.funnel.proposed());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the hand has no eigengrasps, or the energy of the plan lacks an input.
pub fn plan_grasps(inputs: &PlanInputs<'_>) -> Result<GraspPlan, UnplannableHand> {
    check(inputs)?;
    let mut solver = Solver::new(inputs);
    let settings = &inputs.settings;
    let (mut shares, mut round) = (FIRST, 0);
    while solver.plan.work < settings.budget && solver.plan.grasps.len() < settings.best {
        round += 1;
        let wanted = (settings.best as u64 * round).div_ceil(ROUNDS).min(settings.best as u64);
        let report = solver.round(shares, settings.budget.div_ceil(ROUNDS), wanted as usize);
        shares = next_shares(shares, report.kept, report.work);
        solver.plan.rounds.push(report);
        // A round without work would be repeated for ever.
        if report.work == [0; MEMBERS] {
            break;
        }
    }
    Ok(solver.finish())
}

fn check(inputs: &PlanInputs<'_>) -> Result<(), UnplannableHand> {
    if inputs.hand.hand().eigengrasps().is_none() {
        return Err(UnplannableHand::NoEigengrasps);
    }
    let facing = |energy: &crate::energy::ContactEnergy| energy.visible == crate::energy::Visibility::Facing;
    let (camera, reach) = (inputs.camera.is_some(), inputs.reach.is_some());
    match &inputs.settings.energy {
        SearchEnergy::Contact(energy) if facing(energy) && !camera => Err(UnplannableHand::Missing("a camera")),
        SearchEnergy::Combined { .. } if !camera => Err(UnplannableHand::Missing("a camera")),
        SearchEnergy::Combined { .. } if inputs.heatmaps.is_none() => {
            Err(UnplannableHand::Missing("maps of a network"))
        }
        SearchEnergy::Reachability(_) if !reach => Err(UnplannableHand::Missing("a reachability map")),
        _ => Ok(()),
    }
}

impl<'a> Solver<'a> {
    fn new(inputs: &PlanInputs<'a>) -> Self {
        let (settings, target) = (&inputs.settings, inputs.target);
        let own = SceneObstacle { surface: target.surface().clone(), scene_from_obstacle: inputs.scene_from_target };
        let objects = std::iter::once(own).chain(inputs.neighbours.iter().cloned()).collect();
        let ground = inputs.table.unwrap_or(f64::NEG_INFINITY);
        let surroundings = Surroundings { container: None, ground, objects };
        let level = SimdLevel::detect();
        let points = SceneSampler::new(inputs.hand, settings.margin, level)
            .map(|sampler| SurfacePoints::new(target.surface(), b"", sampler.widest_pair(), level));
        let radius = target.search().radius();
        let mut solver = Self {
            shared: Shared { inputs: *inputs, surroundings, points },
            workers: (0..settings.threads.max(1)).map(|_| Worker::new(inputs)).collect(),
            seeds: Vec::new(),
            tasks: [0; MEMBERS],
            states: Vec::new(),
            started: 0,
            starts: DistinctGrasps::new(radius),
            waiting: Vec::new(),
            kept: DistinctGrasps::new(radius),
            plan: GraspPlan {
                grasps: Vec::new(),
                funnel: Funnel::default(),
                rounds: Vec::new(),
                dropped_seeds: 0,
                work: 0,
            },
        };
        let all = seeds(target.surface(), SEEDS, &mut Stream::of_job(inputs.seed, b"", "plan seeds"));
        for seed in all {
            // The hand at the seed, its palm on the surface.
            let far = solver
                .distance(&seed, &inputs.hand.hand().opened())
                .is_some_and(|distance| distance > MAX_SEED_OUTSIDE);
            if far && settings.energy == SearchEnergy::Reachability(EnergyForm::Standard) {
                solver.plan.dropped_seeds += 1;
            } else {
                solver.seeds.push(seed);
            }
        }
        solver
    }

    /// Distance of a state from the border of the reachable set [cells]; `None` without a map.
    fn distance(&self, object_from_approach: &IsometryMatrix3<f64>, posture: &[f64]) -> Option<f64> {
        let inputs = &self.shared.inputs;
        let hand = inputs.hand.hand();
        let approach = hand.approach_pose(&hand.link_frames(&hand.posture_values(posture)));
        let reach = inputs.reach.as_ref()?;
        Some(field_distance(inputs, reach, &(object_from_approach * approach.isometry().inverse())))
    }

    /// Whether a contact of the hand is below the table, or nearer to it than the margin: the cheapest test of all.
    fn is_below_table(&self, start: &HandState) -> bool {
        let inputs = &self.shared.inputs;
        let hand = inputs.hand.hand();
        let frames = hand.link_frames(&hand.posture_values(&start.posture));
        let object_from_base = start.object_from_approach * hand.approach_pose(&frames).isometry().inverse();
        room_above_table(inputs, &(inputs.scene_from_target * object_from_base), &frames) < 0.0
    }

    /// A round: proposals of all members, then ratings in the order of their rank until the list has `wanted` grasps.
    fn round(&mut self, shares: [f64; MEMBERS], budget: u64, wanted: usize) -> RoundReport {
        let mut report = RoundReport { shares, work: [0; MEMBERS], kept: [0; MEMBERS] };
        let counts = Member::ALL.map(|member| {
            let work = shares[member as usize] * budget as f64;
            (work / member.work_of_task() as f64).ceil() as u64
        });
        // Searches from states need the states of the sampler.
        let mut tasks: Vec<(Member, Task)> = Vec::new();
        for _ in 0..counts[Member::Sampler as usize] {
            tasks.push((Member::Sampler, Task::Sample(self.number(Member::Sampler))));
        }
        for _ in 0..counts[Member::FromSeeds as usize].min(self.seeds.len() as u64 * ROUNDS) {
            let number = self.number(Member::FromSeeds);
            let seed = self.seeds[(number % self.seeds.len() as u64) as usize];
            tasks.push((Member::FromSeeds, Task::FromSeed(number, seed)));
        }
        self.propose(&tasks, &mut report);
        let last = self.states.len().min(self.started + counts[Member::FromStates as usize] as usize);
        let starts: Vec<HandState> = self.states[self.started..last].to_vec();
        let mut tasks = Vec::new();
        for start in starts {
            tasks.push((Member::FromStates, Task::FromState(self.number(Member::FromStates), start)));
        }
        self.started = last;
        self.propose(&tasks, &mut report);
        self.rate(wanted, &mut report);
        report
    }

    /// Number of a member's next task.
    fn number(&mut self, member: Member) -> u64 {
        let count = &mut self.tasks[member as usize];
        *count += 1;
        *count - 1
    }

    /// Does tasks, and takes in what they propose.
    fn propose(&mut self, tasks: &[(Member, Task)], report: &mut RoundReport) {
        let shared = &self.shared;
        let found = run_tasks(&mut self.workers, tasks, |worker, (_, task)| worker.propose(shared, task));
        for ((member, _), Proposals { states, losses, work }) in tasks.iter().zip(found) {
            report.work[*member as usize] += work;
            self.plan.work += work;
            self.plan.funnel.lose(&losses);
            self.plan.funnel.propose(states.len() as u64);
            for proposal in states {
                let start = &proposal.start;
                let distance = self.distance(&start.object_from_approach, &start.posture);
                // NaN is no distance.
                if distance.is_some_and(|distance| distance.is_nan() || distance > MAX_OUTSIDE) {
                    self.plan.funnel.end(FunnelEnd::UnreachableByField, 1);
                    continue;
                }
                if self.is_below_table(start) {
                    self.plan.funnel.end(FunnelEnd::BlockedByTable, 1);
                    continue;
                }
                let reach = self.shared.inputs.reach;
                let p_reach = distance.zip(reach).map_or(1.0, |(distance, reach)| reach.model.probability(distance));
                if *member == Member::Sampler && self.starts.is_apart(&start.object_from_approach) {
                    self.starts.add(&start.object_from_approach);
                    self.states.push(start.clone());
                }
                self.waiting.push(Waiting { member: *member, proposal, p_reach });
            }
        }
    }

    /// Rates waiting states in the order of their rank.
    fn rate(&mut self, wanted: usize, report: &mut RoundReport) {
        sort_by_rank(&mut self.waiting);
        while self.plan.grasps.len() < wanted && !self.waiting.is_empty() {
            // Batches have one size on any number of threads.
            let mut batch = Vec::with_capacity(BATCH);
            while batch.len() < BATCH && !self.waiting.is_empty() {
                let state = self.waiting.remove(0);
                if self.kept.is_apart(&state.proposal.start.object_from_approach) {
                    batch.push(state);
                } else {
                    self.plan.funnel.end(FunnelEnd::Duplicate, 1);
                }
            }
            let shared = &self.shared;
            let rated = run_tasks(&mut self.workers, &batch, |worker, state| worker.rate(shared, state));
            for (state, (rated, work)) in batch.into_iter().zip(rated) {
                report.work[state.member as usize] += work;
                self.plan.work += work;
                let end = self.take(&state, rated);
                self.plan.funnel.end(end, 1);
                report.kept[state.member as usize] += u64::from(end == FunnelEnd::Kept);
            }
            if self.plan.work >= self.shared.inputs.settings.budget {
                break;
            }
        }
    }

    /// Takes a rated state into the list, if it is distinct and there is a motion.
    fn take(&mut self, state: &Waiting, rated: Rated) -> FunnelEnd {
        let (grasp, clearance, opened_is_free) = match rated {
            Rated::Lost(end) => return end,
            Rated::Passed { grasp, clearance, opened_is_free } => (*grasp, clearance, opened_is_free),
        };
        // The list has room for all of the last batch.
        if self.plan.grasps.len() >= self.shared.inputs.settings.best {
            return FunnelEnd::NotRated;
        }
        if !self.kept.is_apart(&grasp.object_from_approach) {
            return FunnelEnd::Duplicate;
        }
        let inputs = self.shared.inputs;
        let hand = inputs.hand.hand();
        let approach = hand.approach_pose(&hand.link_frames(&hand.posture_values(&grasp.posture)));
        let object_from_base = grasp.object_from_approach * approach.isometry().inverse();
        let scene_from_base = inputs.scene_from_target * object_from_base;
        // The hand came on along its approach: its reachability is that of where it closes.
        let distance = self.distance(&grasp.object_from_approach, &grasp.posture);
        let model = inputs.reach.map(|reach| reach.model);
        let motion = inputs.motion.map_or(MotionVerdict::NotTested, |motion| motion(&scene_from_base, &grasp.posture));
        if matches!(motion, MotionVerdict::Refused(_)) {
            return FunnelEnd::NoMotion;
        }
        self.kept.add(&grasp.object_from_approach);
        let back = scene_from_base.rotation * (approach.isometry().rotation * Vector3::z()) * -STAND_OFF;
        let epsilon = match inputs.settings.keeping.space {
            WrenchSpace::Force => grasp.quality.epsilon_force,
            WrenchSpace::Wrench => grasp.quality.epsilon_wrench,
        };
        let seen = grasp.contacts.iter().map(|contact| inputs.target.is_seen(&contact.point));
        let seen_contacts = seen.map(|seen| seen.map(u32::from)).sum::<Option<u32>>();
        self.plan.grasps.push(RankedGrasp {
            member: state.member,
            scene_from_base,
            object_from_approach: grasp.object_from_approach,
            scene_from_pregrasp: Translation3::from(back) * scene_from_base,
            pregrasp_posture: if opened_is_free { hand.opening(&grasp.posture) } else { grasp.posture.clone() },
            posture: grasp.posture,
            joints: grasp.joints,
            contacts: grasp.contacts,
            seen_contacts,
            energies: RankedEnergies {
                contact: grasp.energies.contact,
                potential: grasp.energies.potential,
                searched: state.proposal.energy,
                distance,
            },
            quality: grasp.quality,
            epsilon,
            p_reach: distance.zip(model).map_or(1.0, |(distance, model)| model.probability(distance)),
            p_held: inputs.settings.held.probability(epsilon),
            clearance,
            motion,
            work: self.plan.work,
        });
        FunnelEnd::Kept
    }

    /// Orders the list, and counts the states that were not rated.
    fn finish(mut self) -> GraspPlan {
        self.plan.funnel.end(FunnelEnd::NotRated, self.waiting.len() as u64);
        let settings = &self.shared.inputs.settings;
        let form = match settings.energy {
            SearchEnergy::Reachability(form) => form,
            _ => EnergyForm::Standard,
        };
        let energy = |grasp: &RankedGrasp| {
            let RankedEnergies { contact, potential, distance, .. } = grasp.energies;
            grasp_energy(form, potential, contact, distance.unwrap_or(-f64::MIN_POSITIVE))
        };
        let key = |grasp: &RankedGrasp| match settings.ranking {
            Ranking::Success => -grasp.p_reach * grasp.p_held,
            Ranking::Energy => energy(grasp),
        };
        self.plan.grasps.sort_by(|one, other| key(one).total_cmp(&key(other)));
        self.plan
    }
}

impl Worker {
    /// Rates a state and follows the hand through the scene; returns the work, too.
    fn rate(&mut self, shared: &Shared<'_>, state: &Waiting) -> (Rated, u64) {
        let Waiting { member, proposal, .. } = state;
        let target = shared.inputs.target.search();
        // Pairs and approaches close where they are, states of searches come on first.
        let (grasp, work) = match (&proposal.rated, member) {
            (Some(rated), _) => (rated.clone(), 0),
            (None, Member::Sampler) => (self.rater.rate_in_place(target, proposal.start.clone()), RATING),
            (None, _) => (self.rater.rate(target, proposal.start.clone()), RATING),
        };
        if let Some(end) = FunnelEnd::of_verdict(grasp.verdict) {
            return (Rated::Lost(end), work);
        }
        let hand = shared.inputs.hand.hand();
        let approach = hand.approach_pose(&hand.link_frames(&hand.posture_values(&grasp.posture)));
        let object_from_base = grasp.object_from_approach * approach.isometry().inverse();
        let (mut closed, posture) = (None, &grasp.posture);
        let ways = self.passage.follow_and_close(&shared.surroundings, 0, &object_from_base, posture, |passage| {
            closed.insert(passage.close(target.surface(), &object_from_base, posture))
        });
        let BothWays { shaped, opened } = ways;
        let free = [&opened, &shaped].into_iter().find(|way| way.blocked.is_none());
        let rated = match (free, shaped.blocked) {
            (Some(way), _) => {
                let (clearance, opened_is_free) = (way.clearance, opened.blocked.is_none());
                Rated::Passed { grasp: Box::new(grasp), clearance, opened_is_free }
            }
            (None, blocked) => {
                let by = blocked.map_or(PathObstacle::Target, |(_, by)| by);
                Rated::Lost(FunnelEnd::of_obstacle(by))
            }
        };
        (rated, work + PASSAGE)
    }
}
