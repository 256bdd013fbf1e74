//! Scalar fields over a grid of end-effector poses: the grid, signed distance to the reachable set, lookups.
//!
//! A field is a slice of `f32`, one value per cell, shape and order those of its [`PoseGrid`]; negative inside.

mod approach;
mod axis_grid;
mod axis_lookup;
mod covering;
mod fast_marching;
#[cfg(test)]
mod fixtures;
mod healpix;
mod label;
mod lookup;
mod metric;
mod pose_grid;
mod signed_distance;
mod sphere;
mod sphere_grid;
mod sphere_lookup;
mod standard;

pub use approach::approach_directions;
pub use axis_grid::{Axis, AxisGrid, AxisUnit, InvalidPoseGrid};
pub use covering::Covering;
pub use fast_marching::signed_distance_thesis;
pub use healpix::HealPix;
pub use label::{PoseLabel, Proof};
pub use lookup::FieldLookup;
pub use metric::FieldMetric;
pub use pose_grid::PoseGrid;
pub use sphere::signed_distance_sphere;
pub use sphere_grid::SphereGrid;
pub use standard::{METRES_PER_RADIAN, signed_distance_standard};
