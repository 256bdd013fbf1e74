//! Shapes that can touch.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

/// A solid in its own frame [m]; for a mesh, only the surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A box around the origin, by half its sides.
    Box {
        /// Half its sides.
        half: [f64; 3],
    },
    /// A ball around the origin.
    Sphere {
        /// Radius [m].
        radius: f64,
    },
    /// A segment of the z axis, thickened.
    Capsule {
        /// Radius [m].
        radius: f64,
        /// Half the segment's length.
        half: f64,
    },
    /// A cylinder around the z axis.
    Cylinder {
        /// Radius [m].
        radius: f64,
        /// Half its height.
        half: f64,
    },
    /// A triangle mesh.
    Mesh(Arc<Triangles>),
}

impl Shape {
    /// Extent of the shape along a direction of unit length, from its frame's origin [m].
    pub fn reach_along(&self, direction: &Vector3<f64>) -> f64 {
        match self {
            Self::Box { half } => direction.abs().dot(&Vector3::from(*half)),
            Self::Sphere { radius } => *radius,
            Self::Capsule { radius, half } => radius + half * direction.z.abs(),
            Self::Cylinder { radius, half } => {
                radius * (direction.x * direction.x + direction.y * direction.y).sqrt() + half * direction.z.abs()
            }
            Self::Mesh(mesh) => {
                mesh.corners.iter().map(|corner| direction.dot(&corner.coords)).fold(f64::NEG_INFINITY, f64::max)
            }
        }
    }
}

/// A triangle mesh as stored in its file: not repaired, in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangles {
    /// Corners [m].
    pub corners: Vec<Point3<f64>>,
    /// Three corners each.
    pub triangles: Vec<[u32; 3]>,
}
