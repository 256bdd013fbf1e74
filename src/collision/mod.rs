//! Whether a robot collides with itself or its surroundings.
//!
//! Every body has a lattice of exact distances to its surface, balls inside it, and a tree of balls around pieces of its
//! surface. A pair is decided by the first of these that can: balls around both bodies that do not meet; a ball inside one
//! that reaches the other (they overlap, and a motion shorter than the depth does not part them); pieces of one surface
//! that are all farther from the other than they are large; the triangles themselves, where pieces are left. Balls, capsules
//! and cylinders have their distance in closed form, and parry decides whether they touch.

mod body;
mod boxes;
mod checker;
mod curved;
mod lattice;
mod solid;
mod surface_tree;
mod touch;
mod triangle;

pub use crate::geom::{Shape, Triangles};
pub use body::{Bodies, Body, Geometry};
pub use checker::{CollisionChecker, LinkFrames, Verdict};
pub use touch::TouchTest;
