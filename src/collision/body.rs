//! What can collide: bodies out of shapes, each carried by one link of a planning group.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3};

/// A shape in its own frame [m].
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

/// A triangle mesh as a robot's description has it: neither mended nor welded.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangles {
    /// Corners [m].
    pub corners: Vec<Point3<f64>>,
    /// Three corners each.
    pub triangles: Vec<[u32; 3]>,
}

/// A shape and where it sits.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The shape.
    pub shape: Shape,
    /// The shape's frame, seen from the frame of the link that carries it.
    pub link_from_shape: IsometryMatrix3<f64>,
}

/// A rigid part of a robot or of its surroundings.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its name in the description.
    pub name: String,
    /// Which joint of the planning group moves it last, counted from 1; 0 for what stands still in the world.
    ///
    /// The frame of link 0 is the world, that of link k the frame that the k-th joint moves.
    pub link: usize,
    /// Its shapes; none for a body that only carries others.
    pub geometries: Vec<Geometry>,
}

/// A robot and its surroundings as collision checking sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct Bodies {
    /// The bodies, in the description's order.
    pub bodies: Vec<Body>,
    /// Pairs that are checked (places in `bodies`, the lower first): no two of one link, no parent with its child, none
    /// that the description excludes.
    pub pairs: Vec<[usize; 2]>,
}
