//! Words of picks: choices of stored grasps, obstacles of a hand, verdicts on trials, and states of a grasp.

use crate::{
    GraspLabel,
    codec::{RecordError, fields::ranged},
};

/// Grasps that are evaluated in scenes: a choice of stored ones, or sampled ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TakenGrasps {
    /// All grasps that were tried.
    Tried,
    /// Grasps that held in every trial.
    Held,
    /// The kept grasps.
    Kept,
    /// All whose closed hand touches with at least two links.
    Closed,
    /// None that are stored: grasps sampled in the scene.
    Sampled,
}

impl TakenGrasps {
    /// Every choice.
    pub const ALL: [Self; 5] = [Self::Tried, Self::Held, Self::Kept, Self::Closed, Self::Sampled];

    /// The name on disk.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tried => "tried",
            Self::Held => "held",
            Self::Kept => "kept",
            Self::Closed => "closed",
            Self::Sampled => "sampled",
        }
    }

    /// Whether trials of the stored grasps decide.
    pub fn needs_trials(self) -> bool {
        matches!(self, Self::Tried | Self::Held)
    }
}

/// Choice of the bodies that may move in a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum AwakeBodies {
    /// Bodies two contacts away from the one that is grasped, and those that the hand comes near.
    Near,
    /// All bodies.
    All,
}

impl AwakeBodies {
    /// Every choice.
    pub const ALL: [Self; 2] = [Self::Near, Self::All];

    /// The name on disk.
    pub fn name(self) -> &'static str {
        match self {
            Self::Near => "near",
            Self::All => "all",
        }
    }
}

/// An obstacle of a hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PickObstacle {
    /// The plane below everything.
    Ground,
    /// The container.
    Container,
    /// The body to be grasped, while the hand approaches.
    Own,
    /// Another body, by its number from 1.
    Neighbour(u32),
}

impl PickObstacle {
    /// Names of the obstacles, in the order of their numbers on disk from 1.
    pub const NAMES: [&'static str; 4] = ["ground", "container", "own object", "neighbour"];

    /// The number on disk, from 1; 0 means none.
    pub fn number(self) -> u8 {
        match self {
            Self::Ground => 1,
            Self::Container => 2,
            Self::Own => 3,
            Self::Neighbour(_) => 4,
        }
    }
}

/// Part of a trial among neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PickPhase {
    /// The hand moves along its approach.
    Approach,
    /// The hand closes.
    Closing,
    /// The hand lifts.
    Lift,
    /// The hand holds the body.
    Hold,
}

impl PickPhase {
    /// Every phase, in the order of their numbers on disk.
    pub const ALL: [Self; 4] = [Self::Approach, Self::Closing, Self::Lift, Self::Hold];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Approach => "approach",
            Self::Closing => "closing",
            Self::Lift => "lift",
            Self::Hold => "hold",
        }
    }
}

/// Verdict on a trial among neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PickVerdict {
    /// The body is lifted and stayed in the hand, and at least two links touch it.
    Held,
    /// The hand starts too deep in something: nothing was simulated.
    StartsTooDeep,
    /// The closed hand does not touch the body.
    NotTouching,
    /// The closed hand touches it with one link.
    OneLink,
    /// The body left while the hand approached.
    LostApproaching,
    /// The body left while the hand closed.
    LostClosing,
    /// The body left while it was lifted.
    LostLifting,
    /// The body left after the lift.
    LostHolding,
    /// The body stayed, but in the end fewer than two links touch it.
    LetGo,
    /// The body stayed in the hand, but was not lifted high enough.
    NotLifted,
    /// The simulation became unstable.
    Unstable,
}

impl PickVerdict {
    /// Every verdict, in the order of their numbers on disk.
    pub const ALL: [Self; 11] = [
        Self::Held,
        Self::StartsTooDeep,
        Self::NotTouching,
        Self::OneLink,
        Self::LostApproaching,
        Self::LostClosing,
        Self::LostLifting,
        Self::LostHolding,
        Self::LetGo,
        Self::NotLifted,
        Self::Unstable,
    ];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::StartsTooDeep => "starts_too_deep",
            Self::NotTouching => "not_touching",
            Self::OneLink => "one_link",
            Self::LostApproaching => "lost_approaching",
            Self::LostClosing => "lost_closing",
            Self::LostLifting => "lost_lifting",
            Self::LostHolding => "lost_holding",
            Self::LetGo => "let_go",
            Self::NotLifted => "not_lifted",
            Self::Unstable => "unstable",
        }
    }

    /// Whether the grasp held.
    pub fn is_held(self) -> bool {
        self == Self::Held
    }

    /// State of the grasp of the trial: untried if nothing was simulated, or if the simulation became unstable.
    pub fn state(self) -> PickState {
        match self {
            Self::Held => PickState::Held,
            Self::StartsTooDeep | Self::Unstable => PickState::Untried,
            _ => PickState::Failed,
        }
    }
}

/// State of a free grasp by trials among the neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PickState {
    /// No conclusive trial.
    Untried,
    /// A trial held.
    Held,
    /// A trial failed.
    Failed,
}

impl PickState {
    /// Every state, in the order of their numbers on disk.
    pub const ALL: [Self; 3] = [Self::Untried, Self::Held, Self::Failed];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Untried => "untried",
            Self::Held => "held",
            Self::Failed => "failed",
        }
    }

    /// The label of a grasp whose only trial has this outcome.
    pub fn label(self) -> GraspLabel {
        match self {
            Self::Untried => GraspLabel::Untested,
            Self::Held => GraspLabel::Held,
            Self::Failed => GraspLabel::Failed,
        }
    }

    /// The states of some bytes on disk.
    pub(crate) fn all_of(message: &'static str, field: &'static str, bytes: &[u8]) -> Result<Vec<Self>, RecordError> {
        let state = |byte: &u8| {
            let known = Self::ALL.get(usize::from(*byte)).copied();
            ranged(message, field, f64::from(*byte), known.is_some(), "0 to 2")?;
            Ok(known.unwrap_or(Self::Untried))
        };
        bytes.iter().map(state).collect()
    }
}
