//! Metrics of a field: the quantity that its distances count.

use super::{AxisUnit, PoseGrid};

/// Metric of a field's values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldMetric {
    /// Metres, angles weighted by `rho` (profile `standard`).
    Metres {
        /// Metres equivalent to one radian [m/rad].
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

    /// Field units in one unit of an axis.
    pub(super) fn scale(self, unit: AxisUnit, step: f64) -> f64 {
        match (self, unit) {
            (Self::Metres { rho }, AxisUnit::Radian) => rho,
            (Self::Metres { .. }, AxisUnit::Metre | AxisUnit::HealPix) => 1.0,
            (Self::Cells, _) => 1.0 / step,
        }
    }
}
