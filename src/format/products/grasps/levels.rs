//! Graded labels of grasps: levels of difficulty, and reasons why a grasp fails.

/// Level of difficulty of a physical trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LadderLevel {
    /// Friction higher by half, and half the mass.
    Easy,
    /// The job's conditions.
    Nominal,
    /// Friction lower by 20 %, elliptic friction cones and otherwise MuJoCo's default solver settings, and nothing that supports
    /// the object while the hand closes.
    Adverse,
    /// MuJoCo's default solver settings, and twice the mass.
    Hard,
}

impl LadderLevel {
    /// Every level, the easiest first.
    pub const ALL: [Self; 4] = [Self::Easy, Self::Nominal, Self::Adverse, Self::Hard];

    /// The name on disk.
    pub fn name(self) -> &'static str {
        match self {
            Self::Easy => "easy",
            Self::Nominal => "nominal",
            Self::Adverse => "adverse",
            Self::Hard => "hard",
        }
    }
}

/// Reason why a grasp failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FailureReason {
    /// The object or the table obstructs the hand on both ways of approach.
    Blocked,
    /// The closed hand does not touch the object, which it did not push away.
    Nothing,
    /// The hand pushed the object away while it closed.
    PushedAway,
    /// Two links pressed on the object, and it shot out of the hand while that closed.
    Ejected,
    /// All contacts of the closed hand press towards one side.
    OneSided,
    /// The object slipped during the lift.
    SlippedLift,
    /// The object rotated during the lift.
    RotatedLift,
    /// The object slipped after the lift.
    SlippedShake,
    /// The object rotated after the lift.
    RotatedShake,
    /// The object stayed, but in the end fewer than two links touch it.
    LetGo,
    /// The numbers of the simulation diverged.
    Unstable,
    /// The hand starts too deep in the object or the table: nothing was simulated.
    StartsTooDeep,
}

impl FailureReason {
    /// Every reason, in the order of their numbers on disk, which begin with 1.
    pub const ALL: [Self; 12] = [
        Self::Blocked,
        Self::Nothing,
        Self::PushedAway,
        Self::Ejected,
        Self::OneSided,
        Self::SlippedLift,
        Self::RotatedLift,
        Self::SlippedShake,
        Self::RotatedShake,
        Self::LetGo,
        Self::Unstable,
        Self::StartsTooDeep,
    ];

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blocked => "blocked",
            Self::Nothing => "nothing",
            Self::PushedAway => "pushed_away",
            Self::Ejected => "ejected",
            Self::OneSided => "one_sided",
            Self::SlippedLift => "slipped_lift",
            Self::RotatedLift => "rotated_lift",
            Self::SlippedShake => "slipped_shake",
            Self::RotatedShake => "rotated_shake",
            Self::LetGo => "let_go",
            Self::Unstable => "unstable",
            Self::StartsTooDeep => "starts_too_deep",
        }
    }

    /// The reason of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| reason.name() == name)
    }
}
