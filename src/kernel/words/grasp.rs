//! Verdicts on grasps, and grasp types with their counts.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Verdict on a state of the hand that a search returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum GraspVerdict {
    /// Force closure, with at least the required quality.
    Kept,
    /// Too deep in the mesh before closing: the distance lattice of the search did not resolve it.
    Penetrates,
    /// The closed hand touches with one link or none.
    OpenHand,
    /// The origin is not inside the wrench space.
    NoForceClosure,
    /// Epsilon below the required quality.
    LowQuality,
    /// The hand reaches below the table in every resting pose of the object.
    BelowTable,
}

impl GraspVerdict {
    /// Every verdict, in the order of their numbers on disk.
    pub const ALL: [Self; 6] =
        [Self::Kept, Self::Penetrates, Self::OpenHand, Self::NoForceClosure, Self::LowQuality, Self::BelowTable];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Penetrates => "penetrates",
            Self::OpenHand => "open_hand",
            Self::NoForceClosure => "no_force_closure",
            Self::LowQuality => "low_quality",
            Self::BelowTable => "below_table",
        }
    }

    /// Whether the closed hand touches the object with at least two links; the other verdicts judge how well it holds.
    pub fn is_closed(self) -> bool {
        !matches!(self, Self::Penetrates | Self::OpenHand)
    }
}

/// Scheme by which a sampler drew the point of a surface from which a pair begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PointScheme {
    /// Uniform by area.
    Area,
    /// Uniform in the logarithm of the thickness of the object, by octaves.
    Thickness,
    /// Uniform over cells of 20 mm.
    Cells,
}

impl PointScheme {
    /// Every scheme, in the order of their numbers on disk.
    pub const ALL: [Self; 3] = [Self::Area, Self::Thickness, Self::Cells];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Area => "area",
            Self::Thickness => "thickness",
            Self::Cells => "cells",
        }
    }

    /// Number in records of grasps, from 1; 0 means none. Records of picks count from 0.
    pub fn number(self) -> u32 {
        self as u32 + 1
    }

    /// The scheme with a number in records of grasps.
    pub fn of_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|scheme| scheme.number() == number)
    }
}

/// Stretches of equal length that the course of a search is averaged over.
pub const STRETCHES: usize = 10;

/// Digits of a grasp type: spread, three proximal joints, three distal ones, and the roll of the wrist.
pub const TYPE_DIGITS: usize = 8;

/// Values of each digit.
pub const TYPE_BINS: u32 = 5;

/// The digits of a grasp type, least significant first (thesis, equation 4.1: type = sum of digit_i 5^i).
pub fn type_digits(kind: u32) -> [u32; TYPE_DIGITS] {
    std::array::from_fn(|digit| kind / TYPE_BINS.pow(digit as u32) % TYPE_BINS)
}

/// Kept grasps of a whole dataset by type, and the most common types chosen among them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GraspTypeCounts {
    /// Kept grasps of each type.
    pub counts: BTreeMap<u32, u64>,
    /// Kept grasps without a type.
    pub without: u64,
    /// The chosen types, the most common first.
    pub chosen: Vec<u32>,
}

impl GraspTypeCounts {
    /// Chooses the `max_types` most common types; of two equally common types the lower number comes first.
    pub fn choose(counts: BTreeMap<u32, u64>, without: u64, max_types: u32) -> Self {
        let mut chosen: Vec<u32> = counts.keys().copied().collect();
        // The sort is stable, and keys come in ascending order.
        chosen.sort_by_key(|kind| std::cmp::Reverse(counts[kind]));
        chosen.truncate(max_types as usize);
        Self { counts, without, chosen }
    }

    /// Index of a type among the chosen ones.
    pub fn index_of(&self, kind: u32) -> Option<usize> {
        self.chosen.iter().position(|chosen| *chosen == kind)
    }

    /// Kept grasps in all.
    pub fn grasps(&self) -> u64 {
        self.without + self.counts.values().sum::<u64>()
    }

    /// Kept grasps of the chosen types.
    pub fn covered(&self) -> u64 {
        self.chosen.iter().filter_map(|kind| self.counts.get(kind)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_common_types_are_chosen_and_the_lower_of_equals() {
        let counts = BTreeMap::from([(7, 3), (2, 5), (9, 5), (1, 1)]);
        let choice = GraspTypeCounts::choose(counts.clone(), 4, 3);
        assert_eq!((choice.chosen.as_slice(), choice.index_of(9), choice.index_of(1)), (&[2, 9, 7][..], Some(1), None));
        assert_eq!(GraspTypeCounts::choose(counts, 0, 8).chosen, [2, 9, 7, 1]);
        assert!(GraspTypeCounts::choose(BTreeMap::new(), 0, 8).chosen.is_empty());
    }
}
