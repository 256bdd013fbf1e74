//! A hand that moves straight to an object, stops at the first contact, and closes: gently, each finger until it has
//! its own contact or its limit, or with full force.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Unit, Vector3};

use crate::{
    error::HandError,
    hand::{
        clearance::StraightWay,
        closing::{HandWorker, RunEnd},
        effort::{Effort, MotorCommand},
        link_touch::LinkTouch,
        sim::{Hold, Servo},
    },
    objects::thing::ThingTouch,
    physics::{STEP, Unstable},
};
use kernel::contact::ContactScratch;

/// Speed of a guarded move [m/s]: 20 micrometres per step, so that a hand as heavy as the object stops without a blow.
const SPEED: f64 = 0.01;

/// A hand that is known to be at least this far from the object approaches without simulation [m].
const CLEAR: f64 = 5e-4;

/// Touches of a link that are nearer to each other are one [m].
const SAME_POINT: f64 = 0.002;

/// Steps in which fingers come to rest, at most: a finger that feels takes 1,700 for its whole range.
const MAX_STEPS: u32 = 3_000;

/// Force with which a hand leans on its obstacle [N], number of steps to reach it, and share of the excess that it
/// gives way to per step.
const LEANS: f64 = 1.0;
const STEPS_TO_EASE: u32 = 60;
const EASING: f64 = 0.1;

/// Multiple of the force to which fingers give way that no contact may press with: real fingers would slip or break.
pub const OVERLOAD: f64 = 1.5;

/// A straight movement of the hand, opened or partly closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandApproach {
    /// The approach frame at the start, expressed in the object's frame; z is the direction of motion. The hand is clear of the
    /// object there.
    pub object_from_start: IsometryMatrix3<f64>,
    /// Longest movement [m].
    pub distance: f64,
    /// Share of their range to which the closing joints are closed during the approach, from 0, opened, to 1, closed.
    pub closed: f64,
    /// Effort with which the fingers close in the end.
    pub effort: Effort,
}

/// End of a guarded move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MoveEnd {
    /// The object was touched.
    Touched,
    /// Something else was touched first.
    Blocked,
    /// Nothing did, over the whole movement.
    Free,
    /// The numbers blew up.
    Unstable(Unstable),
}

/// End of an approach.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HandApproachEnd {
    /// The fingers have come to rest.
    AtRest,
    /// The fingers had not come to rest when their steps were used up.
    TimedOut,
    /// The hand touched nothing over the whole movement.
    Missed,
    /// The numbers blew up.
    Unstable,
    /// A contact pressed with more than [`OVERLOAD`] times the force to which the fingers give way.
    Overloaded,
    /// A fixed thing around the object blocked the approaching hand.
    Blocked,
}

/// Result of an approach: the contacts of the hand.
#[derive(Clone, Debug, PartialEq)]
pub struct ApproachOutcome {
    /// End of the approach.
    pub end: HandApproachEnd,
    /// Steps of 2 ms that were simulated.
    pub steps: u32,
    /// Distance that the hand had moved at the first contact, or the whole movement [m].
    pub travelled: f64,
    /// The hand's base in the end, expressed in the object's frame.
    pub object_from_base: IsometryMatrix3<f64>,
    /// Values of all joints in the end [rad or m], in the order of the hand's tree.
    pub joints: Vec<f64>,
    /// Touches that pressed on the object when the hand stopped but not at the end, and those at the end, expressed in
    /// the object's frame; none if the numbers became unstable or a contact pressed too hard.
    pub touches: Vec<LinkTouch>,
    /// Touches of fixed things around the object: for a blocked hand, where it stopped; otherwise as for the object.
    pub stops: Vec<ThingTouch>,
}

impl HandWorker {
    /// Moves the hand along a direction of its base at a speed [m/s], its fingers at rest, until something touches the
    /// object or a fixed thing around it, at most by `distance` [m]: then it stops. (In simulation the object moves, in
    /// the opposite direction.)
    pub fn guarded_move(&mut self, direction: &Unit<Vector3<f64>>, speed: f64, distance: f64) -> MoveEnd {
        let hold = vec![MotorCommand::Hold; self.sim.hand().driven().len()];
        let step = self.base_from_mount.rotation.inverse() * direction.into_inner() * (-speed * STEP);
        let mut end = MoveEnd::Free;
        for _ in 0..(distance / (speed * STEP)).ceil() as u32 {
            self.slid += step;
            if let Err(unstable) = self.step(&hold) {
                return MoveEnd::Unstable(unstable);
            }
            if self.touches().iter().any(|touch| touch.force > 0.0) {
                end = MoveEnd::Touched;
                break;
            }
            if self.thing_touches().iter().any(|(_, touch)| touch.force > 0.0) {
                end = MoveEnd::Blocked;
                break;
            }
        }
        self.stopped_by = if end == MoveEnd::Touched { self.presses() } else { Vec::new() };
        // The moving part lags behind its command.
        let slides = self.slides();
        let at = |axis: usize| self.data.qpos()[slides[axis].address];
        self.slid = Vector3::from_fn(|axis, _| at(axis));
        if end == MoveEnd::Touched { self.ease(direction, &hold) } else { end }
    }

    /// Slides that hold the object.
    fn slides(&self) -> [Servo; 3] {
        let Hold::Slides(slides) = self.sim.hold else { unreachable!("a free object is only in trials") };
        slides
    }

    /// Gives way until the hand leans on what it touches with [`LEANS`] along a direction.
    fn ease(&mut self, direction: &Unit<Vector3<f64>>, hold: &[MotorCommand]) -> MoveEnd {
        let ahead = self.base_from_mount.rotation.inverse() * direction.into_inner();
        let stiffness = self.slides()[0].stiffness;
        for _ in 0..STEPS_TO_EASE {
            let touches = self.touches().into_iter().chain(self.thing_touches().into_iter().map(|(_, touch)| touch));
            let leans: f64 = touches.map(|touch| -touch.force * touch.normal.dot(direction)).sum();
            self.slid += ahead * (EASING * (leans - LEANS) / stiffness);
            if let Err(unstable) = self.step(hold) {
                return MoveEnd::Unstable(unstable);
            }
        }
        MoveEnd::Touched
    }

    /// Opens the hand, as far as the approach requires, brings it near, and lets it feel; earlier runs leave no trace.
    ///
    /// # Errors
    /// When the start is not finite.
    pub fn feel(&mut self, approach: &HandApproach) -> Result<ApproachOutcome, HandError> {
        // The straight approach: posture, frames of the links and direction.
        let hand = Arc::clone(self.hand());
        let posture = hand.partly_closed(approach.closed);
        let frames = hand.link_frames(&hand.posture_values(&posture));
        let base_from_approach = *hand.approach_pose(&frames).isometry();
        let way = StraightWay {
            frames: &frames,
            object_from_start: approach.object_from_start * base_from_approach.inverse(),
            direction: approach.object_from_start.rotation * Vector3::z(),
        };
        // Skip the part of the path that is far from the object, by lower bounds of the distance.
        let mut travelled = 0.0;
        while let Some(clearance) = self.sim.clearance_at_least(&frames, &way.moved(travelled)) {
            if clearance < CLEAR || travelled >= approach.distance {
                break;
            }
            travelled = (travelled + clearance).min(approach.distance);
        }
        // A fixed thing that the hand would meet on the skipped part ends the approach.
        if let Some((travelled, stop)) = self.sim.first_met(&way, travelled, &mut ContactScratch::default()) {
            let (object_from_base, joints) = (way.moved(travelled), hand.posture_values(&posture));
            let (end, touches) = (HandApproachEnd::Blocked, Vec::new());
            return Ok(ApproachOutcome {
                end,
                steps: 0,
                travelled,
                object_from_base,
                joints,
                touches,
                stops: vec![stop],
            });
        }
        // Simulate the rest: stop at the first contact, then close.
        self.start(&posture, &way.moved(travelled).inverse())?;
        let ahead = Unit::new_normalize(base_from_approach.rotation * Vector3::z());
        let (mut touches, mut stops) = (Vec::new(), Vec::new());
        let end = match self.guarded_move(&ahead, SPEED, approach.distance - travelled) {
            MoveEnd::Touched => {
                // The fingers' pressure may open the contacts that stopped the hand.
                (touches, stops) = (self.presses(), self.stops());
                self.set_effort(approach.effort);
                match self.close(MAX_STEPS).end {
                    RunEnd::AtRest => HandApproachEnd::AtRest,
                    RunEnd::TimedOut => HandApproachEnd::TimedOut,
                    RunEnd::Unstable(_) => HandApproachEnd::Unstable,
                }
            }
            MoveEnd::Blocked => {
                stops = self.stops();
                HandApproachEnd::Blocked
            }
            MoveEnd::Free => HandApproachEnd::Missed,
            MoveEnd::Unstable(_) => HandApproachEnd::Unstable,
        };
        // The object moved instead of the hand: the travelled distance is along the approach.
        let object_from_base = self.base_from_object().inverse();
        let came = (object_from_base.translation.vector - way.object_from_start.translation.vector).dot(&way.direction);
        let end = match end {
            HandApproachEnd::AtRest | HandApproachEnd::TimedOut => {
                let max_force = OVERLOAD * approach.effort.max_force;
                if self.add_last(&mut touches, &mut stops, max_force) { HandApproachEnd::Overloaded } else { end }
            }
            end => end,
        };
        // Touches of runs without a valid end are dropped.
        if !matches!(end, HandApproachEnd::AtRest | HandApproachEnd::TimedOut) {
            touches.clear();
        }
        if !matches!(end, HandApproachEnd::AtRest | HandApproachEnd::TimedOut | HandApproachEnd::Blocked) {
            stops.clear();
        }
        let steps = self.steps();
        Ok(ApproachOutcome { end, steps, travelled: came, object_from_base, joints: self.joints(), touches, stops })
    }

    /// Adds the touches of a hand at rest to those of its stop; whether one presses with more than a force [N].
    fn add_last(&self, touches: &mut Vec<LinkTouch>, stops: &mut Vec<ThingTouch>, max_force: f64) -> bool {
        let last = self.presses();
        touches.retain(|first| !last.iter().any(|touch| is_same(first, touch)));
        touches.extend(last);
        let last = self.stops();
        stops.retain(|first| !last.iter().any(|stop| is_same_stop(first, stop)));
        stops.extend(last);
        let on_things = self.thing_touches().into_iter().map(|(_, touch)| touch.force);
        let is_too_hard = touches.iter().map(|touch| touch.force).chain(on_things).any(|force| force > max_force);
        // Contacts that stopped the hand stay at the position where they opened: nothing presses there any longer.
        if !self.sim.still.is_empty() {
            let stopped = self.stopped_by.iter().filter(|first| !touches.iter().any(|touch| is_same(first, touch)));
            let stopped: Vec<LinkTouch> = stopped.map(|first| LinkTouch { force: 0.0, ..*first }).collect();
            touches.splice(0..0, stopped);
        }
        is_too_hard
    }

    /// Touches that press on the object now, expressed in the object's frame.
    fn presses(&self) -> Vec<LinkTouch> {
        let object_from_base = self.base_from_object().inverse();
        let seen = |touch: LinkTouch| LinkTouch {
            point: object_from_base * touch.point,
            normal: object_from_base.rotation * touch.normal,
            ..touch
        };
        self.touches().into_iter().filter(|touch| touch.force > 0.0).map(seen).collect()
    }

    /// Touches that press on things around the object now, expressed in the object's frame.
    fn stops(&self) -> Vec<ThingTouch> {
        let object_from_base = self.base_from_object().inverse();
        let pressing = self.thing_touches().into_iter().filter(|(_, touch)| touch.force > 0.0);
        pressing
            .map(|(thing, LinkTouch { link, point, .. })| ThingTouch { thing, link, point: object_from_base * point })
            .collect()
    }
}

/// Whether two touches of a thing are one, a moment apart.
fn is_same_stop(first: &ThingTouch, then: &ThingTouch) -> bool {
    (first.thing, first.link) == (then.thing, then.link) && (first.point - then.point).norm() < SAME_POINT
}

/// Whether two touches are one, a moment apart.
fn is_same(first: &LinkTouch, then: &LinkTouch) -> bool {
    first.link == then.link && (first.point - then.point).norm() < SAME_POINT
}
