//! Facts of the grasps of one body.

use super::{PickCandidate, PickCandidates, PickObstacle, PickPoses, PickSampling, PickTrial, PickTrials, PickVerdict};
use crate::{FactFormat, FactKind, Facts};
use kernel::words::FreeWays;

const VERDICTS: usize = PickVerdict::ALL.len();

const OBSTACLES: usize = PickObstacle::NAMES.len();

/// Counts of the grasps of one body, for tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PickFacts {
    /// Stored grasps of the body's object from which candidates are drawn.
    pub stored: u32,
    /// Grasps that were evaluated.
    pub candidates: u32,
    /// Grasps whose hand approaches in its posture and closes without touching anything else.
    pub free: u32,
    /// Grasps lost to each of [`PickObstacle::NAMES`](super::PickObstacle::NAMES), for the hand that approaches in its posture.
    pub lost: [u32; 4],
    /// Grasps whose hand approaches opened and closes without touching anything else.
    pub free_opened: u32,
    /// Grasps that are free in at least one of these two ways.
    pub free_either: u32,
    /// Outcomes of trials; zeros where there were none.
    pub trials: PickTrialFacts,
    /// Poses by result; zeros where no grasp was sampled in the scene.
    pub sampling: PickSamplingFacts,
}

/// Counts of the poses of a body whose grasps are sampled in the scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PickSamplingFacts {
    /// Poses by result.
    pub poses: PickPoses,
    /// 1 if every pose with two opposite points is wider than the hand opens, else 0.
    pub too_wide: u32,
    /// 1 if no grasp is free and a pose was rejected for the palm alone, else 0.
    pub palm_only: u32,
    /// 1 for the obstacle that blocks most poses at the last stage that one reached, if no grasp is free; else 0.
    pub blocked_by: [u32; OBSTACLES],
}

/// Counts of trials among neighbours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PickTrialFacts {
    /// Trials of each verdict, in the order of [`PickVerdict::ALL`].
    pub verdicts: [u32; VERDICTS],
    /// Held trials in which the hand also pressed on something else.
    pub held_touching: u32,
    /// Held trials in which a neighbour was moved.
    pub held_moving: u32,
    /// Held trials in which a neighbour was lifted, too.
    pub held_carrying: u32,
}

/// Topic of the trials, without which a dataset has no columns of them.
pub(super) const TRIALS: &str = "/picks/trials";

/// Topic of the sampling, without which a dataset has no columns of it.
pub(super) const SAMPLING: &str = "/picks/sampling";

/// Number of the facts of candidates, which come first.
pub(super) const FIRST_OF_TRIALS: usize = 9;

/// Number of the facts of trials.
const TRIAL_FACTS: usize = VERDICTS + 3;

/// Index of the first fact of sampling.
pub(super) const FIRST_OF_SAMPLING: usize = FIRST_OF_TRIALS + TRIAL_FACTS;

/// Number of the facts of sampling.
const SAMPLING_FACTS: usize = 6 + 2 * OBSTACLES + 2 + OBSTACLES;

const fn fact(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: None, meaning }
}

const fn trials(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: Some(TRIALS), meaning }
}

const fn sampling(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: Some(SAMPLING), meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; FIRST_OF_SAMPLING + SAMPLING_FACTS] = [
    fact("stored", "Stored grasps of the body's object from which candidates are drawn."),
    fact("candidates", "Grasps that were evaluated."),
    fact("free", "Grasps whose hand approaches in its posture and closes without touching anything else."),
    fact("lost_to_ground", "Grasps whose hand comes below the ground plane."),
    fact("lost_to_container", "Grasps that the container obstructs."),
    fact("lost_to_own_object", "Grasps whose hand collides with the body itself before it closes."),
    fact("lost_to_neighbour", "Grasps that another body obstructs."),
    fact("free_opened", "Grasps whose hand approaches opened and closes without touching anything else."),
    fact("free_either", "Grasps that are free in at least one of these two ways."),
    trials("held", "Trials that held."),
    trials("starts_too_deep", "Trials whose hand starts too deep in something."),
    trials("not_touching", "Trials whose closed hand does not touch the body."),
    trials("one_link", "Trials whose closed hand touches the body with one link."),
    trials("lost_approaching", "Trials that lost the body while the hand approached."),
    trials("lost_closing", "Trials that lost the body while the hand closed."),
    trials("lost_lifting", "Trials that lost the body while it was lifted."),
    trials("lost_holding", "Trials that lost the body after the lift."),
    trials("let_go", "Trials that end with fewer than two links touching the body."),
    trials("not_lifted", "Trials whose body stayed in the hand but was not lifted."),
    trials("unstable", "Trials whose simulation became unstable."),
    trials("held_touching", "Held trials in which the hand also pressed on something else."),
    trials("held_moving", "Held trials in which a neighbour moved by more than 1 cm."),
    trials("held_carrying", "Held trials in which a neighbour was lifted, too."),
    sampling("poses", "Poses drawn in the scene."),
    sampling("poses_unopposed", "Poses without an opposite point within the friction cones."),
    sampling("poses_too_wide", "Poses whose points are farther apart than the hand opens."),
    sampling("poses_tilted", "Poses without an approach within the half angle of straight down."),
    sampling("poses_too_low", "Poses whose fingertips are below the floor before they are past the points."),
    sampling("poses_rejected_by_ground", "Poses that a yes-or-no test rejects for the ground plane."),
    sampling("poses_rejected_by_container", "Poses that a yes-or-no test rejects for the container."),
    sampling("poses_rejected_by_own_object", "Poses that a yes-or-no test rejects for the body itself."),
    sampling("poses_rejected_by_neighbour", "Poses that a yes-or-no test rejects for another body."),
    sampling("poses_alike", "Poses like a free grasp that was found before; they are not tested."),
    sampling("poses_blocked_by_ground", "Poses whose exact path the ground plane blocks."),
    sampling("poses_blocked_by_container", "Poses whose exact path the container blocks."),
    sampling("poses_blocked_by_own_object", "Poses whose exact path the body itself blocks."),
    sampling("poses_blocked_by_neighbour", "Poses whose exact path another body blocks."),
    sampling("too_wide", "1 for a body that is wider than the hand opens wherever two points oppose each other."),
    sampling("palm_only", "1 for a body without a free grasp, a pose of which is rejected for the palm alone."),
    sampling(
        "blocked_by_ground",
        "1 for a body without a free grasp whose poses are mostly blocked by the ground plane.",
    ),
    sampling(
        "blocked_by_container",
        "1 for a body without a free grasp whose poses are mostly blocked by the container.",
    ),
    sampling("blocked_by_own_object", "1 for a body without a free grasp whose poses are mostly blocked by itself."),
    sampling(
        "blocked_by_neighbour",
        "1 for a body without a free grasp whose poses are mostly blocked by other bodies.",
    ),
];

impl PickFacts {
    /// Facts of candidates, of their trials if there were any, and of their sampling if they were sampled.
    pub fn from_candidates(
        candidates: &PickCandidates,
        trials: Option<&PickTrials>,
        sampling: Option<&PickSampling>,
    ) -> Self {
        let mut lost = [0; 4];
        let blocked = candidates.candidates.iter().filter_map(|candidate| candidate.ways.shaped.blocked);
        blocked.for_each(|blocked| lost[usize::from(blocked.by.number()) - 1] += 1);
        let free_ways = || candidates.candidates.iter().map(PickCandidate::free_ways);
        let count = |ways: &[FreeWays]| free_ways().filter(|free| ways.contains(free)).count() as u32;
        Self {
            stored: candidates.stored,
            candidates: candidates.candidates.len() as u32,
            free: candidates.free().count() as u32,
            lost,
            free_opened: count(&[FreeWays::Opened, FreeWays::Both]),
            free_either: count(&[FreeWays::Opened, FreeWays::Posture, FreeWays::Both]),
            trials: trials.map(PickTrialFacts::from_trials).unwrap_or_default(),
            sampling: sampling.map(PickSamplingFacts::from_sampling).unwrap_or_default(),
        }
    }

    /// The facts of the candidates, in the order of their columns.
    pub(super) fn values(&self) -> [f64; FIRST_OF_TRIALS] {
        let &Self { stored, candidates, free, lost: [ground, container, own, neighbour], .. } = self;
        [stored, candidates, free, ground, container, own, neighbour, self.free_opened, self.free_either].map(f64::from)
    }
}

impl PickTrialFacts {
    /// Facts of trials.
    pub fn from_trials(trials: &PickTrials) -> Self {
        let mut facts = Self::default();
        for trial in &trials.trials {
            facts.verdicts[trial.verdict as usize] += 1;
        }
        let held = |is: &dyn Fn(&PickTrial) -> bool| {
            trials.trials.iter().filter(|trial| trial.verdict.is_held() && is(trial)).count() as u32
        };
        facts.held_touching = held(&|trial| !trial.touched.is_empty());
        facts.held_moving = held(&PickTrial::moves_neighbours);
        facts.held_carrying = held(&|trial| trial.carried(trials.protocol.carried_height).next().is_some());
        facts
    }

    /// Trials in all.
    pub fn tried(&self) -> u32 {
        self.verdicts.iter().fold(0, |sum, count| sum.saturating_add(*count))
    }

    /// Trials that held.
    pub fn held(&self) -> u32 {
        self.verdicts[PickVerdict::Held as usize]
    }

    /// The counts in the order of their columns.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        let &Self { verdicts, held_touching, held_moving, held_carrying } = self;
        verdicts.into_iter().chain([held_touching, held_moving, held_carrying]).map(f64::from)
    }
}

impl PickSamplingFacts {
    /// Facts of the sampling of a body.
    pub fn from_sampling(sampling: &PickSampling) -> Self {
        let poses = sampling.poses;
        let mut blocked_by = [0; OBSTACLES];
        if let Some(obstacle) = poses.blocked_by() {
            blocked_by[obstacle] = 1;
        }
        let [too_wide, palm_only] = [poses.is_too_wide(), sampling.palm_only].map(u32::from);
        Self { poses, too_wide, palm_only, blocked_by }
    }

    /// The counts in the order of their columns. The free ones are among the facts of candidates.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        let &Self { poses, too_wide, palm_only, blocked_by } = self;
        let PickPoses { poses, unopposed, too_wide: wide, tilted, too_low, rejected, alike, blocked, free: _ } = poses;
        let first = [poses, unopposed, wide, tilted, too_low].into_iter().chain(rejected).chain([alike]);
        first.chain(blocked).chain([too_wide, palm_only]).chain(blocked_by).map(f64::from)
    }

    /// Facts whose first column has this index, with the free grasps.
    fn from_facts(free: u32, of: impl Fn(usize) -> u32) -> Self {
        let poses = PickPoses {
            poses: of(0),
            unopposed: of(1),
            too_wide: of(2),
            tilted: of(3),
            too_low: of(4),
            rejected: std::array::from_fn(|index| of(5 + index)),
            alike: of(9),
            blocked: std::array::from_fn(|index| of(10 + index)),
            // Stored grasps are free, too.
            free: if of(0) > 0 { free } else { 0 },
        };
        let blocked_by = std::array::from_fn(|index| of(16 + index));
        Self { poses, too_wide: of(14), palm_only: of(15), blocked_by }
    }
}

impl From<PickFacts> for Facts {
    fn from(facts: PickFacts) -> Self {
        Self::new(facts.values().into_iter().chain(facts.trials.values()).chain(facts.sampling.values()))
    }
}

impl From<&Facts> for PickFacts {
    fn from(facts: &Facts) -> Self {
        let of = |index: usize| facts.integer(index);
        let after = FIRST_OF_TRIALS + VERDICTS;
        Self {
            stored: of(0),
            candidates: of(1),
            free: of(2),
            lost: std::array::from_fn(|index| of(3 + index)),
            free_opened: of(7),
            free_either: of(8),
            trials: PickTrialFacts {
                verdicts: std::array::from_fn(|index| of(FIRST_OF_TRIALS + index)),
                held_touching: of(after),
                held_moving: of(after + 1),
                held_carrying: of(after + 2),
            },
            sampling: PickSamplingFacts::from_facts(of(2), |index| of(FIRST_OF_SAMPLING + index)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_after_verdicts_and_values_come_back() {
        for (fact, verdict) in FACTS[FIRST_OF_TRIALS..].iter().zip(PickVerdict::ALL) {
            assert_eq!(fact.name, verdict.name());
        }
        let trials = PickTrialFacts {
            verdicts: [11, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21],
            held_touching: 22,
            held_moving: 23,
            held_carrying: 24,
        };
        let lost = [4, 5, 6, 7];
        let poses = PickPoses {
            poses: 25,
            unopposed: 26,
            too_wide: 27,
            tilted: 28,
            too_low: 29,
            rejected: [30, 31, 32, 33],
            alike: 34,
            blocked: [35, 36, 37, 38],
            free: 3,
        };
        let sampling = PickSamplingFacts { poses, too_wide: 39, palm_only: 40, blocked_by: [41, 42, 43, 44] };
        let facts =
            PickFacts { stored: 1, candidates: 2, free: 3, lost, free_opened: 8, free_either: 9, trials, sampling };
        let values = Facts::from(facts);
        assert_eq!(values.values().len(), FACTS.len());
        assert_eq!(PickFacts::from(&values), facts);
    }
}
