//! What is counted of a sample, so that a table of all samples is of use without reading one.

use crate::ids::Product;

/// Facts of a sample, by product.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SampleFacts {
    /// Of a pair of grids.
    Pair(PairFacts),
    /// Of the poses of one position.
    Block(BlockFacts),
    /// Of a run that searched for grasps.
    Grasps(GraspFacts),
    /// Of the patches of one grasp.
    Patches(PatchFacts),
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

/// Counts of the states that a run kept, and the best of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GraspFacts {
    /// States with each verdict, in the order of [`GraspVerdict::ALL`](super::GraspVerdict::ALL).
    pub verdicts: [u32; super::GraspVerdict::ALL.len()],
    /// Lowest energy of any state; infinite where none was found.
    pub best_energy: f64,
    /// Highest epsilon of a kept grasp, in the space that the job asks for; 0 where none was kept.
    pub best_epsilon: f64,
    /// Whether the seed was given up before the run was over.
    pub given_up: bool,
    /// What came of physical trials; zeros where there were none.
    pub trials: TrialFacts,
}

/// Counts of trials of grasps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TrialFacts {
    /// Grasps that were tried: all that were kept.
    pub tried: u32,
    /// Of them held.
    pub held: u32,
    /// Of them refused: the hand starts too deep.
    pub refused: u32,
}

/// The grasp of some patches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatchFacts {
    /// Its type.
    pub kind: u32,
    /// Place of that among the chosen types.
    pub type_index: u32,
    /// What annealing minimised.
    pub energy: f64,
    /// Epsilon of the closed hand, in the space that was asked for.
    pub epsilon: f64,
}

impl Default for GraspFacts {
    fn default() -> Self {
        Self {
            verdicts: [0; super::GraspVerdict::ALL.len()],
            best_energy: f64::INFINITY,
            best_epsilon: 0.0,
            given_up: false,
            trials: TrialFacts::default(),
        }
    }
}

impl GraspFacts {
    /// States in all.
    pub fn found(&self) -> u32 {
        self.verdicts.iter().sum()
    }

    /// Of them kept.
    pub fn kept(&self) -> u32 {
        self.verdicts[super::GraspVerdict::Kept as usize]
    }
}

impl SampleFacts {
    /// The product whose samples have such facts.
    pub fn product(&self) -> Product {
        match self {
            Self::Pair(_) => Product::Completion,
            Self::Block(_) => Product::Reachability,
            Self::Grasps(_) => Product::Grasps,
            Self::Patches(_) => Product::Patches,
        }
    }

    /// What its leading channel says of it: all but the counts of trials, which are of another class of numbers.
    #[must_use]
    pub fn without_trials(&self) -> Self {
        match *self {
            Self::Grasps(facts) => Self::Grasps(GraspFacts { trials: TrialFacts::default(), ..facts }),
            other => other,
        }
    }

    /// Those of a pair.
    pub fn pair(&self) -> Option<&PairFacts> {
        match self {
            Self::Pair(facts) => Some(facts),
            _ => None,
        }
    }

    /// Those of a block of poses.
    pub fn block(&self) -> Option<&BlockFacts> {
        match self {
            Self::Block(facts) => Some(facts),
            _ => None,
        }
    }

    /// Those of a run that searched for grasps.
    pub fn grasps(&self) -> Option<&GraspFacts> {
        match self {
            Self::Grasps(facts) => Some(facts),
            _ => None,
        }
    }

    /// Those of the patches of a grasp.
    pub fn patches(&self) -> Option<&PatchFacts> {
        match self {
            Self::Patches(facts) => Some(facts),
            _ => None,
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

impl From<GraspFacts> for SampleFacts {
    fn from(facts: GraspFacts) -> Self {
        Self::Grasps(facts)
    }
}

impl From<PatchFacts> for SampleFacts {
    fn from(facts: PatchFacts) -> Self {
        Self::Patches(facts)
    }
}
