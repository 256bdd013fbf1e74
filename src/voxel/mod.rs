//! Occupancy: meshes to solid grids, depth images to partial grids, binvox files.

pub mod channels;
mod columns;
mod solid;
mod surface;

pub use solid::{InsideTest, solid_occupancy};
