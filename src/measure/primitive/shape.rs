//! Balls, cylinders and boxes as solids.

use nalgebra::{Point3, Vector3};

/// A solid in `CameraCv` [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// A ball.
    Ball {
        /// Centre.
        centre: Point3<f64>,
        /// Radius [m].
        radius: f64,
    },
    /// A cylinder with flat ends.
    Cylinder {
        /// Middle of the axis.
        centre: Point3<f64>,
        /// Unit vector along the axis.
        axis: Vector3<f64>,
        /// Radius [m].
        radius: f64,
        /// Half of the distance between the ends [m].
        half_length: f64,
    },
    /// A box.
    Cuboid {
        /// Centre.
        centre: Point3<f64>,
        /// Unit vectors along the sides, at right angles to each other.
        axes: [Vector3<f64>; 3],
        /// Half of the sides' lengths [m].
        half_sides: [f64; 3],
    },
}

impl Primitive {
    /// Distance of a point [m] from the surface, negative inside [m].
    pub fn signed_distance(&self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Ball { centre, radius } => (point - centre).norm() - radius,
            Self::Cylinder { centre, axis, radius, half_length } => {
                let (along, radial) = along_and_across(&(point - centre), axis);
                beyond([radial - radius, along.abs() - half_length])
            }
            Self::Cuboid { centre, axes, half_sides } => {
                let offset = point - centre;
                beyond([0, 1, 2].map(|side| offset.dot(&axes[side]).abs() - half_sides[side]))
            }
        }
    }

    /// The longest extent [m].
    pub(super) fn extent(&self) -> f64 {
        2.0 * match self {
            Self::Ball { radius, .. } => *radius,
            Self::Cylinder { radius, half_length, .. } => radius.max(*half_length),
            Self::Cuboid { half_sides: [a, b, c], .. } => a.max(*b).max(*c),
        }
    }
}

/// Length of a vector along an axis, and across it.
pub(super) fn along_and_across(vector: &Vector3<f64>, axis: &Vector3<f64>) -> (f64, f64) {
    let along = vector.dot(axis);
    (along, (vector - axis * along).norm())
}

/// Distance from the surface of a product of intervals, by the distances beyond the end of each, negative inside.
fn beyond<const N: usize>(distances: [f64; N]) -> f64 {
    let outside = distances.iter().map(|distance| distance.max(0.0).powi(2)).sum::<f64>().sqrt();
    let inside = distances.into_iter().fold(f64::MIN, f64::max).min(0.0);
    outside + inside
}
