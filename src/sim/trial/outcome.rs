//! Outcome of a trial.

use nalgebra::{IsometryMatrix3, Vector3};

use super::{Margins, Phase, Series};
use crate::{
    hand::link_touch::LinkTouch,
    physics::{STEP, Unstable},
};
use robot::hand::Motor;

/// Verdict on a trial, with the reason.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The object stayed, and at least two links touch it.
    Held,
    /// The hand starts so deep in the object or the table [m] that nothing was simulated.
    Refused {
        /// Deepest [m].
        penetration: f64,
    },
    /// The closed hand does not touch the object.
    NotTouching,
    /// The closed hand touches it with one link.
    OneLink,
    /// The object moved or rotated too far.
    Lost {
        /// When.
        phase: Phase,
        /// Since the trial began [s].
        time: f64,
    },
    /// The object stayed where it is, but in the end fewer than two links touch it.
    LetGo {
        /// Number of links that touch it.
        links: usize,
    },
    /// The numbers blew up.
    Unstable {
        /// When.
        phase: Phase,
        /// The step, and the event.
        what: Unstable,
    },
}

impl Verdict {
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
            Self::Lost { phase: Phase::Closing, .. } => "lost_closing",
            Self::Lost { phase: Phase::Lift, .. } => "lost_lifting",
            Self::Lost { phase: Phase::Shake, .. } => "lost_shaking",
            Self::Lost { phase: Phase::Turned(_), .. } => "lost_turned",
            Self::LetGo { .. } => "let_go",
            Self::Unstable { .. } => "unstable",
        }
    }
}

/// Where a trial began.
#[derive(Clone, Debug, PartialEq)]
pub struct Start {
    /// The posture, one value per driven joint [rad or m]: as requested, or with its fingers backed off.
    pub posture: Vec<f64>,
    /// The object, expressed in the hand's base frame: as requested, with the conditions' errors, and the hand drawn
    /// back.
    pub base_from_object: IsometryMatrix3<f64>,
    /// Penetration of the object by the hand [m], 0 where it is clear; by exact distances from the true mesh.
    pub penetration: f64,
    /// Depth of the hand's lowest point below the table [m], 0 if it is clear or there is no table.
    pub table_penetration: f64,
    /// Share of their range from closed to opened that the fingers have backed off, 0 to 1.
    pub opened_by: f64,
    /// Distance that the hand has drawn back along its approach [m].
    pub drawn_back: f64,
}

/// A hand on its object, at one moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Grip {
    /// Values of all joints [rad or m], in the order of the hand's tree.
    pub joints: Vec<f64>,
    /// The motors, one per driven joint.
    pub motors: Vec<Motor>,
    /// The object, expressed in the hand's base frame.
    pub base_from_object: IsometryMatrix3<f64>,
    /// Touches that press on the object, expressed in the base frame of the hand.
    pub touches: Vec<LinkTouch>,
}

impl Grip {
    /// The links that press on the object, in order.
    pub fn links(&self) -> Vec<usize> {
        pressing_links(&self.touches)
    }

    /// Sum of the normal forces of a link [N].
    pub fn force_of(&self, link: usize) -> f64 {
        self.touches.iter().filter(|touch| touch.link == link).map(|touch| touch.force).sum()
    }

    /// Sum of all normal forces [N].
    pub fn force(&self) -> f64 {
        self.touches.iter().map(|touch| touch.force).sum()
    }

    /// The largest normal force of a contact [N].
    pub fn largest_force(&self) -> f64 {
        self.touches.iter().map(|touch| touch.force).fold(0.0, f64::max)
    }

    /// Magnitude of the sum of the normal forces by the sum of their magnitudes: 0 for forces that balance each other, 1 for
    /// forces in one direction, and without any.
    pub fn imbalance(&self) -> f64 {
        let all = self.force();
        let sum: Vector3<f64> = self.touches.iter().map(|touch| touch.normal.into_inner() * touch.force).sum();
        if all > 0.0 { (sum.norm() / all).min(1.0) } else { 1.0 }
    }

    /// Whether all contacts press towards one side: no two of their normals are more than 90 degrees apart.
    pub fn is_one_sided(&self) -> bool {
        let pressing: Vec<&LinkTouch> = self.touches.iter().filter(|touch| touch.force > 0.0).collect();
        pressing.iter().all(|one| pressing.iter().all(|other| one.normal.dot(&other.normal) >= 0.0))
    }

    /// Deepest penetration of the object by the hand [m], by exact distances from the true mesh.
    pub fn penetration(&self) -> f64 {
        deepest(&self.touches)
    }
}

/// The links that press on an object, in order.
pub(crate) fn pressing_links(touches: &[LinkTouch]) -> Vec<usize> {
    let mut links: Vec<usize> = touches.iter().filter(|touch| touch.force > 0.0).map(|touch| touch.link).collect();
    links.sort_unstable();
    links.dedup();
    links
}

/// Deepest penetration of an object by the links that touch it [m].
pub(crate) fn deepest(touches: &[LinkTouch]) -> f64 {
    touches.iter().map(|touch| -touch.distance).fold(0.0, f64::max)
}

/// Motion of the object in the hand during a phase that it completed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// Which.
    pub phase: Phase,
    /// Distance of the centre of mass from where it was when the phase began [m].
    pub moved: f64,
    /// Angle of rotation [rad].
    pub turned: f64,
    /// `moved` by the phase's time [m/s].
    pub rate: f64,
}

/// Outcome of a trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// Verdict on the trial.
    pub verdict: Verdict,
    /// Where it began.
    pub start: Start,
    /// The closed hand, if the trial got that far.
    pub closed: Option<Grip>,
    /// Whether the closed hand had come to rest before its time was used up.
    pub closed_at_rest: bool,
    /// Duration of closing [s].
    pub closing_time: f64,
    /// Slips, one per phase that the object completed.
    pub slips: Vec<Slip>,
    /// Largest distance of the centre of mass from where it was when gravity came on [m].
    pub farthest: f64,
    /// Deepest overlap of hand and object since then [m].
    pub shaken_penetration: f64,
    /// The hand in the end, or when the trial was decided; `None` where nothing was simulated, or the numbers blew up.
    pub end: Option<Grip>,
    /// Steps of 2 ms that were simulated.
    pub steps: u32,
    /// Number of MuJoCo's warnings.
    pub warnings: u32,
    /// Forces and drift over time; `None` unless the conditions request them.
    pub series: Option<Series>,
    /// Motion of the object and the reason of a loss; `None` unless the conditions request it.
    pub margins: Option<Margins>,
}

impl Outcome {
    /// Simulated time of the trial [s].
    pub fn time(&self) -> f64 {
        f64::from(self.steps) * STEP
    }
}
