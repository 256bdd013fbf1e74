//! Facts of an amodal pair.

use super::Clutter;
use crate::{FactFormat, FactKind, FactRange, Facts, VoxelPair};

/// Counts and shares of a pair in clutter, for tables.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AmodalFacts {
    /// Occupied cells of the partial grid.
    pub partial_cells: u32,
    /// Occupied cells of the complete grid.
    pub complete_cells: u32,
    /// Cells occupied in both.
    pub both_cells: u32,
    /// Share of the solid's volume inside the grid, 0 to 1.
    pub solid_share: f64,
    /// Visible share of the body's silhouette, 0 to 1.
    pub visible_share: f64,
    /// Pixels that see the body.
    pub pixels_visible: u32,
    /// 1 if the body extends beyond the image, else 0.
    pub truncated: u32,
    /// Share of the points of the partial grid that were measured on the body, 0 to 1.
    pub purity: f64,
    /// Cells that meet another body, the container or the half-space below the table.
    pub others_solid_cells: u32,
}

/// Index of the first fact that the record of the clutter states; the pair states the ones before.
pub(super) const FIRST_OF_CLUTTER: usize = 4;

const fn fact(name: &'static str, kind: FactKind, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind, topic: None, meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 9] = [
    fact("partial_cells", FactKind::Integer, "Occupied cells of the partial grid."),
    fact("complete_cells", FactKind::Integer, "Occupied cells of the complete grid."),
    fact("both_cells", FactKind::Integer, "Cells that are occupied in both."),
    fact("solid_share", FactKind::Number(FactRange::Share), "Share of the solid's volume inside the grid."),
    fact("visible_share", FactKind::Number(FactRange::Share), "Visible share of the body's silhouette."),
    fact("pixels_visible", FactKind::Integer, "Pixels that see the body."),
    fact("truncated", FactKind::Count, "1 if the body extends beyond the image, else 0."),
    fact(
        "purity",
        FactKind::Number(FactRange::Share),
        "Share of the points of the partial grid that were measured on the body.",
    ),
    fact("others_solid_cells", FactKind::Integer, "Cells that meet another body, container or table."),
];

impl AmodalFacts {
    /// Facts of a pair and of its surroundings.
    pub fn from_pair(pair: &VoxelPair, clutter: &Clutter) -> Self {
        let VoxelPair { partial_cells, complete_cells, both_cells, solid_share, .. } = *pair;
        Self { partial_cells, complete_cells, both_cells, solid_share, ..Self::of_clutter(clutter) }
    }

    /// Facts that the record of the clutter states alone; all others are 0.
    fn of_clutter(clutter: &Clutter) -> Self {
        Self {
            visible_share: clutter.visible_share(),
            pixels_visible: clutter.pixels_visible,
            truncated: u32::from(clutter.is_truncated()),
            purity: clutter.purity(),
            others_solid_cells: clutter.others_solid.count(),
            ..Self::default()
        }
    }
}

impl Clutter {
    /// The facts that the record states alone, with their indices.
    pub(super) fn stated_facts(&self) -> Vec<(usize, f64)> {
        let facts = Facts::from(AmodalFacts::of_clutter(self));
        facts.values().iter().copied().enumerate().skip(FIRST_OF_CLUTTER).collect()
    }
}

impl From<AmodalFacts> for Facts {
    fn from(facts: AmodalFacts) -> Self {
        Self::new([
            f64::from(facts.partial_cells),
            f64::from(facts.complete_cells),
            f64::from(facts.both_cells),
            facts.solid_share,
            facts.visible_share,
            f64::from(facts.pixels_visible),
            f64::from(facts.truncated),
            facts.purity,
            f64::from(facts.others_solid_cells),
        ])
    }
}

impl From<&Facts> for AmodalFacts {
    fn from(facts: &Facts) -> Self {
        let (integer, number) = (|index| facts.integer(index), |index: usize| facts.values()[index]);
        Self {
            partial_cells: integer(0),
            complete_cells: integer(1),
            both_cells: integer(2),
            solid_share: number(3),
            visible_share: number(4),
            pixels_visible: integer(5),
            truncated: integer(6),
            purity: number(7),
            others_solid_cells: integer(8),
        }
    }
}
