//! Travel of an arm along its self-motion: upper bounds for whole intervals of its first joint.

use std::f64::consts::PI;

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::reach::{FULL_TURN, SelfMotion, Wrist};

/// Bounds on the distances of a body's points from the axes that its arm rotates about [m]; the body hangs on one link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extents {
    link: usize,
    first_axis: f64,
    shoulder: f64,
    second_axis: f64,
    upper_arm: f64,
    elbow: f64,
    forearm: f64,
    wrist: f64,
    last_axis: f64,
}

/// Bounds on the motion of an arm while its first joint went from one value to any other of an interval and the
/// end effector rested [rad, m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    first: f64,
    second: f64,
    third: f64,
    /// Travel of the elbow.
    elbow: f64,
    /// Tilt of the forearm's direction, and rotation about it: the elbow's link and the forearm's.
    tilt: f64,
    elbow_twist: f64,
    forearm_twist: f64,
    /// Rotation of the wrist's link about the last axis.
    wrist: f64,
    /// From the first axis to the shoulder.
    offset: f64,
}

impl Travel {
    /// Upper bound on the motion of any point of a body [m].
    pub fn bound_for(&self, body: &Extents) -> f64 {
        let lifted = (self.offset + body.shoulder) * self.first + body.second_axis * self.second;
        match body.link {
            1 => body.first_axis * self.first,
            2 => lifted,
            3 => lifted + body.upper_arm * self.third,
            4 => self.elbow + self.tilt * body.elbow + self.elbow_twist * body.forearm,
            5 => self.tilt * body.wrist + self.forearm_twist * body.forearm,
            6 => self.wrist * body.last_axis,
            _ => 0.0,
        }
    }
}

/// A configuration of an arm, taken apart once for any number of intervals around it.
#[derive(Clone, Copy, Debug)]
pub struct Stance<'a> {
    motion: &'a SelfMotion,
    q: [f64; 7],
    /// The wrist's centre along (outward, side, axis) of the first joint at 0, its distance from the first axis [m], and its
    /// direction about it [rad].
    flat: Vector3<f64>,
    radius: f64,
    middle: f64,
    /// The elbow's distance from the first axis, signed [m].
    elbow_out: f64,
    /// Sines between upper arm and forearm, and between forearm and last axis.
    bend: f64,
    last_bend: f64,
}

impl Stance<'_> {
    /// Upper bound on the travel of the arm from here while its first joint takes any value from `low` to `high`, which
    /// include its current value, and nothing changes between (see [`SelfMotion::end_points`]). Infinite if none is
    /// known.
    pub fn travel(&self, [low, high]: [f64; 2]) -> Travel {
        let SelfMotion { offset, upper, fore, .. } = *self.motion;
        let Self { q, middle, radius, .. } = *self;
        let first = (high - q[0]).max(q[0] - low);
        // The wrist's coordinate along the arm's plane, from the shoulder: its range, and now.
        let along = |value: f64| radius * libm::cos(value - middle) - offset;
        let (mut min, mut max) = (along(low).min(along(high)), along(low).max(along(high)));
        let passes = |angle: f64| angle + FULL_TURN * ((low - angle) / FULL_TURN).ceil() <= high;
        if passes(middle) {
            max = radius - offset;
        }
        if passes(middle + PI) {
            min = -radius - offset;
        }
        let second = self.motion.second_travel(&q, &self.flat, [min, along(q[0]), max]);
        // The elbow, and with it the forearm, whose other end stays.
        let elbow = self.elbow_out.abs() * first + upper * second.min(2.0);
        let chord = (0.5 * elbow / fore).min(1.0);
        let tilt = 2.0 * libm::asin(chord);
        let sum = first + second;
        // A unit vector perpendicular to two others rotates by this much when the two change by `change` together.
        let across = |change: f64, sine: f64| if change < sine { libm::asin(change / sine) } else { PI };
        let third = across(sum * fore + elbow, self.bend * fore);
        let elbow_twist = (tilt + across(sum.min(2.0) + tilt, self.bend)).min(2.0 * PI);
        let last = across(tilt, self.last_bend);
        Travel {
            first,
            second,
            third,
            elbow,
            tilt,
            elbow_twist,
            forearm_twist: (tilt + last).min(2.0 * PI),
            wrist: last,
            offset,
        }
    }
}

impl SelfMotion {
    /// Extents of a body for [`Travel::bound_for`], from its points, or the corners of a hull around them, in its link's
    /// frame; links count from 1, 0 is the world (see `PlanningGroup::link_frames`).
    pub fn extents(&self, link: usize, points: impl Iterator<Item = Point3<f64>>) -> Extents {
        let mut extents = Extents { link, ..Extents::default() };
        let Some(index) = link.checked_sub(1) else { return extents };
        let mut frames = [IsometryMatrix3::identity(); 7];
        self.arm.group().link_frames(&[0.0; 7], &mut frames);
        let (elbow, wrist) = (self.arm.elbow(), self.arm.wrist());
        let from_line = |point: &Point3<f64>, through: &Point3<f64>, along: Vector3<f64>| {
            (point - through).cross(&along.normalize()).norm()
        };
        for point in points {
            let point = frames[index] * point;
            let Extents { first_axis, shoulder, second_axis, upper_arm, elbow: to_elbow, .. } = &mut extents;
            *first_axis = first_axis.max(self.arm.distance(0, &point));
            *shoulder = shoulder.max((point - self.shoulder).norm());
            *second_axis = second_axis.max(self.arm.distance(1, &point));
            *upper_arm = upper_arm.max(from_line(&point, &self.shoulder, elbow - self.shoulder));
            *to_elbow = to_elbow.max((point - elbow).norm());
            extents.forearm = extents.forearm.max(from_line(&point, &elbow, wrist - elbow));
            extents.wrist = extents.wrist.max((point - wrist).norm());
            extents.last_axis = extents.last_axis.max(self.arm.distance(6, &point));
        }
        extents
    }

    /// The arm at joint values `q`, which bring its wrist to `wrist`: what [`Stance::travel`] starts from.
    pub fn stance(&self, wrist: &Wrist, q: &[f64; 7]) -> Stance<'_> {
        let flat = self.flat(wrist);
        let mut frames = [IsometryMatrix3::identity(); 7];
        self.arm.group().link_frames(q, &mut frames);
        let centre_of = |link: usize, home: &Point3<f64>| frames[link] * self.arm.home_in_link(link, home);
        let (shoulder, elbow_at) = (centre_of(0, &self.shoulder), centre_of(1, &self.arm.elbow()));
        // Directions of upper arm and forearm at these values.
        let upper_arm = (elbow_at - shoulder) / self.upper;
        let forearm = (wrist.centre - elbow_at) / self.fore;
        Stance {
            motion: self,
            q: *q,
            flat,
            radius: flat.xy().norm(),
            middle: libm::atan2(flat.y, flat.x),
            elbow_out: self.offset + self.upper * self.lift_direction(q[1])[0],
            bend: upper_arm.cross(&forearm).norm(),
            last_bend: forearm.cross(&wrist.ahead).norm(),
        }
    }

    /// The upper arm (outward, axis) at a value of the second joint.
    fn lift_direction(&self, value: f64) -> [f64; 2] {
        let (sin, cos) = libm::sincos(self.lift_sense * value);
        let [out, up] = self.lift_start;
        [out * cos - up * sin, out * sin + up * cos]
    }

    /// Bound on the motion of the second joint from its value while the wrist's coordinate along the arm's plane moves
    /// from the first of three values to the last [rad]. The upper arm deviates from the direction to the wrist by an
    /// angle that the law of cosines gives; both are monotonic in the coordinate except at one point.
    fn second_travel(&self, q: &[f64; 7], wrist: &Vector3<f64>, [min, now, max]: [f64; 3]) -> f64 {
        // Singular: the wrist's centre may pass the shoulder in projection, where the direction to it is undefined.
        let up = wrist.z;
        if up.abs() < 1e-9 && min <= 0.0 && max >= 0.0 {
            return f64::INFINITY;
        }
        let square = |value: f64| value * value;
        // Law of cosines: angle between upper arm and direction to the wrist, from its coordinate along the plane.
        let constant = square(self.upper) - square(self.fore) + square(wrist.x) + square(wrist.y) + square(up)
            - square(self.offset);
        let cosine = |along: f64| (constant - 2.0 * self.offset * along) / (2.0 * self.upper * libm::hypot(along, up));
        let beside = |along: f64| libm::acos(cosine(along).clamp(-1.0, 1.0));
        let (mut narrow, mut wide) = (beside(min).min(beside(max)), beside(min).max(beside(max)));
        // Extremum of that angle, where the derivative of its cosine is 0; within the interval it widens the range.
        let turning = -2.0 * self.offset * square(up) / constant;
        if turning > min && turning < max {
            (narrow, wide) = (narrow.min(beside(turning)), wide.max(beside(turning)));
        }
        // Range of the direction to the wrist over the interval: monotonic in the coordinate.
        let to_wrist = |along: f64| libm::atan2(up, along);
        let (a, b) = (to_wrist(min), to_wrist(max));
        let (from, to) = (a.min(b), a.max(b));
        let [out, high] = self.lift_direction(q[1]);
        // Side of the elbow, found from the present upper arm; the bound is the larger excursion from the present angle.
        let mut best = f64::INFINITY;
        for side in [1.0, -1.0] {
            let angle = to_wrist(now) + side * beside(now);
            let (sin, cos) = libm::sincos(angle);
            if libm::hypot(sin - high, cos - out) < 1e-5 {
                let (min, max) = if side > 0.0 { (from + narrow, to + wide) } else { (from - wide, to - narrow) };
                // With both sides alike, the arm may move on on either.
                let reach = (max - angle).max(angle - min);
                best = if best.is_finite() { best.max(reach) } else { reach };
            }
        }
        best
    }
}
