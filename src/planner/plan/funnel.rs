//! Ends of the states that the members of the portfolio proposed, with their counts.

use kernel::words::GraspVerdict;
use robot::grasp::{ApproachLosses, PathObstacle, PoseCounts};

/// End of a proposed state.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum FunnelEnd {
    /// The sampler found no two sides of the object that oppose each other within their friction cones.
    Unopposed,
    /// The object is wider there than the hand opens.
    TooWide,
    /// No roll of the sampler brings the approach within its half angle of straight down.
    Tilted,
    /// The hand meets the table.
    BlockedByTable,
    /// The hand meets a neighbour.
    BlockedByNeighbour,
    /// The hand meets the target before it closes.
    BlockedByTarget,
    /// Closed, no two links press on the target against each other.
    Open,
    /// Like a state that was proposed or kept before.
    Duplicate,
    /// Farther outside of the reachable set than half a cell, or without a distance to it.
    UnreachableByField,
    /// Deeper in the exact surface than is allowed before closing.
    Penetrates,
    /// The closed hand touches with one link or none.
    NoContact,
    /// Without force closure.
    Unstable,
    /// Epsilon below the required quality.
    LowQuality,
    /// Refused by the motion stage of the caller.
    NoMotion,
    /// The list was full or the work spent before its turn came.
    NotRated,
    /// In the list.
    Kept,
}

impl FunnelEnd {
    /// Every end, in the order of the stages.
    pub const ALL: [Self; 16] = [
        Self::Unopposed,
        Self::TooWide,
        Self::Tilted,
        Self::BlockedByTable,
        Self::BlockedByNeighbour,
        Self::BlockedByTarget,
        Self::Open,
        Self::Duplicate,
        Self::UnreachableByField,
        Self::Penetrates,
        Self::NoContact,
        Self::Unstable,
        Self::LowQuality,
        Self::NoMotion,
        Self::NotRated,
        Self::Kept,
    ];

    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unopposed => "unopposed",
            Self::TooWide => "too_wide",
            Self::Tilted => "tilted",
            Self::BlockedByTable => "blocked_by_table",
            Self::BlockedByNeighbour => "blocked_by_neighbour",
            Self::BlockedByTarget => "blocked_by_target",
            Self::Open => "open",
            Self::Duplicate => "duplicate",
            Self::UnreachableByField => "unreachable_by_field",
            Self::Penetrates => "penetrates",
            Self::NoContact => "no_contact",
            Self::Unstable => "unstable",
            Self::LowQuality => "low_quality",
            Self::NoMotion => "no_motion",
            Self::NotRated => "not_rated",
            Self::Kept => "kept",
        }
    }

    /// End of a state whose hand an obstacle blocks.
    pub(super) fn of_obstacle(obstacle: PathObstacle) -> Self {
        match obstacle {
            PathObstacle::Ground | PathObstacle::Container => Self::BlockedByTable,
            PathObstacle::Target => Self::BlockedByTarget,
            PathObstacle::Neighbour(_) => Self::BlockedByNeighbour,
        }
    }

    /// End of a rated state; `None` for one that passes.
    pub(super) fn of_verdict(verdict: GraspVerdict) -> Option<Self> {
        match verdict {
            GraspVerdict::Kept => None,
            GraspVerdict::Penetrates => Some(Self::Penetrates),
            GraspVerdict::OpenHand => Some(Self::NoContact),
            GraspVerdict::NoForceClosure => Some(Self::Unstable),
            GraspVerdict::LowQuality => Some(Self::LowQuality),
            GraspVerdict::BelowTable => Some(Self::BlockedByTable),
        }
    }
}

/// Counts of proposed states by their ends: they add up to the number proposed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Funnel {
    proposed: u64,
    ends: [u64; FunnelEnd::ALL.len()],
}

impl Funnel {
    /// Number of states that the members proposed.
    pub fn proposed(&self) -> u64 {
        self.proposed
    }

    /// Number of states with this end.
    pub fn count(&self, end: FunnelEnd) -> u64 {
        self.ends[end as usize]
    }

    /// Every end with its count, in the order of the stages.
    pub fn counts(&self) -> impl Iterator<Item = (FunnelEnd, u64)> + '_ {
        FunnelEnd::ALL.into_iter().map(|end| (end, self.count(end)))
    }

    /// Counts states that were proposed, and whose ends follow.
    pub(super) fn propose(&mut self, count: u64) {
        self.proposed += count;
    }

    /// Counts ends of states that were proposed.
    pub(super) fn end(&mut self, end: FunnelEnd, count: u64) {
        self.ends[end as usize] += count;
    }

    /// Counts states that a member proposed and lost itself.
    pub(super) fn lose(&mut self, losses: &[(FunnelEnd, u64)]) {
        for (end, count) in losses {
            self.propose(*count);
            self.end(*end, *count);
        }
    }
}

/// Losses of the sampler of approaches.
pub(super) fn losses_of_approaches(losses: &ApproachLosses) -> Vec<(FunnelEnd, u64)> {
    let counts = [
        (FunnelEnd::Unopposed, losses.unopposed),
        (FunnelEnd::TooWide, losses.too_wide),
        (FunnelEnd::BlockedByTarget, losses.in_object + losses.blocked),
        (FunnelEnd::Open, losses.open),
        (FunnelEnd::Duplicate, losses.known),
    ];
    counts.map(|(end, count)| (end, u64::from(count))).to_vec()
}

/// Losses of the sampler of pairs in a scene.
pub(super) fn losses_of_poses(counts: &PoseCounts) -> Vec<(FunnelEnd, u64)> {
    let blocked = |obstacle: usize| counts.rejected[obstacle] + counts.blocked[obstacle];
    let counts = [
        (FunnelEnd::Unopposed, counts.unopposed),
        (FunnelEnd::TooWide, counts.too_wide),
        (FunnelEnd::Tilted, counts.tilted),
        (FunnelEnd::BlockedByTable, counts.too_low + blocked(0) + blocked(1)),
        (FunnelEnd::BlockedByTarget, blocked(2)),
        (FunnelEnd::BlockedByNeighbour, blocked(3)),
        (FunnelEnd::Duplicate, counts.alike),
    ];
    counts.map(|(end, count)| (end, u64::from(count))).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_numbered_in_their_order_and_named_once() {
        let mut names: Vec<&str> = FunnelEnd::ALL.iter().map(|end| end.name()).collect();
        assert!(FunnelEnd::ALL.iter().enumerate().all(|(index, end)| *end as usize == index));
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), FunnelEnd::ALL.len());
    }

    #[test]
    fn losses_of_samplers_add_up_to_their_draws() {
        let approaches = ApproachLosses {
            draws: 28,
            unopposed: 1,
            too_wide: 2,
            in_object: 3,
            blocked: 4,
            open: 5,
            known: 6,
            budget_spent: false,
        };
        let poses = PoseCounts {
            poses: 70,
            unopposed: 1,
            too_wide: 2,
            tilted: 3,
            too_low: 4,
            rejected: [5, 6, 7, 8],
            alike: 9,
            blocked: [1, 2, 3, 4],
            free: 15,
        };
        let sum = |losses: &[(FunnelEnd, u64)]| losses.iter().map(|(_, count)| count).sum::<u64>();
        // Seven states of approaches and fifteen free poses are no losses.
        assert_eq!(sum(&losses_of_approaches(&approaches)) + 7, 28);
        assert_eq!(sum(&losses_of_poses(&poses)) + 15, 70);
    }
}
