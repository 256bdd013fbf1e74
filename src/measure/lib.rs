//! Measures of completions: overlaps of grids, distances of surfaces, intervals over objects; and baselines that learn nothing.
//!
//! Every number is of class `exact`, given the same grids and meshes; samples and resamples are drawn by key.

mod baseline;
mod interval;
mod learned;
mod mirror;
mod overlap;
mod seen_cells;
mod surfaces;

pub use baseline::Baseline;
pub use interval::{Interval, Scores};
pub use learned::TrainingPairs;
pub use overlap::GridOverlap;
pub use seen_cells::SeenCells;
pub use surfaces::{SurfaceComparison, SurfaceRule};
