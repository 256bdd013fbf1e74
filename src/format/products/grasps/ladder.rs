//! Graded labels: each tried grasp under conditions of rising difficulty, with the margin and the reason of a loss.

use super::{ClosedHand, FailureReason, LadderFacts, LadderLevel, TrialOutcome, TriedStates, WayObstacles};
use kernel::{ids::SampleId, words::BothWays};

/// Share of the levels from which on a grasp is labelled held: all but the hardest.
pub const HELD_SHARE: f64 = 0.75;

/// Number of levels.
pub(super) const LEVELS: usize = LadderLevel::ALL.len();

/// Conditions of the levels.
#[derive(Clone, Debug, PartialEq)]
pub struct LadderMethod {
    /// Coefficient of friction of the object against the hand at [`LadderLevel::Nominal`].
    pub friction: f64,
    /// Torsional friction of a contact about its normal [m].
    pub torsion: f64,
    /// Mass of the object at that level [kg].
    pub mass: f64,
    /// Origin of the mass: `job`, `table`, `material` or `hull`.
    pub mass_from: String,
    /// Source of the figure, or the material, in words; may be empty.
    pub mass_source: String,
    /// States that are tried; all others are untried, which does not mean that they fail.
    pub tried: TriedStates,
    /// Friction of the object against the table; `None` where grasps are tried in the air alone.
    pub table_friction: Option<f64>,
    /// Displacement [m] and rotation [rad] in the hand beyond which the object is lost.
    pub lost: [f64; 2],
    /// Distance up to which a lost object is followed [m].
    pub followed: f64,
}

/// A trial at one level.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelTrial {
    /// Outcome of the trial; [`TrialOutcome::farthest`] is that of the object as far as it was followed.
    pub outcome: TrialOutcome,
    /// Why it failed; `None` if it held.
    pub reason: Option<FailureReason>,
    /// Index of the phase of [`TrialOutcome::farthest`] in [`trial_phases`](super::trial_phases).
    pub farthest_phase: u32,
    /// Largest rotation of the object in the hand since gravity was switched on [rad].
    pub rotation: f64,
    /// Index of its phase.
    pub rotation_phase: u32,
    /// Whether a link pressed on the object while the hand closed.
    pub touched: bool,
    /// Displacement of the object [m], and its rotation [rad], while the hand closed.
    pub closing: [f64; 2],
    /// Largest speed of the object while the hand closed, after two links had pressed on it [m/s].
    pub pressed_speed: f64,
    /// Links that pressed on the object when the hand had closed.
    pub closed_links: u32,
    /// Magnitude of the sum of the normal forces then by the sum of their magnitudes: 0 for a symmetric closure, 1 for forces
    /// in one direction.
    pub imbalance: f64,
}

/// One level of a grasp.
#[derive(Clone, Debug, PartialEq)]
pub enum LevelResult {
    /// A trial was made.
    Tried(Box<LevelTrial>),
    /// Whether it holds follows from another level.
    Inferred(bool),
    /// Nothing is known.
    Unknown,
}

impl LevelResult {
    /// Whether the grasp holds at the level; `None` if that is unknown, or its trial was inconclusive.
    pub fn holds(&self) -> Option<bool> {
        match self {
            Self::Tried(trial) => trial.holds(),
            Self::Inferred(holds) => Some(*holds),
            Self::Unknown => None,
        }
    }

    /// The trial, if one was made.
    pub fn trial(&self) -> Option<&LevelTrial> {
        if let Self::Tried(trial) = self { Some(trial) } else { None }
    }
}

impl LevelTrial {
    /// Whether the grasp held; `None` if the trial was inconclusive.
    pub fn holds(&self) -> Option<bool> {
        let verdict = self.outcome.verdict;
        verdict.is_tested().then(|| verdict.is_held())
    }

    /// Deepest overlap of hand and object from when the hand had closed [m].
    pub fn deepest(&self) -> f64 {
        let [_, closed, shaken] = self.outcome.penetration;
        closed.max(shaken)
    }
}

/// Label of a grasp by its levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LadderLabel {
    /// The trial at [`LadderLevel::Nominal`] was inconclusive. Never a negative.
    Untested,
    /// The grasp holds at [`HELD_SHARE`] of the levels or more.
    Held,
    /// The grasp holds at fewer levels, or at none by one motor law and at the easiest by the other.
    Partial,
    /// The grasp holds at no level, and at the easiest by neither motor law.
    Failed,
    /// Both ways of approach are blocked: it fails by its way, and no trial was made.
    Blocked,
}

impl LadderLabel {
    /// Every label, in the order of their numbers on disk.
    pub const ALL: [Self; 5] = [Self::Untested, Self::Held, Self::Partial, Self::Failed, Self::Blocked];

    /// The number on disk, from 1.
    pub(super) fn number(self) -> u32 {
        self as u32 + 1
    }

    /// The name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Untested => "untested",
            Self::Held => "held",
            Self::Partial => "partial",
            Self::Failed => "failed",
            Self::Blocked => "blocked",
        }
    }
}

/// The levels of one grasp.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspLadder {
    /// Index in [`GraspRun::grasps`](super::GraspRun::grasps).
    pub grasp: u32,
    /// Index in the resting poses of the object whose table carries it, by which `obstacles` are determined, too; `None` in
    /// the air.
    pub resting_pose: Option<u32>,
    /// Obstacles on both ways of approach.
    pub obstacles: BothWays<WayObstacles>,
    /// Results in the order of [`LadderLevel::ALL`]; `None` if both ways are blocked.
    pub levels: Option<[LevelResult; LEVELS]>,
    /// The trial at [`LadderLevel::Easy`] under the other motor law, of a grasp that lost that level.
    pub second_law: Option<Box<LevelTrial>>,
    /// The closed hand at [`LadderLevel::Nominal`], if it closed.
    pub closed: Option<ClosedHand>,
}

impl GraspLadder {
    /// Result of a level; `None` if both ways are blocked.
    pub fn level(&self, level: LadderLevel) -> Option<&LevelResult> {
        self.levels.as_ref().map(|levels| &levels[level as usize])
    }

    /// Levels at which the grasp holds: tried, or inferred.
    pub fn levels_held(&self) -> usize {
        self.levels.iter().flatten().filter(|level| level.holds() == Some(true)).count()
    }

    /// Trials that were made, that of the second motor law included.
    pub fn trials(&self) -> usize {
        self.levels.iter().flatten().filter_map(LevelResult::trial).count() + usize::from(self.second_law.is_some())
    }

    /// Share of the levels at which the grasp holds, 0 to 1: 0 if both ways are blocked; `None` if the trial at
    /// [`LadderLevel::Nominal`] was inconclusive.
    pub fn success(&self) -> Option<f64> {
        match self.level(LadderLevel::Nominal) {
            None => Some(0.0),
            Some(nominal) => nominal.holds().map(|_| self.levels_held() as f64 / LEVELS as f64),
        }
    }

    /// The label with a threshold of [`HELD_SHARE`].
    pub fn label(&self) -> LadderLabel {
        self.label_from(HELD_SHARE)
    }

    /// The label where a grasp is held from a share of the levels on.
    pub fn label_from(&self, held: f64) -> LadderLabel {
        let Some(success) = self.success() else { return LadderLabel::Untested };
        let easy = self.level(LadderLevel::Easy).and_then(LevelResult::holds);
        let by_other_law = self.second_law.as_ref().and_then(|trial| trial.holds());
        match (&self.levels, easy, by_other_law) {
            (None, ..) => LadderLabel::Blocked,
            _ if success > 0.0 && success >= held => LadderLabel::Held,
            (_, Some(false), Some(false)) => LadderLabel::Failed,
            _ => LadderLabel::Partial,
        }
    }

    /// Why the grasp failed at [`LadderLevel::Nominal`], or, if it held there, at the easiest level whose trial it lost; `None`
    /// if it lost none.
    pub fn reason(&self) -> Option<FailureReason> {
        let Some(levels) = &self.levels else { return Some(FailureReason::Blocked) };
        let from_nominal = &levels[LadderLevel::Nominal as usize..];
        from_nominal.iter().filter_map(LevelResult::trial).find_map(|trial| trial.reason)
    }
}

/// Graded labels of the grasps of one run.
#[derive(Clone, Debug, PartialEq)]
pub struct GraspLadders {
    /// Which sample.
    pub sample: SampleId,
    /// The hand's name.
    pub hand: String,
    /// Links of the hand; the base is the first.
    pub links: Vec<String>,
    /// Number of joints of the hand.
    pub joints: u32,
    /// Conditions of the levels.
    pub method: LadderMethod,
    /// One per tried grasp, in their order.
    pub ladders: Vec<GraspLadder>,
}

impl GraspLadders {
    /// Counts for tables.
    pub fn facts(&self) -> LadderFacts {
        let labelled = |label: LadderLabel| self.ladders.iter().filter(|ladder| ladder.label() == label).count() as u32;
        LadderFacts {
            tried: self.ladders.len() as u32,
            held: labelled(LadderLabel::Held),
            partial: labelled(LadderLabel::Partial),
            failed: labelled(LadderLabel::Failed),
            blocked: labelled(LadderLabel::Blocked),
            trials: self.ladders.iter().map(|ladder| ladder.trials() as u32).sum(),
        }
    }

    /// The ladder of a grasp; `None` if it was not tried.
    pub fn ladder_of(&self, grasp: u32) -> Option<&GraspLadder> {
        let found = self.ladders.binary_search_by_key(&grasp, |ladder| ladder.grasp);
        found.ok().map(|index| &self.ladders[index])
    }
}
