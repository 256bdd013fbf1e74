//! Balls, capsules and cylinders: signed distance in closed form, contact by parry.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{Geometry, Shape, boxes::BoxTree, near::Axis, parts::Bounds};
use kernel::geom::TouchShape;

/// A shape with a round side, in the frame of its link.
pub(super) struct Curved {
    touch: TouchShape,
    link_from_shape: IsometryMatrix3<f64>,
    shape_from_link: IsometryMatrix3<f64>,
    round: Round,
}

/// A radius around a part of the z axis.
#[derive(Clone, Copy, Debug)]
struct Round {
    radius: f64,
    /// Half the length of the part.
    half: f64,
    /// Whether the ends are cut off flat.
    flat: bool,
}

impl Curved {
    /// `None` for a shape with planes.
    pub fn new(geometry: &Geometry) -> Option<Self> {
        let round = match geometry.shape {
            Shape::Sphere { radius } => Round { radius, half: 0.0, flat: false },
            Shape::Capsule { radius, half } => Round { radius, half, flat: false },
            Shape::Cylinder { radius, half } => Round { radius, half, flat: true },
            Shape::Box { .. } | Shape::Mesh(_) => return None,
        };
        let touch = TouchShape::new(&geometry.shape).ok()?;
        let link_from_shape = geometry.link_from_shape;
        Some(Self { touch, link_from_shape, shape_from_link: link_from_shape.inverse(), round })
    }

    /// Signed distance at a point of the link's frame [m]; exact.
    pub fn signed(&self, point: &Point3<f64>) -> f64 {
        let point = self.shape_from_link * point;
        let Round { radius, half, flat } = self.round;
        let side = length(point.x, point.y);
        if flat {
            let (out, up) = (side - radius, point.z.abs() - half);
            return length(out.max(0.0), up.max(0.0)) + out.max(up).min(0.0);
        }
        length(side, (point.z.abs() - half).max(0.0)) - radius
    }

    /// A ball around the shape, in the link's frame.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let Round { radius, half, flat } = self.round;
        let reach = if flat { length(radius, half) } else { radius + half };
        (self.link_from_shape * Point3::origin(), reach)
    }

    /// Points whose hull holds the shape, in the link's frame.
    pub fn corners(&self) -> [Point3<f64>; 8] {
        let Round { radius, half, flat } = self.round;
        let up = if flat { half } else { half + radius };
        std::array::from_fn(|bits| {
            let side = |bit: usize, length: f64| if bits >> bit & 1 == 0 { -length } else { length };
            self.link_from_shape * Point3::new(side(0, radius), side(1, radius), side(2, up))
        })
    }

    /// The shape's axis with its radius, expressed in another body whose frame is `here`.
    pub fn axis(&self, here_from_link: &IsometryMatrix3<f64>) -> Axis {
        let Round { radius, half, flat } = self.round;
        Axis::new(&(self.shape_from_link * here_from_link.inverse()), radius, half, flat)
    }

    /// Where this shape meets another, whose link's frame is expressed in the frame of this one: a point of this one's
    /// link in both, or nearly. `None` when they are apart.
    pub fn meets(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Option<Point3<f64>> {
        let [one, two] = [self.segment(), other.segment().map(|end| here_from_there * end)];
        let [on_one, on_two] = nearest_points(one, two);
        let (apart, radii) = ((on_two - on_one).norm(), [self.round.radius, other.round.radius]);
        // Neither shape reaches farther from its axis than its radius.
        if apart > radii[0] + radii[1] + 1e-9 {
            return None;
        }
        // Between the axes, as deep in the one as in the other.
        let share = if apart > 0.0 { (0.5 * (radii[0] - radii[1] + apart) / apart).clamp(0.0, 1.0) } else { 0.5 };
        let point = on_one + (on_two - on_one) * share;
        if self.signed(&point) < 0.0 && other.signed(&here_from_there.inverse_transform_point(&point)) < 0.0 {
            return Some(point);
        }
        let pose = here_from_there * other.link_from_shape;
        self.touch.touches(&self.link_from_shape, &other.touch, &pose).then_some(point)
    }

    /// The ends of the axis, in the link's frame.
    fn segment(&self) -> [Point3<f64>; 2] {
        [-1.0, 1.0].map(|end| self.link_from_shape * Point3::new(0.0, 0.0, end * self.round.half))
    }

    /// Overlap depth of two shapes that meet near `here` [m] (see `Solid::depth`).
    pub fn depth(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>, here: &Point3<f64>, enough: f64) -> f64 {
        let there_from_here = here_from_there.inverse();
        let depth = |point: &Point3<f64>| -self.signed(point) - other.signed(&(there_from_here * point));
        deepest(*here, STEPS, enough, depth).1
    }

    /// Whether one of many triangles touches the shape, whose link's frame is expressed in the triangles'.
    pub fn touches(&self, triangles: &BoxTree, here_from_link: &IsometryMatrix3<f64>) -> bool {
        let Round { radius, half, flat } = self.round;
        let pose = here_from_link * self.link_from_shape;
        let axis: Vector3<f64> = pose.rotation.matrix().column(2).into();
        // A flat end is a disc: along a coordinate it reaches as far as its tilt lets it.
        let side = axis.map(|along| {
            let disc = if flat { radius * libm::sqrt((1.0 - along * along).max(0.0)) } else { radius };
            half * along.abs() + disc + 1e-9
        });
        let centre = Point3::from(pose.translation.vector);
        let around = Bounds { low: centre - side, high: centre + side };
        triangles.any_near(&around, |triangle| self.touch.touches_triangle(&pose, triangle))
    }
}

/// Hypotenuse of two sides at a right angle; unlike the system's `hypot`, the same bits everywhere.
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
}

/// Nearest points of two segments, one on each, or one such pair (C. Ericson, Real-Time Collision Detection,
/// 2005, section 5.1.9).
fn nearest_points(one: [Point3<f64>; 2], two: [Point3<f64>; 2]) -> [Point3<f64>; 2] {
    let (a, b, between) = (one[1] - one[0], two[1] - two[0], one[0] - two[0]);
    let (aa, bb, ab) = (a.norm_squared(), b.norm_squared(), a.dot(&b));
    let (ac, bc) = (a.dot(&between), b.dot(&between));
    // A segment without a length has its only point at 0.
    let ratio = |value: f64, of: f64| if of > 0.0 { (value / of).clamp(0.0, 1.0) } else { 0.0 };
    let s = ratio(ab * bc - ac * bb, aa * bb - ab * ab);
    let t = ratio(ab * s + bc, bb);
    // Where `t` was cut off, or `b` has no length, the point on the first follows from it.
    let s = ratio(ab * t - ac, aa);
    [one[0] + a * s, two[0] + b * t]
}

/// First and last step of a pattern search [m].
pub(super) const STEPS: [f64; 2] = [0.032, 0.001];
/// First and last step of a pattern search where the position is known roughly [m].
pub(super) const FINE_STEPS: [f64; 2] = [0.004, 0.00025];

/// A pattern search for where a depth is greatest, or more than `enough`: the point, and the depth.
pub(super) fn deepest(
    start: Point3<f64>,
    [first, last]: [f64; 2],
    enough: f64,
    depth: impl Fn(&Point3<f64>) -> f64,
) -> (Point3<f64>, f64) {
    let mut best = (start, depth(&start));
    let mut step = first;
    while step >= last && best.1 <= enough {
        let mut next = best;
        for axis in 0..3 {
            for offset in [step, -step] {
                let point = best.0 + Vector3::ith(axis, offset);
                let found = depth(&point);
                if found > next.1 {
                    next = (point, found);
                }
            }
        }
        if next.1 > best.1 { best = next } else { step *= 0.5 }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::seed::Stream;

    #[test]
    fn no_points_of_two_segments_are_nearer_than_the_nearest() {
        let mut draw = Stream::of_job(1, b"", "segments");
        for round in 0..2000 {
            let mut point = || Point3::from([0; 3].map(|_: i32| draw.uniform(-1.0, 1.0)));
            let (mut one, mut two) = ([point(), point()], [point(), point()]);
            match round % 5 {
                // A point, two points, parallel segments.
                1 => one[1] = one[0],
                2 => (one[1], two[1]) = (one[0], two[0]),
                3 => two[1] = two[0] + (one[1] - one[0]) * 0.7,
                _ => {}
            }
            let found = nearest_points(one, two);
            let on = |[from, to]: [Point3<f64>; 2], point: Point3<f64>| {
                (to - from).cross(&(point - from)).norm() < 1e-12
                    && (-1e-12..=(to - from).norm_squared() + 1e-12).contains(&(to - from).dot(&(point - from)))
            };
            assert!(on(one, found[0]) && on(two, found[1]));
            let nearest = (found[0] - found[1]).norm();
            let share = |step: i32| f64::from(step) / 20.0;
            for (i, j) in (0..=20).flat_map(|i| (0..=20).map(move |j| (i, j))) {
                let apart = one[0] + (one[1] - one[0]) * share(i) - (two[0] + (two[1] - two[0]) * share(j));
                assert!(nearest <= apart.norm() + 1e-12, "{one:?} {two:?}");
            }
        }
    }
}
