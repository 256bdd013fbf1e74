//! Balls, capsules and cylinders: signed distance in closed form, contact by parry.

use nalgebra::{IsometryMatrix3, Point3, Vector3};

use super::{Geometry, Shape, solid::Contact};
use crate::geom::TouchShape;

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
    /// `None` for a shape out of planes.
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
        let side = point.x.hypot(point.y);
        if flat {
            let (out, up) = (side - radius, point.z.abs() - half);
            return out.max(0.0).hypot(up.max(0.0)) + out.max(up).min(0.0);
        }
        side.hypot((point.z.abs() - half).max(0.0)) - radius
    }

    /// A ball around the shape, in the link's frame.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        let Round { radius, half, flat } = self.round;
        let reach = if flat { radius.hypot(half) } else { radius + half };
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

    /// How this shape stands to another, whose link's frame is seen from this one's link.
    pub fn contact(&self, other: &Self, here_from_there: &IsometryMatrix3<f64>) -> Contact {
        let place = here_from_there * other.link_from_shape;
        if !self.touch.touches(&self.link_from_shape, &other.touch, &place) {
            return Contact::Apart;
        }
        let there_from_here = here_from_there.inverse();
        let depth = |point: &Point3<f64>| -self.signed(point) - other.signed(&(there_from_here * point));
        let start = nalgebra::center(&self.ball().0, &(here_from_there * other.ball().0));
        Contact::of_depth(deepest(start, depth).1)
    }

    /// Whether a body out of planes, placed in this shape's link's frame, touches it.
    pub fn touches(&self, other: &TouchShape, here_from_there: &IsometryMatrix3<f64>) -> bool {
        self.touch.touches(&self.link_from_shape, other, here_from_there)
    }
}

/// A pattern search for where a depth is greatest: the place, and the depth.
pub(super) fn deepest(start: Point3<f64>, depth: impl Fn(&Point3<f64>) -> f64) -> (Point3<f64>, f64) {
    let mut best = (start, depth(&start));
    let mut step = 0.032;
    while step > 0.0009 {
        let mut next = best;
        for axis in 0..3 {
            for way in [step, -step] {
                let point = best.0 + Vector3::ith(axis, way);
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
