//! Occupancy: meshes to solid grids, depth images to partial grids and fused volumes, binvox files.

mod binvox;
mod caps;
mod cells;
mod centres;
pub mod channels;
mod columns;
mod complete;
mod corners;
mod effort;
mod fusion;
mod interior;
mod lookup;
mod met;
mod overlap;
mod partial;
mod placement;
mod rim;
mod shape;
mod share;
mod skin;
mod solid;
mod surface;
mod view_grids;
mod visibility;
mod winding;
mod work;

pub use binvox::{Binvox, InvalidBinvox, solid_to_binvox};
pub use centres::{InsideOf, mark_inside};
pub use effort::solid_effort;
pub use fusion::{VolumeFusion, VolumeGrid};
pub use met::cells_met;
pub use placement::NoGrid;
pub use shape::{ShapeDescriptor, twins};
pub use solid::{InsideTest, solid_occupancy};
pub use view_grids::{SolidObject, Truth, ViewGrids};
