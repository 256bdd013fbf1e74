//! Shapes that can touch.

use std::sync::Arc;

use nalgebra::Point3;

/// A solid in its own frame [m]; of a mesh the surface alone.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A box around the origin, by half its sides.
    Box {
        /// Half its sides.
        half: [f64; 3],
    },
    /// A ball around the origin.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// A segment of the z axis, thickened.
    Capsule {
        /// Its radius.
        radius: f64,
        /// Half the segment's length.
        half: f64,
    },
    /// A cylinder around the z axis.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Half its height.
        half: f64,
    },
    /// A triangle mesh.
    Mesh(Arc<Triangles>),
}

/// A triangle mesh as its file has it: not mended, in double precision.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangles {
    /// Corners [m].
    pub corners: Vec<Point3<f64>>,
    /// Three corners each.
    pub triangles: Vec<[u32; 3]>,
}
