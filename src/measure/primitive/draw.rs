//! Shapes through two oriented points.

use nalgebra::{Point3, Vector3};

use super::{
    evidence::TOLERANCE,
    shape::{Primitive, along_and_across},
};
use crate::seen_cells::SeenPoint;

/// Sine of the angle between two normals below which they do not determine an axis: 10 degrees.
const MIN_SINE: f64 = 0.17;
/// Cosine of the angle between two normals up to which they are those of two sides of a box: 17 degrees from a right angle.
const MAX_COSINE: f64 = 0.3;
/// Cosine from which on they are those of one side: 18 degrees.
const SAME_SIDE: f64 = 0.95;
/// Share of the points beyond each end of an extent: single points fly.
const TAIL: f64 = 0.01;

/// A kind of shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Ball,
    Cylinder,
    Cuboid,
}

impl Kind {
    pub(super) const ALL: [Self; 3] = [Self::Ball, Self::Cylinder, Self::Cuboid];

    /// Name of the stream of random numbers that points are drawn by.
    pub(super) fn stream(self) -> &'static str {
        match self {
            Self::Ball => "points of balls",
            Self::Cylinder => "points of cylinders",
            Self::Cuboid => "points of boxes",
        }
    }

    /// The shape that two points and their normals suggest; its ends are those of all points. `up` tells how a box lies of which
    /// both points see one side.
    pub(super) fn through(self, pair: [&SeenPoint; 2], points: &[SeenPoint], up: [f64; 3]) -> Option<Primitive> {
        let [one, other] = pair.map(|point| point.normal);
        match self {
            Self::Ball => {
                let (centre, radius) = meeting(pair.map(|point| point.position), [one, other])?;
                Some(Primitive::Ball { centre, radius })
            }
            Self::Cylinder => {
                let axis = one.cross(&other).try_normalize(MIN_SINE)?;
                // Across the axis both normals lead to it.
                let flat = |vector: Vector3<f64>| vector - axis * vector.dot(&axis);
                let positions = pair.map(|point| Point3::from(flat(point.position.coords)));
                let (centre, radius) = meeting(positions, [one, other])?;
                Some(cylinder(centre, axis, radius, points))
            }
            Self::Cuboid => {
                let cosine = one.dot(&other);
                let second = if cosine.abs() <= MAX_COSINE {
                    other
                } else if cosine >= SAME_SIDE {
                    Vector3::from(up)
                } else {
                    return None;
                };
                let second = (second - one * second.dot(&one)).try_normalize(MIN_SINE)?;
                Some(cuboid([one, second, one.cross(&second)], points))
            }
        }
    }
}

/// The point behind a surface at which the lines along two unit normals come nearest to each other, and its mean distance from
/// both points.
fn meeting([one, other]: [Point3<f64>; 2], [along, across]: [Vector3<f64>; 2]) -> Option<(Point3<f64>, f64)> {
    let cosine = along.dot(&across);
    let square = 1.0 - cosine * cosine;
    if square < MIN_SINE * MIN_SINE {
        return None;
    }
    let between = one - other;
    let (to_one, to_other) = (along.dot(&between), across.dot(&between));
    // Closest points of two lines (Ericson 2005, "Real-time collision detection", section 5.1.8).
    let steps = [(cosine * to_other - to_one) / square, (to_other - cosine * to_one) / square];
    if steps.iter().any(|step| *step >= 0.0) {
        return None;
    }
    let centre = nalgebra::center(&(one + along * steps[0]), &(other + across * steps[1]));
    Some((centre, ((centre - one).norm() + (centre - other).norm()) / 2.0))
}

/// The cylinder about a line, given by a point and its direction, that ends where the points inside of it do.
pub(super) fn cylinder(point: Point3<f64>, axis: Vector3<f64>, radius: f64, points: &[SeenPoint]) -> Primitive {
    let along = points.iter().filter_map(|seen| {
        let (along, radial) = along_and_across(&(seen.position - point), &axis);
        (radial <= radius + TOLERANCE).then_some(along)
    });
    let [low, high] = ends(along.collect());
    let centre = point + axis * ((low + high) / 2.0);
    Primitive::Cylinder { centre, axis, radius, half_length: (high - low) / 2.0 }
}

/// The box along these axes around all points.
pub(super) fn cuboid(axes: [Vector3<f64>; 3], points: &[SeenPoint]) -> Primitive {
    let spans = axes.map(|axis| ends(points.iter().map(|seen| seen.position.coords.dot(&axis)).collect()));
    cuboid_between(axes, spans)
}

/// The box between these ends along its axes.
pub(super) fn cuboid_between(axes: [Vector3<f64>; 3], spans: [[f64; 2]; 3]) -> Primitive {
    let middle = (0..3).map(|side| axes[side] * ((spans[side][0] + spans[side][1]) / 2.0)).sum::<Vector3<f64>>();
    let half_sides = spans.map(|[low, high]| (high - low) / 2.0);
    Primitive::Cuboid { centre: middle.into(), axes, half_sides }
}

/// Ends of numbers without the outermost ones on either side; both 0 without numbers.
fn ends(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let skipped = (TAIL * values.len() as f64) as usize;
    match values.get(skipped..values.len() - skipped) {
        Some([low, .., high]) => [*low, *high],
        _ => [0.0; 2],
    }
}
