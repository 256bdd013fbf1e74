//! Whether an arm reaches a pose at all: exact in its first joint.
//!
//! Along the first joint a way to a pose can only appear or end where something is at its limit: the second, fourth or
//! sixth joint, the elbow's circle about the second axis touching the sphere around the wrist's centre, or the first joint
//! itself. All of these are roots of trigonometric polynomials of degree two at most. Between two neighbouring ones nothing
//! changes, so that one value between them decides, however close they lie.

use nalgebra::{Point3, Vector3};

use super::{
    PlanningGroup,
    closed_form::{NoClosedForm, SphericalWristArm},
};
use crate::geom::{EndEffector, Pose, World};

/// Numbers of the shoulder that the end points need, with all joints at 0.
#[derive(Clone, Debug, PartialEq)]
pub struct ReachTest {
    arm: SphericalWristArm,
    /// The shoulder's height on the first axis.
    origin: Point3<f64>,
    /// First axis; away from it to the shoulder; second axis.
    axes: [Vector3<f64>; 3],
    /// Distance of the shoulder from the first axis [m].
    offset: f64,
    shoulder: Point3<f64>,
    /// From shoulder to elbow and from elbow to wrist [m].
    lengths: [f64; 2],
    /// The elbow with the second joint at its limits.
    elbows: Vec<Point3<f64>>,
    /// From shoulder to wrist with the fourth joint at its limits [m].
    spans: Vec<f64>,
    /// Cosines between forearm and last axis with the sixth joint at its limits.
    cones: Vec<f64>,
}

impl ReachTest {
    /// Looks at the axes with all joints at 0.
    ///
    /// # Errors
    /// Says which axes are in the way: beside what [`SphericalWristArm`] asks for, the first two axes must be at right
    /// angles, the elbow in the first axis's plane across the second, the third axis through shoulder and elbow, the fifth
    /// through elbow and wrist, and the third, fifth and seventh joints without limits.
    pub fn new(group: &PlanningGroup) -> Result<Self, NoClosedForm> {
        let arm = SphericalWristArm::recognise(group)?;
        let name = |joint: usize| group.joints()[joint].name.clone();
        let apart = |names: String, place, gap| Err(NoClosedForm::Apart { names, place, gap });
        let shoulder = arm.meet(&[1, 2], "shoulder")?;
        let (elbow, wrist) = (arm.elbow(), arm.wrist());
        for (joint, place, point) in [(2, "elbow", elbow), (4, "elbow", elbow)] {
            let gap = arm.distance(joint, &point);
            if gap > 1e-9 {
                return apart(name(joint), place, gap);
            }
        }
        let [first, second] = [arm.along(0), arm.along(1)];
        let slope = first.dot(&second).abs();
        if slope > 1e-9 {
            return Err(NoClosedForm::Oblique { names: format!("{}, {}", name(0), name(1)), cosine: slope });
        }
        let aside = shoulder - arm.through(0);
        let origin = arm.through(0) + first * first.dot(&aside);
        let away = (shoulder - origin) - second * second.dot(&(shoulder - origin));
        let offset = away.norm();
        let across = second.dot(&(shoulder - origin)).abs().max(second.dot(&(elbow - shoulder)).abs());
        if across > 1e-9 {
            return apart(format!("{}, {}", name(0), name(1)), "first axis's plane", across);
        }
        if let Some(joint) = [2, 4, 6].into_iter().find(|joint| group.joints()[*joint].limits.is_some()) {
            return Err(NoClosedForm::Limited(name(joint)));
        }
        let outward = if offset > 1e-12 { away / offset } else { second.cross(&first) };
        let ends = |joint: usize| group.joints()[joint].limits.into_iter().flat_map(|limits| [limits.low, limits.high]);
        Ok(Self {
            origin,
            axes: [first, outward, second],
            offset,
            shoulder,
            lengths: [(elbow - shoulder).norm(), (wrist - elbow).norm()],
            elbows: ends(1).map(|value| arm.motion(1, value) * elbow).collect(),
            spans: ends(3).map(|value| (arm.motion(3, value) * wrist - shoulder).norm()).collect(),
            cones: ends(5)
                .map(|value| (wrist - elbow).normalize().dot(&(arm.motion(5, value).rotation * arm.along(6))))
                .collect(),
            arm,
        })
    }

    /// The arm.
    pub fn arm(&self) -> &SphericalWristArm {
        &self.arm
    }

    /// Joint values within the limits that bring the end effector to `target`; `None` when there are none.
    pub fn find(&self, target: &Pose<World, EndEffector>) -> Option<[f64; 7]> {
        let (wrist, ahead) = self.arm.wrist_of(target);
        if self.out_of_reach(&wrist) {
            return None;
        }
        let mut ends = self.end_points(&wrist, &ahead);
        ends.sort_by(f64::total_cmp);
        let mut found = Vec::new();
        // The middles first: a way there keeps from its limits.
        let middles = ends.windows(2).filter(|pair| pair[1] > pair[0]).map(|pair| 0.5 * (pair[0] + pair[1]));
        for first in middles.chain(ends.iter().copied()) {
            self.arm.solve(target, first, &mut found);
            if let Some(way) = found.pop() {
                return Some(way);
            }
        }
        None
    }

    /// A proof that the wrist's centre is too far from the circle that the shoulder runs on.
    fn out_of_reach(&self, wrist: &Point3<f64>) -> bool {
        let to = wrist - self.origin;
        let height = self.axes[0].dot(&to);
        let radius = (to - self.axes[0] * height).norm();
        (radius - self.offset).hypot(height) > self.lengths[0] + self.lengths[1] + 1e-9
    }

    /// Values of the first joint between which nothing changes, its limits among them; some at which nothing does.
    fn end_points(&self, wrist: &Point3<f64>, ahead: &Vector3<f64>) -> Vec<f64> {
        let (low, high) = match self.arm.group().joints()[0].limits {
            Some(limits) => (limits.low, limits.high),
            None => (-std::f64::consts::PI, std::f64::consts::PI),
        };
        let mut ends = vec![low, high];
        let mut put = |value: f64| {
            const TURN: f64 = 2.0 * std::f64::consts::PI;
            let first = value - TURN * ((value - low) / TURN).floor();
            let mut value = first;
            while value < high {
                ends.push(value);
                value += TURN;
            }
        };
        for elbow in &self.elbows {
            self.arm.first_distances(elbow, wrist, self.lengths[1]).into_iter().flatten().for_each(&mut put);
        }
        for span in &self.spans {
            self.arm.first_distances(&self.shoulder, wrist, *span).into_iter().flatten().for_each(&mut put);
        }
        self.touches(wrist, &mut put);
        for cosine in &self.cones {
            self.cone(wrist, ahead, *cosine, &mut put);
        }
        ends
    }

    /// Where the elbow's circle touches the sphere around the wrist's centre: a quadratic in the wrist's coordinate along
    /// the arm's plane.
    fn touches(&self, wrist: &Point3<f64>, put: &mut impl FnMut(f64)) {
        let [axis, outward, second] = &self.axes;
        let to = wrist - self.origin;
        let (height, x, y) = (axis.dot(&to), outward.dot(&to), axis.cross(outward).dot(&to));
        debug_assert!(second.dot(outward).abs() < 1e-6);
        let radius = x.hypot(y);
        if radius < 1e-12 {
            return;
        }
        let [upper, fore] = self.lengths;
        let (offset, square) = (self.offset, |value: f64| value * value);
        let constant = square(radius) + square(offset) + square(height) + square(upper) - square(fore);
        let a = 4.0 * (square(offset) - square(upper));
        let b = 8.0 * square(upper) * offset - 4.0 * constant * offset;
        let c = square(constant) - 4.0 * square(upper) * (square(offset) + square(height));
        let middle = libm::atan2(y, x);
        for along in quadratic_roots(a, b, c).into_iter().flatten() {
            let cosine = (along / radius).clamp(-1.0, 1.0);
            let half = libm::acos(cosine);
            put(middle + half);
            put(middle - half);
        }
    }

    /// Where the sixth joint is at a limit: the elbow on a circle around the last axis and on the torus that its own circle
    /// sweeps about the first axis.
    fn cone(&self, wrist: &Point3<f64>, ahead: &Vector3<f64>, cosine: f64, put: &mut impl FnMut(f64)) {
        let [axis, outward, _] = &self.axes;
        let [upper, fore] = self.lengths;
        let side = axis.cross(outward);
        let e1 = ahead.cross(&Vector3::ith(ahead.iamin(), 1.0)).normalize();
        let e2 = ahead.cross(&e1);
        let middle = wrist - ahead * (fore * cosine) - self.origin;
        let radius = fore * (1.0 - cosine * cosine).max(0.0).sqrt();
        // The elbow at an angle given by its cosine and sine, along (outward, side, axis).
        let part = |direction: &Vector3<f64>| {
            [direction.dot(&middle), radius * direction.dot(&e1), radius * direction.dot(&e2)]
        };
        let [x, y, z] = [part(outward), part(&side), part(axis)];
        let sum = Quadratic::square(x).plus(&Quadratic::square(y), 1.0);
        let all = sum.plus(&Quadratic::square(z), 1.0);
        // |elbow|^2 is linear in cosine and sine: the squares add up to radius^2.
        let level =
            [all.0[0] + 0.5 * (all.0[3] + all.0[5]) + self.offset * self.offset - upper * upper, all.0[1], all.0[2]];
        let torus = Quadratic::square(level).plus(&sum, -4.0 * self.offset * self.offset);
        for turn in torus.angles() {
            let (sin, cos) = libm::sincos(turn);
            let at = |part: [f64; 3]| part[0] + part[1] * cos + part[2] * sin;
            let angle = libm::atan2(at(y), at(x));
            // The elbow may stand beyond the first axis.
            put(angle);
            put(angle + std::f64::consts::PI);
        }
    }
}

/// c0 + c1 cos + c2 sin + c3 cos^2 + c4 cos sin + c5 sin^2.
struct Quadratic([f64; 6]);

impl Quadratic {
    fn square([a, b, c]: [f64; 3]) -> Self {
        Self([a * a, 2.0 * a * b, 2.0 * a * c, b * b, 2.0 * b * c, c * c])
    }

    fn plus(&self, other: &Self, times: f64) -> Self {
        Self(std::array::from_fn(|place| self.0[place] + times * other.0[place]))
    }

    /// The angles at which it is 0, and those at which its slope is: where it touches 0, rounding decides.
    fn angles(&self) -> Vec<f64> {
        let [c0, c1, c2, c3, c4, c5] = self.0;
        // With t = tan(angle / 2), times (1 + t^2)^2; lowest power first.
        let polynomial =
            [c0 + c1 + c3, 2.0 * c2 + 2.0 * c4, 2.0 * c0 - 2.0 * c3 + 4.0 * c5, 2.0 * c2 - 2.0 * c4, c0 - c1 + c3];
        let mut reversed = polynomial;
        reversed.reverse();
        let near = roots_and_turns(&polynomial).into_iter().map(|t| 2.0 * libm::atan(t));
        let far = roots_and_turns(&reversed).into_iter().map(|t| std::f64::consts::PI - 2.0 * libm::atan(t));
        near.chain(far).collect()
    }
}

/// Roots of a polynomial (lowest power first) in -1 to 1, its turning points there, and both ends.
fn roots_and_turns(polynomial: &[f64]) -> Vec<f64> {
    let slope: Vec<f64> = (1..polynomial.len()).map(|power| power as f64 * polynomial[power]).collect();
    let mut points = if slope.len() > 1 { roots_and_turns(&slope) } else { vec![-1.0, 1.0] };
    points.sort_by(f64::total_cmp);
    let value = |t: f64| polynomial.iter().rev().fold(0.0, |sum, factor| sum * t + factor);
    let mut roots = Vec::new();
    for pair in points.windows(2) {
        let (mut low, mut high) = (pair[0], pair[1]);
        let rising = value(low) < 0.0;
        if (value(high) < 0.0) == rising {
            continue;
        }
        // The polynomial is monotonic here.
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if (value(middle) < 0.0) == rising { low = middle } else { high = middle }
        }
        roots.push(0.5 * (low + high));
    }
    points.extend(roots);
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
