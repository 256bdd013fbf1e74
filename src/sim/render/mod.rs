//! Depth and colours of one object or of a scene, by MuJoCo's rays or its OpenGL renderer.

pub(crate) mod colour;
pub(crate) mod depth;
mod gl;
pub(crate) mod model;
