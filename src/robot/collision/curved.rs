//! Balls, capsules, cylinders, and boxes of obstacles: signed distance in closed form, contact by parry.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{Geometry, Shape, boxes::BoxTree, near::Axis, parts::Bounds, segment::nearest_points};
use kernel::geom::TouchShape;

/// A convex shape whose distance is known in closed form, in the frame of its link.
pub(super) struct Curved {
    touch: TouchShape,
    link_from_shape: IsometryMatrix3<f64>,
    shape_from_link: IsometryMatrix3<f64>,
    form: Form,
}

/// The shape in its own frame.
#[derive(Clone, Copy, Debug)]
pub(super) enum Form {
    /// A radius around a part of the z axis.
    Round {
        radius: f64,
        /// Half the length of the part.
        half: f64,
        /// Whether the ends are cut off flat.
        flat: bool,
    },
    /// A box by half its sides.
    Box { half: [f64; 3] },
}

impl Curved {
    /// `None` for a shape with planes.
    pub fn new(geometry: &Geometry) -> Option<Self> {
        if matches!(geometry.shape, Shape::Box { .. }) { None } else { Self::closed_form(geometry) }
    }

    /// `None` for a mesh: a box has a closed form, too.
    pub fn closed_form(geometry: &Geometry) -> Option<Self> {
        let form = match geometry.shape {
            Shape::Sphere { radius } => Form::Round { radius, half: 0.0, flat: false },
            Shape::Capsule { radius, half } => Form::Round { radius, half, flat: false },
            Shape::Cylinder { radius, half } => Form::Round { radius, half, flat: true },
            Shape::Box { half } => Form::Box { half },
            Shape::Mesh(_) => return None,
        };
        let touch = TouchShape::new(&geometry.shape).ok()?;
        let link_from_shape = geometry.link_from_shape;
        Some(Self { touch, link_from_shape, shape_from_link: link_from_shape.inverse(), form })
    }

    /// The shape in its own frame, and that frame expressed in the link's.
    pub fn form(&self) -> (Form, &IsometryMatrix3<f64>) {
        (self.form, &self.link_from_shape)
    }

    /// Signed distance at a point of the link's frame [m]; exact.
    pub fn signed(&self, point: &Point3<f64>) -> f64 {
        let point = self.shape_from_link * point;
        match self.form {
            Form::Round { radius, half, flat: true } => {
                let (out, up) = (length(point.x, point.y) - radius, point.z.abs() - half);
                length(out.max(0.0), up.max(0.0)) + out.max(up).min(0.0)
            }
            Form::Round { radius, half, flat: false } => {
                length(length(point.x, point.y), (point.z.abs() - half).max(0.0)) - radius
            }
            Form::Box { half } => {
                let beyond = point.coords.abs() - Vector3::from(half);
                beyond.sup(&Vector3::zeros()).norm() + beyond.max().min(0.0)
            }
        }
    }

    /// Signed distance at a point of the link's frame [m], and a subgradient of it there, of unit length: the distance is a
    /// convex function of the point.
    pub fn signed_with_slope(&self, point: &Point3<f64>) -> (f64, Vector3<f64>) {
        let at = self.shape_from_link * point;
        let radial = |length: f64| if length > 0.0 { Vector3::new(at.x, at.y, 0.0) / length } else { Vector3::x() };
        let up_axis = Vector3::z() * if at.z < 0.0 { -1.0 } else { 1.0 };
        let slope = match self.form {
            Form::Round { radius, half, flat: true } => {
                let side = length(at.x, at.y);
                let (out, up) = (side - radius, at.z.abs() - half);
                if out > 0.0 && up > 0.0 {
                    (radial(side) * out + up_axis * up).normalize()
                } else if out > up {
                    radial(side)
                } else {
                    up_axis
                }
            }
            Form::Round { half, flat: false, .. } => {
                let from_axis = Vector3::new(at.x, at.y, at.z - at.z.clamp(-half, half));
                from_axis.try_normalize(0.0).unwrap_or_else(Vector3::x)
            }
            Form::Box { half } => {
                let beyond = at.coords.abs() - Vector3::from(half);
                let sign = at.coords.map(|value| if value < 0.0 { -1.0 } else { 1.0 });
                let outside = beyond.sup(&Vector3::zeros());
                outside.try_normalize(0.0).unwrap_or_else(|| Vector3::ith(beyond.imax(), 1.0)).component_mul(&sign)
            }
        };
        (self.signed(point), self.link_from_shape.rotation * slope)
    }

    /// A ball around the shape, in the link's frame.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let reach = match self.form {
            Form::Round { radius, half, flat } => {
                if flat {
                    length(radius, half)
                } else {
                    radius + half
                }
            }
            Form::Box { half } => Vector3::from(half).norm() + 1e-9,
        };
        (self.link_from_shape * Point3::origin(), reach)
    }

    /// Points whose hull holds the shape, in the link's frame.
    pub fn corners(&self) -> [Point3<f64>; 8] {
        let half = match self.form {
            Form::Round { radius, half, flat } => [radius, radius, if flat { half } else { half + radius }],
            Form::Box { half } => half,
        };
        std::array::from_fn(|bits| {
            let side = |bit: usize| if bits >> bit & 1 == 0 { -half[bit] } else { half[bit] };
            self.link_from_shape * Point3::new(side(0), side(1), side(2))
        })
    }

    /// The shape's axis with its radius, expressed in another body whose frame is `here`.
    pub fn axis(&self, here_from_link: &IsometryMatrix3<f64>) -> Axis {
        let shape_from_here = self.shape_from_link * here_from_link.inverse();
        match self.form {
            Form::Round { radius, half, flat } => Axis::new(&shape_from_here, radius, half, flat),
            Form::Box { half } => Axis::of_box(&shape_from_here, half),
        }
    }

    /// Where this shape meets another, whose link's frame is expressed in the frame of this one: a point of this one's
    /// link in both, or nearly. `None` when they are apart.
    pub fn meets(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Option<Point3<f64>> {
        let (Form::Round { radius: own, .. }, Form::Round { radius: others, .. }) = (self.form, other.form) else {
            return self.meets_box(other, here_from_there);
        };
        let [one, two] = [self.segment(), other.segment().map(|end| here_from_there * end)];
        let [on_one, on_two] = nearest_points(one, two);
        let (apart, radii) = ((on_two - on_one).norm(), [own, others]);
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

    /// [`Curved::meets`] where one of the two is a box.
    fn meets_box(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Option<Point3<f64>> {
        // The other's centre shows that they are apart, or meet, in all but the near cases.
        let (there, reach) = other.ball();
        let centre = here_from_there * there;
        let (distance, slope) = self.signed_with_slope(&centre);
        if distance > reach {
            return None;
        }
        // Near where: the point of this shape that is nearest to the other's centre.
        let point = centre - slope * distance.max(0.0);
        let pose = here_from_there * other.link_from_shape;
        self.touch.touches(&self.link_from_shape, &other.touch, &pose).then_some(point)
    }

    /// The ends of the axis, in the link's frame; of a box its centre, twice.
    pub fn segment(&self) -> [Point3<f64>; 2] {
        let half = match self.form {
            Form::Round { half, .. } => half,
            Form::Box { .. } => 0.0,
        };
        [-1.0, 1.0].map(|end| self.link_from_shape * Point3::new(0.0, 0.0, end * half))
    }

    /// Overlap depth of two shapes that meet near `here` [m] (see `Solid::depth`).
    pub fn depth(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>, here: &Point3<f64>, enough: f64) -> f64 {
        let there_from_here = here_from_there.inverse();
        let depth = |point: &Point3<f64>| -self.signed(point) - other.signed(&(there_from_here * point));
        deepest(*here, STEPS, enough, depth).1
    }

    /// Whether one of many triangles touches the shape, whose link's frame is expressed in the triangles'.
    pub fn touches(&self, triangles: &BoxTree, here_from_link: &IsometryMatrix3<f64>) -> bool {
        let pose = here_from_link * self.link_from_shape;
        let side = match self.form {
            Form::Round { radius, half, flat } => {
                let axis: Vector3<f64> = pose.rotation.matrix().column(2).into();
                // A flat end is a disc: along a coordinate it reaches as far as its tilt lets it.
                axis.map(|along| {
                    let disc = if flat { radius * libm::sqrt((1.0 - along * along).max(0.0)) } else { radius };
                    half * along.abs() + disc + 1e-9
                })
            }
            Form::Box { half } => pose.rotation.matrix().abs() * Vector3::from(half) + Vector3::repeat(1e-9),
        };
        let centre = Point3::from(pose.translation.vector);
        let around = Bounds { low: centre - side, high: centre + side };
        triangles.any_near(&around, |triangle| self.touch.touches_triangle(&pose, triangle))
    }
}

/// Hypotenuse of two sides at a right angle; unlike the system's `hypot`, the same bits everywhere.
fn length(a: f64, b: f64) -> f64 {
    (a * a + b * b).sqrt()
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
