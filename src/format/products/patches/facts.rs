//! Facts of the patches of one grasp.

use crate::{FactFormat, FactKind, FactRange, Facts, products::grasps::GraspLabel};

/// The grasp of some patches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatchFacts {
    /// Grasp type.
    pub kind: u32,
    /// Index of the type among the chosen types.
    pub type_index: u32,
    /// Energy that annealing minimised.
    pub energy: f64,
    /// Epsilon of the closed hand, in the space that the job selects.
    pub epsilon: f64,
    /// Label from the trials of the grasp; `None` if labels are not those of trials.
    pub outcome: Option<GraspLabel>,
    /// Number of points of the grasp that the depth image does not hide; 0 where none are marked.
    pub visible: u32,
}

/// Topics that state facts in addition to the patches.
pub(super) const TRIAL_TOPIC: &str = "/patches/trial";
pub(super) const VISIBILITY_TOPIC: &str = "/patches/visibility";

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

const fn beside(topic: &'static str, name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: Some(topic), meaning }
}

/// Index of the fact that is the grasp type.
pub(crate) const TYPE: usize = 0;
/// Number of the facts that patches themselves state.
pub(super) const OF_PATCHES: usize = 4;
/// Indices of the facts that the marks state.
pub(super) const OUTCOME: usize = 4;
pub(super) const VISIBLE: usize = 5;

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 6] = [
    fact("type", FactKind::Integer, "Type of the grasp."),
    fact("type_index", FactKind::Integer, "Index of the type among the chosen types."),
    fact("energy", FactKind::Number(FactRange::Finite), "Energy of the grasp."),
    fact("epsilon", FactKind::Number(FactRange::Finite), "Epsilon of the grasp."),
    beside(
        TRIAL_TOPIC,
        "outcome",
        FactKind::Integer,
        "Label by trials: 1 untested, 2 held, 3 failed, 4 borderline, 5 unconfirmed.",
    ),
    beside(
        VISIBILITY_TOPIC,
        "visible_points",
        FactKind::Count,
        "Points of palm and fingertips that the image does not hide.",
    ),
];

impl From<PatchFacts> for Facts {
    fn from(PatchFacts { kind, type_index, energy, epsilon, outcome, visible }: PatchFacts) -> Self {
        let outcome = outcome.map_or(0, outcome_number);
        Self::new([f64::from(kind), f64::from(type_index), energy, epsilon, f64::from(outcome), f64::from(visible)])
    }
}

impl From<&Facts> for PatchFacts {
    fn from(facts: &Facts) -> Self {
        let [_, _, energy, epsilon, ..] = *facts.values() else { return Self::default() };
        Self {
            kind: facts.integer(TYPE),
            type_index: facts.integer(1),
            energy,
            epsilon,
            outcome: (GraspLabel::ALL.into_iter()).find(|label| outcome_number(*label) == facts.integer(OUTCOME)),
            visible: facts.integer(VISIBLE),
        }
    }
}

/// The number of a label in tables, from 1.
pub(super) fn outcome_number(label: GraspLabel) -> u32 {
    label as u32 + 1
}
