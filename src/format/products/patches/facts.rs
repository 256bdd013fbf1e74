//! Facts of the patches of one grasp.

use crate::{FactFormat, FactKind, Facts};

/// The grasp of some patches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatchFacts {
    /// Grasp type.
    pub kind: u32,
    /// Index of the type among the chosen ones.
    pub type_index: u32,
    /// Energy that annealing minimised.
    pub energy: f64,
    /// Epsilon of the closed hand, in the space that was asked for.
    pub epsilon: f64,
}

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

/// Index of the fact that is the grasp type.
pub(super) const TYPE: usize = 0;

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 4] = [
    fact("type", FactKind::Integer, "Type of the grasp."),
    fact("type_index", FactKind::Integer, "Index of that type among the chosen ones."),
    fact("energy", FactKind::Number, "Energy of the grasp."),
    fact("epsilon", FactKind::Number, "Epsilon of the grasp."),
];

impl From<PatchFacts> for Facts {
    fn from(PatchFacts { kind, type_index, energy, epsilon }: PatchFacts) -> Self {
        Self::new([f64::from(kind), f64::from(type_index), energy, epsilon])
    }
}

impl From<&Facts> for PatchFacts {
    fn from(facts: &Facts) -> Self {
        let [.., energy, epsilon] = *facts.values() else { return Self::default() };
        Self { kind: facts.integer(TYPE), type_index: facts.integer(1), energy, epsilon }
    }
}
