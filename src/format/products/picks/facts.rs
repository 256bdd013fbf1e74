//! Facts of the grasps of one body.

use super::{PickCandidate, PickCandidates, PickTrial, PickTrials, PickVerdict};
use crate::{FactFormat, FactKind, Facts};
use kernel::words::FreeWays;

const VERDICTS: usize = PickVerdict::ALL.len();

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

/// Number of the facts of candidates, which come first.
pub(super) const FIRST_OF_TRIALS: usize = 9;

/// Number of the facts of trials.
const TRIAL_FACTS: usize = VERDICTS + 3;

const fn fact(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: None, meaning }
}

const fn trials(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: Some(TRIALS), meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; FIRST_OF_TRIALS + TRIAL_FACTS] = [
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
];

impl PickFacts {
    /// Facts of candidates and their trials, if there were any.
    pub fn from_candidates(candidates: &PickCandidates, trials: Option<&PickTrials>) -> Self {
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

impl From<PickFacts> for Facts {
    fn from(facts: PickFacts) -> Self {
        Self::new(facts.values().into_iter().chain(facts.trials.values()))
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
        let facts = PickFacts { stored: 1, candidates: 2, free: 3, lost, free_opened: 8, free_either: 9, trials };
        let values = Facts::from(facts);
        assert_eq!(values.values().len(), FACTS.len());
        assert_eq!(PickFacts::from(&values), facts);
    }
}
