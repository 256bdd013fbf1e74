//! What is counted of a sample, so that a table of all samples is of use without reading one.

use crate::ids::Product;

/// Facts of a sample, by product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SampleFacts {
    /// Of a pair of grids.
    Pair(PairFacts),
    /// Of the poses of one position.
    Block(BlockFacts),
}

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

/// Counts of poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlockFacts {
    /// Cells with each label, in the order of [`PoseLabel::ALL`](crate::geom::PoseLabel::ALL).
    pub labels: [u32; 3],
    /// Cells whose label is known so, in the order of [`Proof::ALL`](crate::geom::Proof::ALL).
    pub proofs: [u32; 5],
}

impl SampleFacts {
    /// The product whose samples have such facts.
    pub fn product(&self) -> Product {
        match self {
            Self::Pair(_) => Product::Completion,
            Self::Block(_) => Product::Reachability,
        }
    }

    /// Those of a pair.
    pub fn pair(&self) -> Option<&PairFacts> {
        match self {
            Self::Pair(facts) => Some(facts),
            Self::Block(_) => None,
        }
    }

    /// Those of a block of poses.
    pub fn block(&self) -> Option<&BlockFacts> {
        match self {
            Self::Block(facts) => Some(facts),
            Self::Pair(_) => None,
        }
    }
}

impl From<PairFacts> for SampleFacts {
    fn from(facts: PairFacts) -> Self {
        Self::Pair(facts)
    }
}

impl From<BlockFacts> for SampleFacts {
    fn from(facts: BlockFacts) -> Self {
        Self::Block(facts)
    }
}
