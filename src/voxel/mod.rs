//! Occupancy: meshes to solid grids, depth images to partial grids, binvox files.

pub mod channels;
mod columns;
mod plain_complete;
mod plain_partial;
mod solid;
mod surface;

pub use plain_complete::{PlainComplete, free_cells};
pub use plain_partial::{NoGrid, for_each_point, partial_occupancy, place_grid};
pub use solid::{InsideTest, solid_occupancy};
