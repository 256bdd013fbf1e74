//! What the values of a field count, and the field of a grid so counted.

use super::{AxisUnit, PoseGrid, signed_distance_sphere, signed_distance_standard, signed_distance_thesis};

/// What the values of a field count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldMetric {
    /// Metres, angles weighted by `rho` (profile `standard`).
    Metres {
        /// Metres that count as much as one radian [m/rad].
        rho: f64,
    },
    /// Cells, all axes equal (profile `thesis`); only of six axes.
    Cells,
}

impl FieldMetric {
    /// Whether it measures this grid: cells are no measure between directions, which have no axes.
    pub fn fits(self, grid: &PoseGrid) -> bool {
        matches!((self, grid), (Self::Metres { .. }, _) | (Self::Cells, PoseGrid::Axes(_)))
    }

    /// Signed distance of each cell to the border of the set inside, negative inside.
    ///
    /// # Panics
    /// When `inside` has not one value a cell, or the metric does not fit the grid.
    pub fn signed_distance(self, inside: &[bool], grid: &PoseGrid) -> Vec<f32> {
        match (self, grid) {
            (Self::Metres { rho }, PoseGrid::Axes(grid)) => signed_distance_standard(inside, grid, rho),
            (Self::Metres { rho }, PoseGrid::Sphere(grid)) => signed_distance_sphere(inside, grid, rho),
            (Self::Cells, PoseGrid::Axes(grid)) => signed_distance_thesis(inside, grid),
            (Self::Cells, PoseGrid::Sphere(_)) => panic!("a grid of directions has no field in cells"),
        }
    }

    /// Field units in one unit of an axis.
    pub(super) fn scale(self, unit: AxisUnit, step: f64) -> f64 {
        match (self, unit) {
            (Self::Metres { rho }, AxisUnit::Radian) => rho,
            (Self::Metres { .. }, AxisUnit::Metre | AxisUnit::HealPix) => 1.0,
            (Self::Cells, _) => 1.0 / step,
        }
    }
}
