//! Scalar fields over a grid of end-effector poses: the grid, signed distance to the reachable set, lookups.
//!
//! A field is a slice of `f32`, one value a cell, shape and order those of its [`PoseGrid`]; negative inside.

mod approach;
mod fast_marching;
#[cfg(test)]
mod fixtures;
mod label;
mod lookup;
mod pose_grid;
mod standard;

pub use approach::approach_directions;
pub use fast_marching::signed_distance_thesis;
pub use label::{PoseLabel, Proof};
pub use lookup::{FieldLookup, FieldMetric};
pub use pose_grid::{Axis, AxisUnit, InvalidPoseGrid, PoseGrid};
pub use standard::{METRES_PER_RADIAN, signed_distance_standard};
