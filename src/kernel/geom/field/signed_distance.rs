//! Signed distance over a grid of any kind, in any metric.

use super::{FieldMetric, PoseGrid, signed_distance_sphere, signed_distance_standard, signed_distance_thesis};

impl FieldMetric {
    /// Signed distance of each cell to the border of the set inside, negative inside.
    ///
    /// # Panics
    /// When `inside` has not one value per cell, or the metric does not fit the grid.
    pub fn signed_distance(self, inside: &[bool], grid: &PoseGrid) -> Vec<f32> {
        match (self, grid) {
            (Self::Metres { rho }, PoseGrid::Axes(grid)) => signed_distance_standard(inside, grid, rho),
            (Self::Metres { rho }, PoseGrid::Sphere(grid)) => signed_distance_sphere(inside, grid, rho),
            (Self::Cells, PoseGrid::Axes(grid)) => signed_distance_thesis(inside, grid),
            (Self::Cells, PoseGrid::Sphere(_)) => panic!("a grid of directions has no field in cells"),
        }
    }
}
