//! Measures of completions: overlaps of grids, distances of surfaces, intervals over objects; and baselines that learn nothing.
//!
//! Every number is of class `exact`, given the same grids and meshes; samples and resamples are drawn by key.

mod baseline;
mod interval;
mod overlap;
mod surfaces;

pub use baseline::Baseline;
pub use interval::{Interval, Scores};
pub use overlap::GridOverlap;
pub use surfaces::{SurfaceComparison, SurfaceRule};
