//! Outcome of a trial among other objects.

use nalgebra::IsometryMatrix3;

use crate::{
    hand::link_touch::LinkTouch,
    physics::{STEP, Unstable},
};

/// A part of a trial in a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ClutterPhase {
    /// The hand approaches.
    Approach,
    /// The hand closes.
    Closing,
    /// The hand lifts.
    Lift,
    /// The hand holds the target.
    Hold,
}

/// Verdict on a trial in a scene, with the reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClutterVerdict {
    /// The target is lifted and stayed in the hand, and two links at least touch it.
    Held,
    /// The hand starts so deep in something [m] that nothing was simulated.
    Refused {
        /// Deepest [m].
        penetration: f64,
    },
    /// The closed hand does not touch the target.
    NotTouching,
    /// The closed hand touches it with one link.
    OneLink,
    /// The target moved or rotated too far in the hand.
    Lost {
        /// When.
        phase: ClutterPhase,
        /// Since the trial began [s].
        time: f64,
    },
    /// In the end fewer than two links touch the target.
    LetGo {
        /// Number of links that touch it.
        links: usize,
    },
    /// The target stayed in the hand, but is not as far up as it should be.
    NotLifted {
        /// Height by which its centre of mass rose [m].
        height: f64,
    },
    /// The numbers blew up.
    Unstable {
        /// When.
        phase: ClutterPhase,
        /// The step, and the event.
        what: Unstable,
    },
}

impl ClutterVerdict {
    /// Whether the grasp held.
    pub fn is_held(&self) -> bool {
        *self == Self::Held
    }

    /// A word for ledgers.
    pub fn reason(&self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::Refused { .. } => "starts_too_deep",
            Self::NotTouching => "not_touching",
            Self::OneLink => "one_link",
            Self::Lost { phase: ClutterPhase::Approach, .. } => "lost_approaching",
            Self::Lost { phase: ClutterPhase::Closing, .. } => "lost_closing",
            Self::Lost { phase: ClutterPhase::Lift, .. } => "lost_lifting",
            Self::Lost { phase: ClutterPhase::Hold, .. } => "lost_holding",
            Self::LetGo { .. } => "let_go",
            Self::NotLifted { .. } => "not_lifted",
            Self::Unstable { .. } => "unstable",
        }
    }
}

/// Something other than the target on which the hand pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClutterTouch {
    /// Index of the body in the scene; `None` for the container.
    pub body: Option<usize>,
    /// Part of the trial in which it was touched first.
    pub phase: ClutterPhase,
    /// When it was touched first, since the trial began [s].
    pub time: f64,
    /// The largest normal force of one contact [N].
    pub force: f64,
}

/// Motion of a body other than the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NeighbourMotion {
    /// Index of the body in the scene.
    pub body: usize,
    /// Largest distance of its centre of mass from its first position [m].
    pub moved: f64,
    /// Height by which its centre of mass is up in the end [m].
    pub raised: f64,
}

/// Outcome of a trial in a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ClutterOutcome {
    /// Verdict on the trial.
    pub verdict: ClutterVerdict,
    /// Things other than the target on which the hand pressed, in order of time; bodies with a first touch in the same
    /// step by their indices, the container before them.
    pub touched: Vec<ClutterTouch>,
    /// Motions of the neighbours that were awake, by their indices.
    pub neighbours: Vec<NeighbourMotion>,
    /// The target in the closed hand, expressed in its base frame; `None` if the hand did not get that far.
    pub closed: Option<IsometryMatrix3<f64>>,
    /// Touches on the target in the closed hand, expressed in the base frame of the hand.
    pub touches: Vec<LinkTouch>,
    /// Height by which the target's centre of mass is up in the end [m].
    pub raised: f64,
    /// Deepest overlap of hand and target since the hand had closed [m].
    pub penetration: f64,
    /// Steps of 2 ms that were simulated.
    pub steps: u32,
}

impl ClutterOutcome {
    /// Simulated time of the trial [s].
    pub fn time(&self) -> f64 {
        f64::from(self.steps) * STEP
    }

    /// Bodies that were lifted with the target, by at least a height [m].
    pub fn carried(&self, height: f64) -> impl Iterator<Item = usize> {
        self.neighbours.iter().filter(move |motion| motion.raised >= height).map(|motion| motion.body)
    }
}
