//! A hand that comes straight to an object, stops where it touches first, and closes: gently, each finger until it has its own
//! contact or its limit, or with all its force.

use nalgebra::{IsometryMatrix3, Translation3, Unit, Vector3};

use super::{
    closing::{Effort, HandWorker, LinkTouch, MoveEnd, RunEnd},
    error::HandError,
};

/// Speed of a guarded move [m/s]: 60 micrometres a step.
const SPEED: f64 = 0.03;

/// A hand that is known to be so far from the object at least comes nearer without simulation [m].
const CLEAR: f64 = 5e-4;

/// Steps in which fingers come to rest, at most: a finger that feels takes 1,700 for its whole way.
const MOST_STEPS: u32 = 3_000;

/// A straight way of the opened hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandApproach {
    /// The approach frame at the start, seen from the object; z is the way. The hand is clear of the object there.
    pub object_from_start: IsometryMatrix3<f64>,
    /// How far it goes at most [m].
    pub way: f64,
    /// How its fingers close in the end.
    pub effort: Effort,
}

/// How an approach ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ApproachEnd {
    /// The fingers have come to rest.
    AtRest,
    /// They had not when their steps were used up.
    TimedOut,
    /// The hand touched nothing all the way.
    Missed,
    /// The numbers blew up.
    Unstable,
}

/// What a hand felt.
#[derive(Clone, Debug, PartialEq)]
pub struct Felt {
    /// How it ended.
    pub end: ApproachEnd,
    /// Steps of 2 ms that were simulated.
    pub steps: u32,
    /// How far the hand had come when it touched first, or all the way [m].
    pub travelled: f64,
    /// The hand's base in the end, seen from the object.
    pub object_from_base: IsometryMatrix3<f64>,
    /// Values of all joints in the end [rad or m], in the order of the hand's tree.
    pub joints: Vec<f64>,
    /// What presses on the object in the end, seen from the object; nothing where the numbers blew up.
    pub touches: Vec<LinkTouch>,
}

impl HandWorker {
    /// Opens the hand, brings it near, and lets it feel; the runs before leave no trace.
    ///
    /// # Errors
    /// When the start is not finite.
    pub fn feel(&mut self, approach: &HandApproach) -> Result<Felt, HandError> {
        let hand = std::sync::Arc::clone(self.hand());
        let opened = hand.opened();
        let frames = hand.link_frames(&hand.posture_values(&opened));
        let base_from_approach = *hand.approach_pose(&frames).isometry();
        let way = approach.object_from_start.rotation * Vector3::z();
        let start = approach.object_from_start * base_from_approach.inverse();
        let moved = |by: f64| Translation3::from(way * by) * start;
        let mut travelled = 0.0;
        while let Some(clearance) = self.sim().clearance_at_least(&frames, &moved(travelled)) {
            if clearance < CLEAR || travelled >= approach.way {
                break;
            }
            travelled = (travelled + clearance).min(approach.way);
        }
        self.start(&opened, &moved(travelled).inverse())?;
        let ahead = Unit::new_normalize(base_from_approach.rotation * Vector3::z());
        let end = match self.guarded_move(&ahead, SPEED, approach.way - travelled) {
            MoveEnd::Touched => {
                self.set_effort(approach.effort);
                match self.close(MOST_STEPS).end {
                    RunEnd::AtRest => ApproachEnd::AtRest,
                    RunEnd::TimedOut => ApproachEnd::TimedOut,
                    RunEnd::Unstable(_) => ApproachEnd::Unstable,
                }
            }
            MoveEnd::Free => ApproachEnd::Missed,
            MoveEnd::Unstable(_) => ApproachEnd::Unstable,
        };
        let object_from_base = self.base_from_object().inverse();
        let came = (object_from_base.translation.vector - start.translation.vector).dot(&way);
        let seen = |touch: LinkTouch| LinkTouch {
            point: object_from_base * touch.point,
            normal: object_from_base.rotation * touch.normal,
            ..touch
        };
        let presses = |touch: &LinkTouch| touch.force > 0.0;
        let touches = match end {
            ApproachEnd::Missed | ApproachEnd::Unstable => Vec::new(),
            _ => self.touches().into_iter().filter(presses).map(seen).collect(),
        };
        let steps = self.steps();
        Ok(Felt { end, steps, travelled: came, object_from_base, joints: self.joints(), touches })
    }
}
