//! Facts of a run that searched for grasps.

use crate::{FactFormat, FactKind, FactRange, Facts};
use kernel::words::GraspVerdict;

const VERDICTS: usize = GraspVerdict::ALL.len();

/// Counts of the states that a run returned, and the best of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspFacts {
    /// States with each verdict, in the order of [`GraspVerdict::ALL`].
    pub verdicts: [u32; VERDICTS],
    /// Lowest energy of any state; infinite where none was found.
    pub best_energy: f64,
    /// Highest epsilon of a kept grasp, in the space that the job selects; 0 if none was kept.
    pub best_epsilon: f64,
    /// Whether the seed was given up before the run was over.
    pub given_up: bool,
    /// Whether a run over pairs or approaches drew its whole budget before it had its states.
    pub budget_spent: bool,
    /// Outcomes of physical trials; zeros where there were none.
    pub trials: TrialFacts,
    /// Counts of graded labels; zero without graded labels.
    pub ladder: LadderFacts,
}

/// Counts of trials of grasps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrialFacts {
    /// States that were tried.
    pub tried: u32,
    /// Tried grasps that held.
    pub held: u32,
    /// Tried grasps that were refused: the hand starts too deep in the object.
    pub refused: u32,
    /// States that were also tried on a table.
    pub tried_on_table: u32,
    /// States of these that lifted the object from it.
    pub held_on_table: u32,
}

/// Counts of graded labels of grasps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LadderFacts {
    /// States that were tried.
    pub tried: u32,
    /// Grasps labelled held.
    pub held: u32,
    /// Grasps labelled partial.
    pub partial: u32,
    /// Grasps labelled failed.
    pub failed: u32,
    /// Grasps labelled blocked.
    pub blocked: u32,
    /// Trials that were made.
    pub trials: u32,
}

/// Topic of the trials, without which a dataset has no columns of them.
pub(super) const TRIALS: &str = "/grasps/trials";

/// Topic of the graded labels.
pub(super) const LADDER: &str = "/grasps/ladder";

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

const fn trials(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: Some(TRIALS), meaning }
}

const fn ladder(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: Some(LADDER), meaning }
}

/// Columns of the facts: verdicts in the order of [`GraspVerdict::ALL`], then the others.
pub(super) const FACTS: [FactFormat; VERDICTS + TRIAL_FACTS + LADDER_FACTS + 4] = [
    fact("grasps_kept", FactKind::Count, "Kept grasps."),
    fact("grasps_penetrates", FactKind::Count, "States whose hand is too deep in the mesh before it closes."),
    fact("grasps_open_hand", FactKind::Count, "States whose closed hand touches with one link or none."),
    fact("grasps_no_force_closure", FactKind::Count, "States without force closure."),
    fact("grasps_low_quality", FactKind::Count, "States whose epsilon is below the job's minimum."),
    fact("grasps_below_table", FactKind::Count, "States that come below the table in every resting pose."),
    fact("given_up", FactKind::Count, "1 if the search gave up its seed early, else 0."),
    fact(
        "budget_spent",
        FactKind::Count,
        "1 if a run over pairs of points or approaches drew its whole budget before it had its states, else 0.",
    ),
    trials("grasps_tried", "Grasps with a physical trial."),
    trials("grasps_held", "Tried grasps that held."),
    trials("grasps_refused", "Tried grasps whose hand starts too deep in the object."),
    trials("grasps_tried_on_table", "Grasps with a trial on a table, too."),
    trials("grasps_held_on_table", "Grasps that lifted the object from a table."),
    fact("best_energy", FactKind::Number(FactRange::FiniteOrNone), "Lowest energy of any state; infinite without one."),
    fact("best_epsilon", FactKind::Number(FactRange::FromZero), "Highest epsilon of a kept grasp; 0 without one."),
    ladder("graded_tried", "Grasps with a graded label."),
    ladder("graded_held", "Grasps whose graded label is held."),
    ladder("graded_partial", "Grasps whose graded label is partial."),
    ladder("graded_failed", "Grasps whose graded label is failed."),
    ladder("graded_blocked", "Grasps whose graded label is blocked: both ways of approach are obstructed."),
    ladder("graded_trials", "Trials that were made for graded labels."),
];

/// Number of the facts of trials.
pub(super) const TRIAL_FACTS: usize = 5;

/// Index of the first fact of trials.
pub(super) const FIRST_OF_TRIALS: usize = VERDICTS + 2;

/// Number of the facts of graded labels.
pub(super) const LADDER_FACTS: usize = 6;

/// Index of the first of them: they come last, so that the others keep their order.
pub(super) const FIRST_OF_LADDER: usize = FIRST_OF_TRIALS + TRIAL_FACTS + 2;

impl Default for GraspFacts {
    fn default() -> Self {
        Self {
            verdicts: [0; VERDICTS],
            best_energy: f64::INFINITY,
            best_epsilon: 0.0,
            given_up: false,
            budget_spent: false,
            trials: TrialFacts::default(),
            ladder: LadderFacts::default(),
        }
    }
}

impl GraspFacts {
    /// States in all.
    pub fn found(&self) -> u32 {
        self.verdicts.iter().fold(0, |sum, count| sum.saturating_add(*count))
    }

    /// Kept grasps.
    pub fn kept(&self) -> u32 {
        self.verdicts[GraspVerdict::Kept as usize]
    }
}

impl TrialFacts {
    /// The counts in the order of their columns.
    pub(super) fn values(self) -> [f64; TRIAL_FACTS] {
        let Self { tried, held, refused, tried_on_table, held_on_table } = self;
        [tried, held, refused, tried_on_table, held_on_table].map(f64::from)
    }
}

impl LadderFacts {
    /// The counts in the order of their columns.
    pub(super) fn values(self) -> [f64; LADDER_FACTS] {
        let Self { tried, held, partial, failed, blocked, trials } = self;
        [tried, held, partial, failed, blocked, trials].map(f64::from)
    }
}

impl From<GraspFacts> for Facts {
    fn from(facts: GraspFacts) -> Self {
        let GraspFacts { verdicts, best_energy, best_epsilon, given_up, budget_spent, trials, ladder } = facts;
        let counts = verdicts.into_iter().chain([given_up, budget_spent].map(u32::from)).map(f64::from);
        let numbers = trials.values().into_iter().chain([best_energy, best_epsilon]);
        Self::new(counts.chain(numbers).chain(ladder.values()))
    }
}

impl From<&Facts> for GraspFacts {
    fn from(facts: &Facts) -> Self {
        let [tried, held, refused, tried_on_table, held_on_table] =
            std::array::from_fn(|index| facts.integer(FIRST_OF_TRIALS + index));
        let [graded, graded_held, partial, failed, blocked, trials] =
            std::array::from_fn(|index| facts.integer(FIRST_OF_LADDER + index));
        let ladder = LadderFacts { tried: graded, held: graded_held, partial, failed, blocked, trials };
        Self {
            ladder,
            verdicts: std::array::from_fn(|index| facts.integer(index)),
            given_up: facts.integer(VERDICTS) != 0,
            budget_spent: facts.integer(VERDICTS + 1) != 0,
            trials: TrialFacts { tried, held, refused, tried_on_table, held_on_table },
            best_energy: facts.values()[FIRST_OF_TRIALS + TRIAL_FACTS],
            best_epsilon: facts.values()[FIRST_OF_TRIALS + TRIAL_FACTS + 1],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_after_verdicts_and_values_come_back() {
        for (fact, verdict) in FACTS.iter().zip(GraspVerdict::ALL) {
            assert_eq!(fact.name, format!("grasps_{}", verdict.name()));
        }
        let facts = GraspFacts {
            verdicts: [1, 2, 3, 4, 5, 6],
            best_energy: -0.5,
            best_epsilon: 0.25,
            given_up: true,
            budget_spent: true,
            trials: TrialFacts { tried: 7, held: 8, refused: 9, tried_on_table: 10, held_on_table: 11 },
            ladder: LadderFacts { tried: 12, held: 13, partial: 14, failed: 15, blocked: 16, trials: 17 },
        };
        let values = Facts::from(facts);
        assert_eq!(GraspFacts::from(&values), facts);
        assert_eq!(values.values().len(), FACTS.len());
        let after = FACTS[FIRST_OF_TRIALS + TRIAL_FACTS].name;
        assert_eq!((FACTS[FIRST_OF_TRIALS].name, after), ("grasps_tried", "best_energy"));
        assert_eq!((FIRST_OF_LADDER, FACTS[FIRST_OF_LADDER].name), (FACTS.len() - LADDER_FACTS, "graded_tried"));
    }
}
