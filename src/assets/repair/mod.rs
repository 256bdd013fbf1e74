//! Triangles as one surface: edges and shells, welding, seams, holes, and repairs that move nothing.

pub(crate) mod bodies;
mod bounds;
pub(crate) mod edges;
pub(crate) mod holes;
pub(crate) mod mend;
pub(crate) mod seams;
pub(crate) mod shells;
pub(crate) mod undecided;
pub(crate) mod weld;
