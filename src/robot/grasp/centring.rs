//! Centring: a gripper whose one motor slides two pads towards each other gives way until both hold the object.
//!
//! Closing by kinematics stops the motor when the first pad meets the object. A real gripper continues: it pushes the
//! object, or its arm gives way, until the other pad also touches; squeezed between the two, the object rotates to
//! where it is narrowest.

use nalgebra::{IsometryMatrix3, Point3, Rotation3, Translation3, Unit, Vector3};

use super::closing::{Closed, Closing, Gaps, MAX_STEPS_OF_CLOSING, TOUCHES};
use crate::hand::Motor;
use kernel::contact::ContactSurface;

/// Share of a motion along a surface above which it presses into the surface.
const PRESSES: f64 = 1e-6;

/// First and smallest rotation of a squeezed object [rad]: by the smallest, a pad 60 mm long is off by less than what touches.
const STEPS: [f64; 2] = [0.04, 2e-4];

/// Rotations that are tried, and how far they lead in all [rad].
const MAX_STEPS: u32 = 60;
const FARTHEST: f64 = 0.35;

/// Distances by which the hand backs off if its palm prevents contact [m]: the first that lets both pads touch is used.
const RETREATS: [f64; 4] = [0.0, 0.002, 0.005, 0.01];

/// Narrower by less is as narrow [m].
const NARROWER: f64 = 1e-8;

/// A gripper with both pads on the object.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Centred {
    pub(super) closed: Closed,
    pub(super) object_from_base: IsometryMatrix3<f64>,
    /// Between the pads [m].
    width: f64,
    /// Where the pads touch, the middle of each one's contacts.
    held: [Point3<f64>; 2],
}

/// Result of closing a gripper at one pose.
enum Grip {
    Holds(Box<Centred>),
    /// No narrower than it has to be: not looked into further.
    Wide,
    /// One pad never touches, or the opened hand is in the object.
    Misses,
}

impl Closing {
    /// Closes a hand with a line between its pads, and gives way until both touch and the width has a local minimum.
    /// `None` for another hand, and where both sides never touch, or the hand in its posture would be in the object by
    /// more than `max_overlap` [m].
    pub(super) fn centred(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
        max_overlap: f64,
    ) -> Option<Centred> {
        let (_, line) = self.line?;
        let mut best = self.gripped(surface, object_from_base, posture, max_overlap, f64::INFINITY)?;
        let mut step = STEPS[0];
        for _ in 0..MAX_STEPS {
            let Some(next) = best.rotated(&line, step) else { break };
            let trace = (object_from_base.rotation.inverse() * next.rotation).matrix().trace();
            let next = Some(next).filter(|_| trace > 1.0 + 2.0 * libm::cos(FARTHEST));
            let narrower = best.width - NARROWER;
            match next.and_then(|next| self.gripped(surface, &next, posture, max_overlap, narrower)) {
                Some(next) => best = next,
                None if step < STEPS[1] => break,
                None => step /= 2.0,
            }
        }
        Some(best)
    }

    /// Closes the hand, and gives way along the line between its pads until both touch; where they do not, from a little
    /// farther back along its approach. `None` where the width between the pads is not below `width` [m].
    fn gripped(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
        max_overlap: f64,
        width: f64,
    ) -> Option<Centred> {
        let frames = self.hand.link_frames(&self.hand.posture_values(posture));
        let back = self.hand.approach_pose(&frames).isometry().rotation * -Vector3::z();
        let there = |retreat: &f64| object_from_base * Translation3::from(back * *retreat);
        for there in RETREATS.iter().map(there) {
            match self.gripped_at(surface, &there, posture, max_overlap, width) {
                Grip::Holds(centred) => return Some(*centred),
                Grip::Wide => return None,
                Grip::Misses => {}
            }
        }
        None
    }

    /// Grip for one pose of the hand.
    fn gripped_at(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        posture: &[f64],
        max_overlap: f64,
        max_width: f64,
    ) -> Grip {
        let Some((index, line)) = self.line else { return Grip::Misses };
        let mut closed = self.close(surface, object_from_base, posture);
        let mut object_from_base = *object_from_base;
        let sides = self.pressing(surface, &object_from_base, &closed, &line);
        if let [side] = sides[..] {
            let (sign, before) = (self.hand.driven()[index].closing_sign(), closed.motors[index]);
            let left = (self.hand.driven()[index].closed_angle(before) - before.angle) * sign;
            let gone = self.gone(surface, &object_from_base, &closed.joints, &line, side, left.max(0.0));
            let start: Vec<Motor> = posture.iter().copied().map(Motor::engaged).collect();
            closed.motors[index].angle += sign * gone;
            self.part(&start, &mut closed.motors);
            self.hand.joint_values(&closed.motors, &mut closed.joints);
            let gone = (closed.motors[index].angle - before.angle) * sign;
            object_from_base *= Translation3::from(line * (-side * gone));
        }
        let Some(held) = self.held(surface, &object_from_base, &closed) else { return Grip::Misses };
        let Some(width) = self.hand.width(&self.hand.link_frames(&closed.joints)) else { return Grip::Misses };
        if width >= max_width {
            return Grip::Wide;
        }
        let opened = self.hand.posture_values(posture);
        if self.overlaps(surface, &object_from_base, &opened, max_overlap) {
            return Grip::Misses;
        }
        Grip::Holds(Box::new(Centred { closed, object_from_base, width, held }))
    }

    /// The middle of each pad's contacts; `None` where one has none.
    fn held(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        closed: &Closed,
    ) -> Option<[Point3<f64>; 2]> {
        let contacts = self.contacts(surface, object_from_base, &closed.joints);
        let middle = |side: f64| {
            let of_side = contacts.iter().filter(|contact| self.hand.closing_side(contact.link) == side);
            let (sum, count) = of_side
                .fold((Vector3::zeros(), 0.0), |(sum, count), contact| (sum + contact.point.coords, count + 1.0));
            (count > 0.0).then(|| Point3::from(sum / count))
        };
        Some([middle(1.0)?, middle(-1.0)?])
    }

    /// Which sides touch and press on: 1 the first pad's link, -1 the other's. Each once.
    fn pressing(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        closed: &Closed,
        line: &Vector3<f64>,
    ) -> Vec<f64> {
        let frames = self.hand.link_frames(&closed.joints);
        let mut sides = Vec::new();
        for solid in 0..self.probes.len() {
            let side = self.sides[solid];
            let close = side != 0.0 && self.distance(surface, object_from_base, &frames, solid) <= TOUCHES;
            if close && !sides.contains(&side) && self.comes(&(object_from_base.rotation * line * side)) {
                sides.push(side);
            }
        }
        sides
    }

    /// Distance that the motor moves on, at most `max`, while the link of one side stays on the object and the hand
    /// moves along, until something else meets the object.
    fn gone(
        &mut self,
        surface: &ContactSurface,
        object_from_base: &IsometryMatrix3<f64>,
        joints: &[f64],
        line: &Vector3<f64>,
        side: f64,
        max: f64,
    ) -> f64 {
        let frames = self.hand.link_frames(joints);
        let speed = line.norm();
        let mut gone = 0.0;
        // Against the object, in units of the pads' speed: 0 for what stays, 1 for the base, 2 for the other side.
        let shares: Vec<f64> = self.sides.iter().map(|of_solid| of_solid - side).collect();
        let mut gaps = Gaps::new(shares.len());
        gaps.set_speeds(|solid| shares[solid].abs() * speed);
        // Conservative advancement until a solid touches and presses into the object.
        for _ in 0..MAX_STEPS_OF_CLOSING {
            let mut meets = false;
            let step = gaps.time(|solid| {
                let travel = object_from_base.rotation * line * shares[solid];
                let moved = Translation3::from(travel * gone) * object_from_base;
                let distance = self.distance(surface, &moved, &frames, solid);
                meets |= distance <= TOUCHES && self.comes(&travel);
                distance
            });
            if meets {
                return gone;
            }
            gone += step;
            gaps.pass(step);
            if gone >= max {
                break;
            }
        }
        gone.min(max)
    }

    /// Whether a direction in `Object` leads into the object where the solid that was tested last touches it.
    fn comes(&self, travel: &Vector3<f64>) -> bool {
        let min = PRESSES * travel.norm();
        self.found.iter().any(|contact| contact.distance <= TOUCHES && contact.normal.dot(travel) < -min)
    }
}

impl Centred {
    /// Pose of the base after the object has rotated between the pads by an angle, in the direction of their torque;
    /// `None` if the torques oppose each other.
    fn rotated(&self, line: &Vector3<f64>, angle: f64) -> Option<IsometryMatrix3<f64>> {
        let [first, second] = self.held;
        let across = (second - first).cross(&(self.object_from_base.rotation * line));
        let axis = Unit::try_new(across, line.norm() * TOUCHES / 10.0)?;
        let middle = nalgebra::center(&first, &second).coords;
        let step = Rotation3::from_axis_angle(&axis, angle);
        let about = Translation3::from(middle) * step * Translation3::from(-middle);
        Some(about * self.object_from_base)
    }
}
