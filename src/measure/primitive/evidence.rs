//! Evidence for and against a shape: observed points and observed free space.

use std::borrow::Cow;

use kernel::geom::GridPlacement;
use nalgebra::Point3;

use super::shape::Primitive;
use crate::seen_cells::{SeenCells, SeenPoint};

/// Distance from the surface within which a point counts as explained [m].
pub(super) const TOLERANCE: f64 = 0.003;
/// Maximum number of points, and of cells, for comparing drawn shapes.
const THINNED: usize = 400;

/// Points that a shape should pass by, and centres of cells that it should not hold.
pub(super) struct Evidence<'a> {
    points: Cow<'a, [SeenPoint]>,
    /// Number of observed points that each point represents.
    per_point: f64,
    free: Vec<Point3<f64>>,
    /// Count of seen points that one of these cells contradicts.
    per_cell: f64,
    /// Side of a cell [m].
    cell: f64,
}

impl<'a> Evidence<'a> {
    pub(super) fn new(seen: &SeenCells<'a>) -> Self {
        let cells = seen.free.into_iter().flat_map(|free| free.cells());
        let free = cells.map(|cell| centre_of(cell, seen.placement)).collect();
        let per_cell = seen.points.len() as f64 / f64::from(seen.partial.count().max(1));
        Self { points: Cow::Borrowed(seen.points), per_point: 1.0, free, per_cell, cell: seen.placement.cell_size }
    }

    /// A part of it, taken evenly.
    pub(super) fn thinned(&self) -> Self {
        let (points, per_point) = evenly(&self.points);
        let (free, cells) = evenly(&self.free);
        Self { points: Cow::Owned(points), per_point, free, per_cell: self.per_cell * cells, cell: self.cell }
    }

    /// Observed points, or a representative part of them.
    pub(super) fn points(&self) -> &[SeenPoint] {
        &self.points
    }

    /// Seen points near the shape's surface, less those that cells contradict whose centre lies more than a cell deep inside of it:
    /// at the silhouette pixels are not sharper than cells.
    pub(super) fn score(&self, shape: &Primitive) -> f64 {
        let near = self.points.iter().filter(|point| shape.signed_distance(&point.position).abs() <= TOLERANCE).count();
        let inside = self.free.iter().filter(|centre| shape.signed_distance(centre) <= -self.cell).count();
        self.per_point * near as f64 - self.per_cell * inside as f64
    }
}

/// At most `THINNED` items, spread evenly, and the number that each of them represents.
fn evenly<T: Clone>(items: &[T]) -> (Vec<T>, f64) {
    let count = items.len().min(THINNED);
    let kept: Vec<T> = (0..count).map(|index| items[index * items.len() / count].clone()).collect();
    let each = items.len() as f64 / count.max(1) as f64;
    (kept, each)
}

/// Centre of a cell [m].
pub(super) fn centre_of(cell: [u32; 3], placement: &GridPlacement) -> Point3<f64> {
    let corner = placement.lower_corner();
    Point3::from([0, 1, 2].map(|axis| corner[axis] + (f64::from(cell[axis]) + 0.5) * placement.cell_size))
}
