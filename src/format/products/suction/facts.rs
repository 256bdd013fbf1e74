//! Facts of the poses of a cup on one body.

use super::{SuctionDraws, SuctionPoses};
use crate::{FactFormat, FactKind, Facts};

/// Counts of the poses of a cup on one body, for tables.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SuctionFacts {
    /// All drawn poses by result.
    pub draws: SuctionDraws,
    /// 1 if a pose is free, else 0.
    pub with_free: u32,
    /// Free poses with a robustness of at least one half.
    pub robust: u32,
    /// Stored poses.
    pub stored: u32,
}

const fn fact(name: &'static str, meaning: &'static str) -> FactFormat {
    FactFormat { name, kind: FactKind::Count, topic: None, meaning }
}

/// Columns of the facts.
pub(super) const FACTS: [FactFormat; 22] = [
    fact("poses", "Poses of the cup that were drawn."),
    fact("poses_tilted", "Poses with an approach beyond the half angle of straight down."),
    fact("leaking_surface", "Leaking poses: a ray misses the surface."),
    fact("leaking_stroke", "Leaking poses: the lip's distances along the axis range over more than the stroke."),
    fact("leaking_flex", "Leaking poses: the lip's distances from a plane range over too much."),
    fact("leaking_stretch", "Leaking poses: a piece of the lip is stretched too much."),
    fact("leaking_bulge", "Leaking poses: the surface inside of the lip is too high."),
    fact("leaking_hole", "Leaking poses: a hole inside of the lip or at its outer edge is too deep."),
    fact("leaking_curvature", "Leaking poses: the surface is curved too much."),
    fact("weak_pull", "Poses that seal and are too weak against the pull along the axis."),
    fact("weak_shear", "Poses that seal and are too weak against sliding."),
    fact("weak_torsion", "Poses that seal and are too weak against rotation about the axis."),
    fact("weak_tilt", "Poses that seal and are too weak against tilting."),
    fact("poses_alike", "Poses like a free pose that was found before; they are not followed."),
    fact("blocked_by_ground", "Poses that seal and hold, on a path that the ground plane blocks."),
    fact("blocked_by_container", "Poses that seal and hold, on a path that the container blocks."),
    fact("blocked_by_own_object", "Poses that seal and hold, on a path that the body itself blocks."),
    fact("blocked_by_neighbour", "Poses that seal and hold, on a path that another body blocks."),
    fact("free", "Free poses, unlike each other."),
    fact("with_free", "1 for a body with a free pose, else 0."),
    fact("robust", "Free poses that seal and hold in at least half of the poses with errors."),
    fact("stored", "Stored poses."),
];

impl SuctionFacts {
    /// Facts of the poses on a body.
    pub fn from_poses(poses: &SuctionPoses) -> Self {
        let is_robust = |share: f64| share >= 0.5;
        Self {
            draws: poses.draws,
            with_free: u32::from(poses.draws.free > 0),
            robust: poses.free().filter(|pose| pose.robustness.is_some_and(is_robust)).count() as u32,
            stored: poses.poses.len() as u32,
        }
    }
}

impl From<SuctionFacts> for Facts {
    fn from(facts: SuctionFacts) -> Self {
        let SuctionFacts { draws, with_free, robust, stored } = facts;
        let SuctionDraws { drawn, tilted, leaking, weak, alike, blocked, free } = draws;
        let counts = [drawn, tilted].into_iter().chain(leaking).chain(weak).chain([alike]).chain(blocked);
        Self::new(counts.chain([free, with_free, robust, stored]).map(f64::from))
    }
}

impl From<&Facts> for SuctionFacts {
    fn from(facts: &Facts) -> Self {
        let of = |index: usize| facts.integer(index);
        let draws = SuctionDraws {
            drawn: of(0),
            tilted: of(1),
            leaking: std::array::from_fn(|index| of(2 + index)),
            weak: std::array::from_fn(|index| of(9 + index)),
            alike: of(13),
            blocked: std::array::from_fn(|index| of(14 + index)),
            free: of(18),
        };
        Self { draws, with_free: of(19), robust: of(20), stored: of(21) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_come_back_from_their_columns() {
        let draws = SuctionDraws {
            drawn: 1,
            tilted: 2,
            leaking: [3, 4, 5, 6, 7, 8, 9],
            weak: [10, 11, 12, 13],
            alike: 14,
            blocked: [15, 16, 17, 18],
            free: 19,
        };
        let facts = SuctionFacts { draws, with_free: 20, robust: 21, stored: 22 };
        let values = Facts::from(facts);
        assert_eq!((values.values().len(), SuctionFacts::from(&values)), (FACTS.len(), facts));
        for (index, limit) in SuctionPoses::SEAL_LIMITS.iter().enumerate() {
            assert_eq!(FACTS[2 + index].name, format!("leaking_{limit}"));
        }
        for (index, strength) in SuctionPoses::STRENGTHS.iter().enumerate() {
            assert_eq!(FACTS[9 + index].name, format!("weak_{strength}"));
        }
    }
}
