//! From a completed grid to a closed mesh, and the mesh to a file. Pure: no file is opened, no thread started.
//!
//! Every number is of class `exact`: given the same grids, meshes have the same bits on every machine.
//!
//! ```
//! use graspmill_surface::{CompletedMesh, CubeField, OBSTACLE_THRESHOLD, write_stl};
//! use kernel::geom::GridPlacement;
//!
//! // A ball, as a network might give it: the probability that each cell is occupied.
//! let mut occupancy = CubeField::filled(40, 0.0);
//! for [x, y, z] in occupancy.cells() {
//!     let squares = [x, y, z].map(|cell| (cell as f32 + 0.5 - 20.0).powi(2));
//!     *occupancy.at_mut([x, y, z]) = if squares.iter().sum::<f32>() < 144.0 { 1.0 } else { 0.0 };
//! }
//! let placement = GridPlacement { resolution: 40, centre: [0.0, 0.0, 0.8].into(), cell_size: 0.004 };
//! let ball = CompletedMesh::obstacle(&occupancy, &placement, OBSTACLE_THRESHOLD);
//! assert!(ball.mesh.signed_volume() > 0.0, "faces are wound outward");
//! assert_eq!(write_stl(&ball.mesh).len(), 84 + 50 * ball.mesh.triangles.len());
//! ```

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod band;
mod cases;
mod completed;
mod cubes;
mod field;
mod joined;
mod laplacian;
mod mjcf;
mod pieces;
mod seen;
mod smooth;
mod volume;
mod write;

pub use completed::{CompletedMesh, DetailedMesh, OBSTACLE_THRESHOLD};
pub use cubes::marching_cubes;
pub use field::CubeField;
pub use laplacian::{LaplacianRule, NeighbourWeights};
pub use mjcf::{MeshBody, TablePlane, write_mjcf};
pub use pieces::{LooseBodies, drop_small_pieces, keep_largest_body};
pub use seen::SeenObject;
pub use smooth::{SmoothingProblem, Solver};
pub use volume::{Volume, upsampling_factor};
pub use write::{write_obj, write_ply, write_stl};
