//! Occupancy: meshes to solid grids, depth images to partial grids, binvox files.

mod binvox;
mod caps;
pub mod channels;
mod columns;
mod plain_complete;
mod plain_partial;
mod rim;
mod shape;
mod solid;
mod surface;
mod winding;

pub use binvox::{Binvox, InvalidBinvox, solid_to_binvox};
pub use plain_complete::{PlainComplete, free_cells};
pub use plain_partial::{NoGrid, for_each_point, partial_occupancy, place_grid};
pub use shape::{ShapeDescriptor, twins};
pub use solid::{InsideTest, solid_occupancy};
