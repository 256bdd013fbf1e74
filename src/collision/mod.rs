//! Whether a robot collides with itself or its surroundings.

mod body;

pub use body::{Bodies, Body, Geometry, Shape, Triangles};
