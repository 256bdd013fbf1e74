//! Facts of a completion pair.

use super::OcclusionFacts;
use crate::{FactFormat, FactKind, FactRange, Facts};

/// Counts of occupied cells, and the share of the solid inside the grid.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairFacts {
    /// Occupied cells of the partial grid.
    pub partial_cells: u32,
    /// Occupied cells of the complete grid.
    pub complete_cells: u32,
    /// Cells occupied in both.
    pub both_cells: u32,
    /// Share of the solid's volume inside the grid, 0 to 1.
    pub solid_share: f64,
    /// Occluder in front of the object; zeros without occlusion in the job.
    pub occlusion: OcclusionFacts,
}

/// Topic of the occluders, without which a dataset has no columns of them.
pub(super) const OCCLUSION: &str = "/completion/occlusion";

/// Index of the first fact of occluders.
pub(super) const FIRST_OF_OCCLUSION: usize = 4;

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

const fn occlusion(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: Some(OCCLUSION), meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 6] = [
    fact("partial_cells", FactKind::Integer, "Occupied cells of the partial grid."),
    fact("complete_cells", FactKind::Integer, "Occupied cells of the complete grid."),
    fact("both_cells", FactKind::Integer, "Cells that are occupied in both."),
    fact("solid_share", FactKind::Number(FactRange::Share), "Share of the solid's volume inside the grid."),
    occlusion("occluded", FactKind::Count, "1 if the view has an occluder, else 0."),
    occlusion(
        "hidden_share",
        FactKind::Number(FactRange::Share),
        "Share of the object's pixels that the occluder hides.",
    ),
];

impl OcclusionFacts {
    /// The values in the order of their columns.
    pub(super) fn values(self) -> [f64; 2] {
        [f64::from(self.occluded), self.hidden_share]
    }
}

impl From<PairFacts> for Facts {
    fn from(facts: PairFacts) -> Self {
        let PairFacts { partial_cells, complete_cells, both_cells, solid_share, occlusion } = facts;
        let cells = [partial_cells, complete_cells, both_cells].map(f64::from);
        Self::new(cells.into_iter().chain([solid_share]).chain(occlusion.values()))
    }
}

impl From<&Facts> for PairFacts {
    fn from(facts: &Facts) -> Self {
        let [partial_cells, complete_cells, both_cells] = [0, 1, 2].map(|index| facts.integer(index));
        let occluded = facts.integer(FIRST_OF_OCCLUSION);
        let occlusion = OcclusionFacts { occluded, hidden_share: facts.values()[FIRST_OF_OCCLUSION + 1] };
        Self { partial_cells, complete_cells, both_cells, solid_share: facts.values()[3], occlusion }
    }
}
