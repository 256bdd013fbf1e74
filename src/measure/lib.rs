//! Measures of completions: overlaps of grids, distances of surfaces, intervals over objects; and baselines that learn nothing.
//!
//! Every number is of class `exact`, given the same grids and meshes; samples and resamples are drawn by key.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod baseline;
mod geodesic;
mod inside;
mod interval;
mod learned;
mod mesh_overlap;
mod mirror;
mod overlap;
mod primitive;
mod seen_cells;
mod seen_space;
mod surfaces;
mod thesis_rules;

pub use baseline::Baseline;
pub use geodesic::{TrueGeodesics, geodesic_distances};
pub use inside::MeshInside;
pub use interval::{Interval, Scores};
pub use learned::TrainingPairs;
pub use mesh_overlap::mesh_overlap;
pub use overlap::GridOverlap;
pub use primitive::Primitive;
pub use seen_cells::{SeenCells, SeenPoint, SupportPlane};
pub use seen_space::{FREE_SPACE_MARGIN, FREE_SPACE_PIXELS, free_space_violation};
pub use surfaces::{SurfaceComparison, SurfaceRule, TrueSurface};
pub use thesis_rules::{VertexComparison, mesh_overlap_by_thesis};
