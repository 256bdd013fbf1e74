//! Bodies that can collide: made of shapes, each carried by one link of a planning group.

use nalgebra::IsometryMatrix3;

use kernel::geom::Shape;

/// A shape and where it sits.
#[derive(Clone, Debug, PartialEq)]
pub struct Geometry {
    /// The shape.
    pub shape: Shape,
    /// The shape's frame, expressed in the frame of the link that carries it.
    pub link_from_shape: IsometryMatrix3<f64>,
}

/// A rigid part of a robot or of its surroundings.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Name in the description.
    pub name: String,
    /// The last joint of the planning group that moves it, counted from 1; 0 for bodies fixed in the world.
    ///
    /// The frame of link 0 is the world, that of link k the frame that the k-th joint moves.
    pub link: usize,
    /// Shapes of the body, at least one.
    pub geometries: Vec<Geometry>,
}

/// A robot and its surroundings as collision checking sees them.
#[derive(Clone, Debug, PartialEq)]
pub struct Bodies {
    /// The bodies, in the description's order.
    pub bodies: Vec<Body>,
    /// Pairs that are checked (indices in `bodies`, the lower first), sorted: no two of one link, no parent with its
    /// child, none that the description excludes.
    pub pairs: Vec<[usize; 2]>,
}

impl Bodies {
    /// Replaces the pairs that are checked.
    #[must_use]
    pub fn with_pairs(self, pairs: Vec<[usize; 2]>) -> Self {
        Self { pairs, ..self }
    }

    /// Expresses the bodies in another fixed frame; that frame becomes the world, the frame of link 0.
    #[must_use]
    pub fn seen_from(mut self, world_from_frame: &IsometryMatrix3<f64>) -> Self {
        let frame_from_world = world_from_frame.inverse();
        for body in self.bodies.iter_mut().filter(|body| body.link == 0) {
            for geometry in &mut body.geometries {
                geometry.link_from_shape = frame_from_world * geometry.link_from_shape;
            }
        }
        self
    }
}
