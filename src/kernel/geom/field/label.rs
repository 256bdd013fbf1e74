//! Labels of poses: reachable or not, and by which proof.

/// Whether an end effector can be brought to a pose.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[repr(u8)]
pub enum PoseLabel {
    /// No joint values within the limits bring it there.
    NoSolution = 0,
    /// Joint values reach the pose, but something collides with all of them.
    Colliding = 1,
    /// Joint values without a collision bring it there.
    Reachable = 2,
}

impl PoseLabel {
    /// Every label, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::NoSolution, Self::Colliding, Self::Reachable];

    /// The label of a number; `None` for any other number.
    pub fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.get(usize::from(byte)).copied()
    }

    /// The name in files and for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoSolution => "no_solution",
            Self::Colliding => "colliding",
            Self::Reachable => "reachable",
        }
    }
}

/// Proof behind a label.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[repr(u8)]
pub enum Proof {
    /// A bound leaves no other: too far away, for one.
    Bound = 0,
    /// The ends of all intervals of solutions were evaluated.
    IntervalEnds = 1,
    /// A certificate covers whole intervals of solutions.
    Swept = 2,
    /// Nothing was found in a search that is no proof.
    Searched = 3,
    /// Joint values that anyone can check: of every reachable pose, and of no other.
    Witness = 4,
}

impl Proof {
    /// Every proof, in the order of their numbers.
    pub const ALL: [Self; 5] = [Self::Bound, Self::IntervalEnds, Self::Swept, Self::Searched, Self::Witness];

    /// The proof of a number; `None` for any other number.
    pub fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.get(usize::from(byte)).copied()
    }

    /// The name in files and for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Bound => "bound",
            Self::IntervalEnds => "interval_ends",
            Self::Swept => "swept",
            Self::Searched => "searched",
            Self::Witness => "witness",
        }
    }

    /// Whether it may replace a label.
    pub fn fits(self, label: PoseLabel) -> bool {
        (self == Self::Witness) == (label == PoseLabel::Reachable)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_are_the_formats() {
        for (byte, label) in (0..).zip(PoseLabel::ALL) {
            assert_eq!((label as u8, PoseLabel::from_byte(byte)), (byte, Some(label)));
        }
        for (byte, proof) in (0..).zip(Proof::ALL) {
            assert_eq!((proof as u8, Proof::from_byte(byte)), (byte, Some(proof)));
        }
        assert_eq!((PoseLabel::from_byte(3), Proof::from_byte(5)), (None, None));
        assert!(Proof::Witness.fits(PoseLabel::Reachable) && !Proof::Witness.fits(PoseLabel::Colliding));
        assert!(Proof::Searched.fits(PoseLabel::NoSolution) && !Proof::Searched.fits(PoseLabel::Reachable));
    }
}
