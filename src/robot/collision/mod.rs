//! Whether a robot collides with itself or its surroundings.
//!
//! Every body has a lattice of exact distances to its surface, balls inside it, and a tree of balls around pieces of
//! its surface. The first of these tests that can decides a pair: balls around both bodies that do not meet; pieces of
//! one surface, sixteen at a time, that are all farther from the other than they are large; a ball inside one that
//! reaches inside the other; the triangles themselves, where pieces are left. Balls, capsules and cylinders have their
//! distance in closed form, and parry decides whether they touch. Whether two bodies overlap so far that a shorter
//! motion does not part them is a separate query, and so is the distance of two that are apart.
//!
//! A robot is prepared once; [`CollisionChecker::among`] adds obstacles to it in microseconds.

mod body;
mod boxes;
mod cells;
mod checker;
mod clearance;
mod curved;
mod lattice;
mod near;
mod nearest;
mod obstacle;
mod parts;
mod segment;
mod solid;
mod surface_tree;
mod triangle;

pub use body::{Bodies, Body, Geometry};
pub use checker::{CollisionChecker, CollisionVerdict, Hit, LinkFrames};
pub use kernel::geom::{Shape, Triangles};
pub use obstacle::{Obstacle, PlacedObstacle};
pub use solid::Care;
