//! Words of trials: which states are tried, and the verdicts.

use kernel::words::GraspVerdict;

/// Choice of the states that are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum TriedStates {
    /// Only kept grasps.
    Kept,
    /// All states whose closed hand touches with at least two links, regardless of their quality.
    Closed,
}

impl TriedStates {
    /// Every choice.
    pub const ALL: [Self; 2] = [Self::Kept, Self::Closed];

    /// The name on disk.
    pub fn name(self) -> &'static str {
        match self {
            Self::Kept => "kept",
            Self::Closed => "closed",
        }
    }

    /// The choice of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|states| states.name() == name)
    }

    /// Whether a state of this verdict is tried.
    pub fn includes(self, verdict: GraspVerdict) -> bool {
        match self {
            Self::Kept => verdict == GraspVerdict::Kept,
            Self::Closed => verdict.is_closed(),
        }
    }
}

/// Label of a grasp to train on, in which all its trials agree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum GraspLabel {
    /// Nothing is known: the hand starts in the object, or the simulation became unstable. Never a negative.
    Untested,
    /// The grasp held in every trial, and under every condition by which the job confirms that.
    Held,
    /// The grasp failed in every trial, and under every condition by which the job confirms that.
    Failed,
    /// Trials of the grasp disagree: neither a positive nor a negative.
    Borderline,
    /// No trial of the grasp held, but not all were made: its run has as many negatives as the job allows. Neither a positive
    /// nor a negative.
    Unconfirmed,
}

impl GraspLabel {
    /// Every label, in the order of their numbers on disk.
    pub const ALL: [Self; 5] = [Self::Untested, Self::Held, Self::Failed, Self::Borderline, Self::Unconfirmed];

    /// The number on disk, from 1.
    pub(super) fn number(self) -> u32 {
        self as u32 + 1
    }

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Untested => "untested",
            Self::Held => "held",
            Self::Failed => "failed",
            Self::Borderline => "borderline",
            Self::Unconfirmed => "unconfirmed",
        }
    }
}

/// Verdict on a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TrialVerdict {
    /// The object stayed in the hand, and at least two links touch it.
    Held,
    /// The hand starts too deep in the object: nothing was simulated.
    StartsTooDeep,
    /// The closed hand does not touch the object.
    NotTouching,
    /// The closed hand touches it with one link.
    OneLink,
    /// The object left while the hand closed.
    LostClosing,
    /// While it was lifted.
    LostLifting,
    /// While it was shaken.
    LostShaking,
    /// Under one of six directions of gravity.
    LostTurned,
    /// The object stayed, but in the end fewer than two links touch it.
    LetGo,
    /// The simulation became unstable.
    Unstable,
}

impl TrialVerdict {
    /// Every verdict, in the order of their numbers on disk.
    pub const ALL: [Self; 10] = [
        Self::Held,
        Self::StartsTooDeep,
        Self::NotTouching,
        Self::OneLink,
        Self::LostClosing,
        Self::LostLifting,
        Self::LostShaking,
        Self::LostTurned,
        Self::LetGo,
        Self::Unstable,
    ];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::StartsTooDeep => "starts_too_deep",
            Self::NotTouching => "not_touching",
            Self::OneLink => "one_link",
            Self::LostClosing => "lost_closing",
            Self::LostLifting => "lost_lifting",
            Self::LostShaking => "lost_shaking",
            Self::LostTurned => "lost_turned",
            Self::LetGo => "let_go",
            Self::Unstable => "unstable",
        }
    }

    /// The verdict of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|verdict| verdict.name() == name)
    }

    /// Whether the grasp held.
    pub fn is_held(self) -> bool {
        self == Self::Held
    }

    /// Whether the trial is conclusive: a refused or an unstable one is not.
    pub fn is_tested(self) -> bool {
        !matches!(self, Self::StartsTooDeep | Self::Unstable)
    }
}
