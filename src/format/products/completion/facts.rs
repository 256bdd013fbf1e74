//! Facts of a completion pair.

use crate::{FactFormat, FactKind, Facts};

/// Counts of occupied cells, and the share of the solid that lies in the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairFacts {
    /// Occupied cells of the partial grid.
    pub partial_cells: u32,
    /// Occupied cells of the complete grid.
    pub complete_cells: u32,
    /// Cells occupied in both.
    pub both_cells: u32,
    /// Share of the solid's volume that lies inside the grid, 0 to 1.
    pub solid_share: f64,
}

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 4] = [
    fact("partial_cells", FactKind::Integer, "Occupied cells of the partial grid."),
    fact("complete_cells", FactKind::Integer, "Occupied cells of the complete grid."),
    fact("both_cells", FactKind::Integer, "Cells that are occupied in both."),
    fact("solid_share", FactKind::Number, "Share of the solid's volume inside the grid."),
];

impl From<PairFacts> for Facts {
    fn from(facts: PairFacts) -> Self {
        let PairFacts { partial_cells, complete_cells, both_cells, solid_share } = facts;
        Self::new([partial_cells, complete_cells, both_cells].map(f64::from).into_iter().chain([solid_share]))
    }
}

impl From<&Facts> for PairFacts {
    fn from(facts: &Facts) -> Self {
        let [partial_cells, complete_cells, both_cells] = [0, 1, 2].map(|index| facts.integer(index));
        Self { partial_cells, complete_cells, both_cells, solid_share: facts.values()[3] }
    }
}
