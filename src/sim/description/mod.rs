//! Descriptions opened by MuJoCo: joints of robots, bodies that can collide, contacts between them, ties, and cameras of scenes.

pub(crate) mod bodies;
pub(crate) mod contacts;
pub(crate) mod open;
pub(crate) mod robot;
pub(crate) mod scene;
mod ties;
