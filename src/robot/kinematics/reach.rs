//! The self-motion of an arm whose pose leaves one joint free: which values of its first joint allow a pose, exactly.
//!
//! Along the first joint a solution of a pose can only appear or end where something is at its limit: the second, fourth or
//! sixth joint, the elbow's circle about the second axis touching the sphere around the wrist's centre, or the first joint
//! itself. All of these are roots of trigonometric polynomials of degree two at most. Between two neighbouring ones nothing
//! changes, so that one value between them decides, however close they lie.

use nalgebra::{Point3, Vector3};

use super::{
    JointLimits, PlanningGroup,
    closed_form::{NoClosedForm, SphericalWristArm},
};
use kernel::geom::{EndEffector, Pose, World};

pub(super) const FULL_TURN: f64 = 2.0 * std::f64::consts::PI;

/// Demand of a pose on an arm without limits in its last joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrist {
    /// Where the last three axes meet, in the world [m].
    pub centre: Point3<f64>,
    /// Direction of the last axis in the world.
    pub ahead: Vector3<f64>,
}

/// An arm of seven joints with a spherical wrist and elbow, moved by its first joint while the end effector rests.
#[derive(Clone, Debug, PartialEq)]
pub struct SelfMotion {
    pub(super) arm: SphericalWristArm,
    /// The shoulder's height on the first axis.
    origin: Point3<f64>,
    /// First axis; away from it to the shoulder; at right angles to both.
    axis: Vector3<f64>,
    outward: Vector3<f64>,
    side: Vector3<f64>,
    /// Distance of the shoulder from the first axis [m].
    pub(super) offset: f64,
    pub(super) shoulder: Point3<f64>,
    /// From shoulder to elbow and from elbow to wrist [m].
    pub(super) upper: f64,
    pub(super) fore: f64,
    /// The middle of the second joint's range as a direction of the upper arm (outward, axis), and the cosine of half its
    /// range; below -1 without limits.
    lift_middle: [f64; 2],
    lift_cosine: f64,
    /// The upper arm (outward, axis) with the second joint at 0, and the sense in which it rotates from outward to the axis, 1
    /// or -1.
    pub(super) lift_start: [f64; 2],
    pub(super) lift_sense: f64,
    /// Directions of the upper arm (outward, axis) with the second joint at its limits.
    lift_ends: Vec<[f64; 2]>,
    /// Least and greatest squared distance from shoulder to wrist that the fourth joint allows [m^2].
    spans: [f64; 2],
    /// Least and greatest cosine between forearm and last axis that the sixth joint allows.
    cones: [f64; 2],
    first: FirstJoint,
}

/// The range of the first joint.
#[derive(Clone, Debug, PartialEq)]
struct FirstJoint {
    limits: JointLimits,
    /// Cosine and sine of its middle, and the cosine of half its range; below -1 where it is continuous.
    middle: [f64; 2],
    cosine: f64,
}

impl SelfMotion {
    /// Analyses the axes with all joints at 0.
    ///
    /// # Errors
    /// Names the axes that prevent it: in addition to the conditions of [`SphericalWristArm`], the first two axes must
    /// be at right angles, the elbow in the first axis's plane across the second, the third axis through shoulder and
    /// elbow, the fifth through elbow and wrist, and the third, fifth and seventh joints without limits.
    pub fn new(group: &PlanningGroup) -> Result<Self, NoClosedForm> {
        let arm = SphericalWristArm::recognise(group)?;
        let name = |joint: usize| group.joints()[joint].name.clone();
        let apart = |names: String, crossing, gap| Err(NoClosedForm::Apart { names, crossing, gap });
        let shoulder = arm.meet(&[1, 2], "shoulder")?;
        let (elbow, wrist) = (arm.elbow(), arm.wrist());
        // The third axis passes shoulder and elbow by now.
        let gap = arm.distance(4, &elbow);
        if gap > 1e-9 {
            return apart(name(4), "elbow", gap);
        }
        // First two axes: at right angles.
        let [axis, second] = [arm.along(0), arm.along(1)];
        let slope = axis.dot(&second).abs();
        if slope > 1e-9 {
            return Err(NoClosedForm::Oblique { names: format!("{}, {}", name(0), name(1)), cosine: slope });
        }
        // Offset of the shoulder from the first axis; shoulder and elbow lie in one plane with it.
        let origin = arm.through(0) + axis * axis.dot(&(shoulder - arm.through(0)));
        let away = (shoulder - origin) - second * second.dot(&(shoulder - origin));
        let offset = away.norm();
        let across = second.dot(&(shoulder - origin)).abs().max(second.dot(&(elbow - shoulder)).abs());
        if across > 1e-9 {
            return apart(format!("{}, {}", name(0), name(1)), "first axis's plane", across);
        }
        // Roll joints without limits: the third, fifth and seventh.
        if let Some(joint) = [2, 4, 6].into_iter().find(|joint| group.joints()[*joint].limits.is_some()) {
            return Err(NoClosedForm::Limited(name(joint)));
        }
        let outward = if offset > 1e-12 { away / offset } else { second.cross(&axis) };
        let limits = |joint: usize| group.joints()[joint].limits;
        let (upper, fore) = ((elbow - shoulder).norm(), (wrist - elbow).norm());
        // Direction of the upper arm in the plane (outward, axis) at a value of the second joint.
        let lift = |value: f64| {
            let to = arm.motion(1, value) * elbow - shoulder;
            [to.dot(&outward) / upper, to.dot(&axis) / upper]
        };
        let forearm = (wrist - elbow) / fore;
        // Second joint's range: direction of its middle and cosine of its half.
        let (lift_middle, lift_cosine) = match limits(1) {
            Some(limits) => (lift(0.5 * (limits.low + limits.high)), cosine_of_half(limits)),
            None => ([1.0, 0.0], -2.0),
        };
        let first = limits(0).unwrap_or(JointLimits { low: -0.5 * FULL_TURN, high: 0.5 * FULL_TURN });
        let (sin, cos) = libm::sincos(0.5 * (first.low + first.high));
        // Axis of the elbow's joint: at right angles to upper arm and forearm.
        for (joints, along) in [([2, 3], elbow - shoulder), ([3, 4], wrist - elbow)] {
            let cosine = arm.along(3).dot(&along.normalize()).abs();
            if cosine > 1e-9 {
                return Err(NoClosedForm::Oblique { names: joints.map(name).join(", "), cosine });
            }
        }
        Ok(Self {
            origin,
            shoulder,
            axis,
            outward,
            side: axis.cross(&outward),
            offset,
            upper,
            fore,
            lift_middle,
            lift_cosine,
            lift_start: lift(0.0),
            lift_sense: if second.dot(&axis.cross(&outward)) > 0.0 { -1.0 } else { 1.0 },
            lift_ends: limits(1).into_iter().flat_map(|limits| [lift(limits.low), lift(limits.high)]).collect(),
            spans: range_of_sinusoid(|value| (arm.motion(3, value) * wrist - shoulder).norm_squared(), limits(3)),
            cones: range_of_sinusoid(|value| forearm.dot(&(arm.motion(5, value).rotation * arm.along(6))), limits(5)),
            first: FirstJoint { limits: first, middle: [cos, sin], cosine: cosine_of_half(first) },
            arm,
        })
    }

    /// The arm.
    pub fn arm(&self) -> &SphericalWristArm {
        &self.arm
    }

    /// Demand of a pose on the arm.
    pub fn wrist(&self, target: &Pose<World, EndEffector>) -> Wrist {
        let (centre, ahead) = self.arm.wrist_of(target);
        Wrist { centre, ahead }
    }

    /// Joint values within the limits that bring the end effector to `target`; `None` if none exist.
    pub fn find(&self, target: &Pose<World, EndEffector>) -> Option<[f64; 7]> {
        let wrist = self.wrist(target);
        if self.too_far(&wrist) {
            return None;
        }
        let mut ends = Vec::new();
        let quick = self.quick_value(&wrist);
        if quick.is_none() {
            self.end_points(&wrist, &mut ends);
        }
        // The middles first: a solution there keeps from its limits.
        let middles = ends.windows(2).filter(|pair| pair[1] > pair[0]).map(|pair| 0.5 * (pair[0] + pair[1]));
        let values = quick.into_iter().chain(middles).chain(ends.iter().copied());
        values.into_iter().find_map(|first| self.arm.find_branch(target, first, Some))
    }

    /// A value of the first joint that allows the pose [rad]; `None` when none does. `ends` is scratch.
    pub fn first_value(&self, wrist: &Wrist, ends: &mut Vec<f64>) -> Option<f64> {
        if self.too_far(wrist) {
            return None;
        }
        self.quick_value(wrist).or_else(|| {
            self.end_points(wrist, ends);
            let middles = ends.windows(2).filter(|pair| pair[1] > pair[0]).map(|pair| 0.5 * (pair[0] + pair[1]));
            middles.chain(ends.iter().copied()).find(|first| {
                let (sin, cos) = libm::sincos(*first);
                self.allows(&self.flat(wrist), &wrist.ahead, [cos, sin])
            })
        })
    }

    /// A proof that the wrist's centre is too far from the circle that the shoulder runs on.
    pub fn too_far(&self, wrist: &Wrist) -> bool {
        let to = wrist.centre - self.origin;
        let height = self.axis.dot(&to);
        let radius = (to.norm_squared() - height * height).max(0.0).sqrt() - self.offset;
        let reach = self.upper + self.fore + 1e-9;
        radius * radius + height * height > reach * reach
    }

    /// The wrist's centre along (outward, side, axis) of the first joint at 0 [m].
    pub(super) fn flat(&self, wrist: &Wrist) -> Vector3<f64> {
        let to = wrist.centre - self.origin;
        Vector3::new(self.outward.dot(&to), self.side.dot(&to), self.axis.dot(&to))
    }

    /// A few values of the first joint: around that which points at the wrist.
    fn quick_value(&self, wrist: &Wrist) -> Option<f64> {
        // Angles next to it, as cosine and sine.
        const BESIDE: [[f64; 2]; 7] = [
            [1.0, 0.0],
            [0.876_923_076_923_076_9, 0.480_635_3],
            [0.876_923_076_923_076_9, -0.480_635_3],
            [0.538_461_538_461_538_5, 0.842_657_1],
            [0.538_461_538_461_538_5, -0.842_657_1],
            [0.070_737_2, 0.997_495],
            [0.070_737_2, -0.997_495],
        ];
        let flat = self.flat(wrist);
        // Direction from the first axis to the wrist's centre; undefined on the axis.
        let radius = flat.xy().norm();
        if radius < 1e-9 {
            return None;
        }
        let (c, s) = (flat.x / radius, flat.y / radius);
        // Candidates in ascending angle from that direction; the first within limits at which the pose is reached.
        let rotated = BESIDE.map(|[cos, sin]| [c * cos - s * sin, s * cos + c * sin]);
        let found = rotated.into_iter().find(|first| {
            let length = first[0] * first[0] + first[1] * first[1];
            let inside = first[0] * self.first.middle[0] + first[1] * self.first.middle[1];
            inside > self.first.cosine + 1e-9 && (length - 1.0).abs() < 1e-5 && self.allows(&flat, &wrist.ahead, *first)
        })?;
        let value = libm::atan2(found[1], found[0]);
        // Wrapped by whole revolutions to the lowest value within the limits.
        let limits = &self.first.limits;
        let value = value - FULL_TURN * ((value - limits.low) / FULL_TURN).floor();
        (value <= limits.high).then_some(value)
    }

    /// Whether the pose can be had with the first joint at an angle given by cosine and sine.
    fn allows(&self, wrist: &Vector3<f64>, ahead: &Vector3<f64>, [cos, sin]: [f64; 2]) -> bool {
        // The arm's plane: along it from the shoulder, across it, up.
        let along = cos * wrist.x + sin * wrist.y - self.offset;
        let across = cos * wrist.y - sin * wrist.x;
        let up = wrist.z;
        let flat = along * along + up * up;
        let span = flat + across * across;
        if !(self.spans[0]..=self.spans[1]).contains(&span) {
            return false;
        }
        let cosine_flat = (self.upper * self.upper + span - self.fore * self.fore) / (2.0 * self.upper);
        let rest = flat - cosine_flat * cosine_flat;
        if rest < 0.0 || flat < 1e-18 {
            return false;
        }
        let root = rest.sqrt();
        let [ahead_x, ahead_y, ahead_z] = [self.outward.dot(ahead), self.side.dot(ahead), self.axis.dot(ahead)];
        let (ahead_along, ahead_across) = (cos * ahead_x + sin * ahead_y, cos * ahead_y - sin * ahead_x);
        [root, -root].into_iter().any(|root| {
            let elbow = [(cosine_flat * along - root * up) / flat, (cosine_flat * up + root * along) / flat];
            let lift = elbow[0] * self.lift_middle[0] + elbow[1] * self.lift_middle[1];
            let forearm = [along - self.upper * elbow[0], across, up - self.upper * elbow[1]];
            let cosine = (forearm[0] * ahead_along + forearm[1] * ahead_across + forearm[2] * ahead_z) / self.fore;
            lift >= self.lift_cosine && (self.cones[0]..=self.cones[1]).contains(&cosine)
        })
    }

    /// Values of the first joint between which nothing changes, ascending, its limits among them; some at which nothing
    /// does.
    pub fn end_points(&self, wrist: &Wrist, ends: &mut Vec<f64>) {
        let JointLimits { low, high } = self.first.limits;
        ends.clear();
        ends.extend([low, high]);
        // All copies of a value within the limits, whole revolutions apart.
        let mut put = |value: f64| {
            let mut value = value - FULL_TURN * ((value - low) / FULL_TURN).floor();
            while value < high {
                ends.push(value);
                value += FULL_TURN;
            }
        };
        // Wrist's centre in cylinder coordinates about the first axis.
        let flat = self.flat(wrist);
        let radius = flat.xy().norm();
        let middle = libm::atan2(flat.y, flat.x);
        // Where the wrist's centre has this coordinate along the arm's plane.
        let along = |value: f64, put: &mut dyn FnMut(f64)| {
            if radius > 1e-12 && value.abs() <= radius * (1.0 + 1e-14) {
                let half = libm::acos((value / radius).clamp(-1.0, 1.0));
                put(middle - half);
                put(middle + half);
            }
        };
        let square = |value: f64| value * value;
        // Second joint at a limit: the elbow is fixed in the arm's plane, and the wrist's centre lies on a sphere around it.
        for [out, up] in &self.lift_ends {
            let (out, up) = (self.offset + self.upper * out, self.upper * up);
            if out != 0.0 {
                let sum = square(radius) + square(out) + square(flat.z - up) - square(self.fore);
                along(sum / (2.0 * out), &mut put);
            }
        }
        // Fourth joint at a limit: the distance from shoulder to wrist is fixed.
        let squares = square(radius) + square(flat.z) + square(self.offset);
        if self.offset > 0.0 {
            for span in self.spans {
                along((squares - span) / (2.0 * self.offset), &mut put);
            }
        }
        // Where the elbow's circle touches the sphere around the wrist's centre: a quadratic in the same coordinate.
        let constant = squares + square(self.upper) - square(self.fore);
        let a = 4.0 * (square(self.offset) - square(self.upper));
        let b = 8.0 * square(self.upper) * self.offset - 4.0 * constant * self.offset;
        let c = square(constant) - 4.0 * square(self.upper) * (square(self.offset) + square(flat.z));
        for value in quadratic_roots(a, b, c).into_iter().flatten() {
            along(value, &mut put);
        }
        // Sixth joint at a limit.
        for cosine in self.cones {
            self.cone(&flat, &wrist.ahead, cosine, &mut put);
        }
        ends.sort_by(f64::total_cmp);
    }

    /// Where the sixth joint is at a limit: the elbow on a circle around the last axis and on the torus that its own circle
    /// sweeps about the first axis.
    fn cone(&self, wrist: &Vector3<f64>, ahead: &Vector3<f64>, cosine: f64, put: &mut impl FnMut(f64)) {
        let ahead = Vector3::new(self.outward.dot(ahead), self.side.dot(ahead), self.axis.dot(ahead));
        let e1 = ahead.cross(&Vector3::ith(ahead.iamin(), 1.0)).normalize();
        let e2 = ahead.cross(&e1);
        let middle = wrist - ahead * (self.fore * cosine);
        let radius = self.fore * (1.0 - cosine * cosine).max(0.0).sqrt();
        // The elbow at an angle given by its cosine and sine.
        let [x, y, z] = std::array::from_fn(|axis| [middle[axis], radius * e1[axis], radius * e2[axis]]);
        let sum = Quadratic::square(x).plus(&Quadratic::square(y), 1.0);
        let all = sum.plus(&Quadratic::square(z), 1.0);
        // |elbow|^2 is linear in cosine and sine: the squares add up to radius^2.
        let level = [
            all.0[0] + 0.5 * (all.0[3] + all.0[5]) + self.offset * self.offset - self.upper * self.upper,
            all.0[1],
            all.0[2],
        ];
        let torus = Quadratic::square(level).plus(&sum, -4.0 * self.offset * self.offset);
        for angle in torus.angles() {
            let (sin, cos) = libm::sincos(angle);
            let at = |part: [f64; 3]| part[0] + part[1] * cos + part[2] * sin;
            let angle = libm::atan2(at(y), at(x));
            // The elbow may be beyond the first axis.
            put(angle);
            put(angle + std::f64::consts::PI);
        }
    }
}

fn cosine_of_half(limits: JointLimits) -> f64 {
    let half = 0.5 * (limits.high - limits.low);
    if half >= 0.5 * FULL_TURN { -2.0 } else { libm::cos(half) }
}

/// Least and greatest value of a + b cos + c sin within limits.
fn range_of_sinusoid(value: impl Fn(f64) -> f64, limits: Option<JointLimits>) -> [f64; 2] {
    let quarter = 0.25 * FULL_TURN;
    let (start, quarter_on, half_on) = (value(0.0), value(quarter), value(2.0 * quarter));
    let (middle, b) = (0.5 * (start + half_on), 0.5 * (start - half_on));
    let c = quarter_on - middle;
    let (top, swing) = (libm::atan2(c, b), libm::hypot(b, c));
    let Some(JointLimits { low, high }) = limits else { return [middle - swing, middle + swing] };
    let holds = |angle: f64| angle + FULL_TURN * ((low - angle) / FULL_TURN).ceil() <= high;
    let (at_low, at_high) = (value(low), value(high));
    [
        if holds(top + 2.0 * quarter) { middle - swing } else { at_low.min(at_high) },
        if holds(top) { middle + swing } else { at_low.max(at_high) },
    ]
}

/// c0 + c1 cos + c2 sin + c3 cos^2 + c4 cos sin + c5 sin^2.
struct Quadratic([f64; 6]);

impl Quadratic {
    fn square([a, b, c]: [f64; 3]) -> Self {
        Self([a * a, 2.0 * a * b, 2.0 * a * c, b * b, 2.0 * b * c, c * c])
    }

    fn plus(&self, other: &Self, times: f64) -> Self {
        Self(std::array::from_fn(|term| self.0[term] + times * other.0[term]))
    }

    /// The angles at which it is 0, and those at which its slope is: where it touches 0, rounding decides.
    fn angles(&self) -> Vec<f64> {
        let [c0, c1, c2, c3, c4, c5] = self.0;
        // With t = tan(angle / 2), times (1 + t^2)^2; lowest power first.
        let polynomial =
            [c0 + c1 + c3, 2.0 * c2 + 2.0 * c4, 2.0 * c0 - 2.0 * c3 + 4.0 * c5, 2.0 * c2 - 2.0 * c4, c0 - c1 + c3];
        let mut reversed = polynomial;
        reversed.reverse();
        let near = roots_and_extrema(&polynomial).into_iter().map(|t| 2.0 * libm::atan(t));
        let far = roots_and_extrema(&reversed).into_iter().map(|t| std::f64::consts::PI - 2.0 * libm::atan(t));
        near.chain(far).collect()
    }
}

/// Powers of the polynomials here, at most.
const DEGREE: usize = 4;

/// Roots of a polynomial (lowest power first) in -1 to 1, its turning points there, and both ends.
fn roots_and_extrema(polynomial: &[f64]) -> Vec<f64> {
    // Derivative of the polynomial; its roots, found by recursion, split -1 to 1 into monotonic pieces.
    let mut slope: [f64; DEGREE] = std::array::from_fn(|power| (power + 1) as f64);
    let slope = &mut slope[..polynomial.len() - 1];
    slope.iter_mut().zip(&polynomial[1..]).for_each(|(power, factor)| *power *= factor);
    let mut points = if slope.len() > 1 {
        roots_and_extrema(slope)
    } else {
        // Room for the roots of this and of all slopes above.
        let mut ends = Vec::with_capacity(2 + DEGREE * (DEGREE + 1) / 2);
        ends.extend([-1.0, 1.0]);
        ends
    };
    points.sort_unstable_by(f64::total_cmp);
    // Horner's scheme.
    let at = |factors: &[f64], t: f64| factors.iter().rev().fold(0.0, |sum, factor| sum * t + factor);
    let (mut roots, mut count) = ([0.0; DEGREE], 0);
    // One root at most per piece: only where the sign changes.
    for pair in points.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        let rising = at(polynomial, low) < 0.0;
        if (at(polynomial, high) < 0.0) == rising {
            continue;
        }
        // The polynomial is monotonic here: Newton's steps, or the middle where one leaves the remaining interval.
        let mut root = 0.5 * (low + high);
        for _ in 0..60 {
            let value = at(polynomial, root);
            if (value < 0.0) == rising {
                low = root
            } else {
                high = root
            }
            let step = root - value / at(slope, root);
            let next = if low < step && step < high { step } else { 0.5 * (low + high) };
            let settled = (next - root).abs() < 1e-16;
            root = next;
            if settled {
                break;
            }
        }
        // No polynomial has more roots than its degree, except by rounding of a zero coefficient.
        if count < DEGREE {
            roots[count] = root;
            count += 1;
        }
    }
    points.extend_from_slice(&roots[..count]);
    points
}

/// Roots of a t^2 + b t + c.
fn quadratic_roots(a: f64, b: f64, c: f64) -> [Option<f64>; 2] {
    let discriminant = b * b - 4.0 * a * c;
    if discriminant < 0.0 {
        // Two roots that rounding may have parted from the axis.
        return [(a != 0.0 && discriminant > -1e-12 * b * b).then(|| -0.5 * b / a), None];
    }
    let sum = -0.5 * (b + b.signum() * discriminant.sqrt());
    [(a != 0.0).then(|| sum / a), (sum != 0.0).then(|| c / sum)]
}
