//! Approaches of a hand to a grasp, and their parts.

/// Part of the path of a hand that approaches a grasp and closes, in order of time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum PathStage {
    /// The hand in its posture, where it begins to close.
    Pregrasp,
    /// Along the approach, to the grasp.
    Approach,
    /// Where the hand has come opened: while it takes on its posture.
    Shaping,
    /// While it closes.
    Closing,
}

impl PathStage {
    /// Every stage, in the order of their numbers on disk, from 1.
    pub const ALL: [Self; 4] = [Self::Pregrasp, Self::Approach, Self::Closing, Self::Shaping];

    /// The number on disk, from 1; 0 means none.
    pub fn number(self) -> u8 {
        match self {
            Self::Pregrasp => 1,
            Self::Approach => 2,
            Self::Closing => 3,
            Self::Shaping => 4,
        }
    }

    /// The stage of a number on disk.
    pub fn of_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.number() == number)
    }

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pregrasp => "pregrasp",
            Self::Approach => "approach",
            Self::Shaping => "shaping",
            Self::Closing => "closing",
        }
    }
}

/// A value for each of the two ways in which a hand can approach a grasp.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BothWays<T> {
    /// The hand approaches in the posture in which it begins to close.
    pub shaped: T,
    /// The hand approaches opened, and takes that posture where it begins to close.
    pub opened: T,
}

impl<T> BothWays<T> {
    /// Applies a function to the value of each way.
    pub fn map<U>(self, mut of: impl FnMut(T) -> U) -> BothWays<U> {
        BothWays { shaped: of(self.shaped), opened: of(self.opened) }
    }

    /// References to the values.
    pub fn as_ref(&self) -> BothWays<&T> {
        BothWays { shaped: &self.shaped, opened: &self.opened }
    }
}

/// Ways of approach that are free of obstacles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FreeWays {
    /// Neither.
    None,
    /// Only the opened hand can approach.
    Opened,
    /// Only the hand in its posture can approach.
    Posture,
    /// Both.
    Both,
}

impl FreeWays {
    /// Every choice.
    pub const ALL: [Self; 4] = [Self::None, Self::Opened, Self::Posture, Self::Both];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Opened => "opened",
            Self::Posture => "posture",
            Self::Both => "both",
        }
    }
}

impl From<BothWays<bool>> for FreeWays {
    /// The ways that are true.
    fn from(is_free: BothWays<bool>) -> Self {
        match is_free {
            BothWays { shaped: false, opened: false } => Self::None,
            BothWays { shaped: false, opened: true } => Self::Opened,
            BothWays { shaped: true, opened: false } => Self::Posture,
            BothWays { shaped: true, opened: true } => Self::Both,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_have_numbers_of_their_own() {
        for (number, stage) in (1..).zip(PathStage::ALL) {
            assert_eq!((stage.number(), PathStage::of_number(number)), (number, Some(stage)));
        }
        assert_eq!([0, 5].map(PathStage::of_number), [None; 2]);
    }

    #[test]
    fn free_ways_are_those_that_are_true() {
        let all = [(false, false), (false, true), (true, false), (true, true)];
        assert_eq!(all.map(|(shaped, opened)| FreeWays::from(BothWays { shaped, opened })), FreeWays::ALL);
    }
}
