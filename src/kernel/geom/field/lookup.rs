//! Values of a field between the centres of its cells.

use super::{FieldMetric, PoseGrid, axis_lookup::AxisLookup, sphere_lookup::SphereLookup};
use crate::geom::SimdLevel;

/// Lookups between the centres of a grid's cells, prepared once for a grid and a metric.
#[derive(Clone, Debug)]
pub struct FieldLookup {
    grid: PoseGrid,
    metric: FieldMetric,
    kind: Kind,
}

#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a map has one, and no step more to it")]
enum Kind {
    Axes(AxisLookup),
    Sphere(SphereLookup),
}

impl FieldLookup {
    /// Prepares lookups in fields over this grid.
    pub fn new(grid: &PoseGrid, metric: FieldMetric) -> Self {
        let kind = match grid {
            PoseGrid::Axes(grid) => Kind::Axes(AxisLookup::new(grid, metric)),
            PoseGrid::Sphere(grid) => Kind::Sphere(SphereLookup::new(grid, metric)),
        };
        Self { grid: grid.clone(), metric, kind }
    }

    /// With these vector instructions, or the machine's best where that is less; the bits are the same.
    #[must_use]
    pub fn with_simd(self, level: SimdLevel) -> Self {
        let kind = match self.kind {
            Kind::Axes(lookup) => Kind::Axes(lookup.with_simd(level)),
            sphere @ Kind::Sphere(_) => sphere,
        };
        Self { kind, ..self }
    }

    /// The grid.
    pub fn grid(&self) -> &PoseGrid {
        &self.grid
    }

    /// Metric that the values are given in.
    pub fn metric(&self) -> FieldMetric {
        self.metric
    }

    /// Value and gradient of a field at a pose: x, y, z [m], roll, pitch, yaw [rad].
    ///
    /// On six axes: multilinear between the 2^6 nearest centres; periodic axes wrap. On directions: linear between the 8
    /// nearest positions; between the three directions around the pose's own, weighted as the sides of the triangle that
    /// they span; for each of the three, the pose is swung onto it by the smallest rotation, and the value is linear between
    /// the two nearest rolls. That is continuous and has each cell's value at its centre.
    ///
    /// Beyond the box of the centres (non-periodic axes): the value at the nearest point of the box plus the distance to it
    /// in the metric of the field, and the gradient of that sum. The gradient is in field units per metre (x, y, z) and per
    /// radian (roll, pitch, yaw); where it jumps, it is that of one side (of six axes: above, below on the last centre).
    /// An infinite field is infinite everywhere, with a zero gradient; a pose that is not finite gives NaN or an infinite
    /// value.
    ///
    /// # Panics
    /// When `field` has not one value per cell.
    #[inline]
    pub fn value_and_gradient(&self, field: &[f32], pose: &[f64; 6]) -> (f64, [f64; 6]) {
        match &self.kind {
            Kind::Axes(lookup) => lookup.value_and_gradient(field, pose),
            Kind::Sphere(lookup) => lookup.value_and_gradient(field, pose),
        }
    }
}
