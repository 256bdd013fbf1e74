//! Signed distances to a surface on a lattice around it.

use nalgebra::{Point3, Vector3};

use crate::{
    cancel::{Cancel, Cancelled},
    geom::{Aabb, SolidGrid},
    voxel::channels::{Closest, Surface},
};

/// Signed distances to a mesh's surface at the points of a lattice around it, negative inside: exact near the surface, lower
/// bounds farther away.
///
/// Distances change by at most a metre a metre, so that a point of the lattice bounds those around it.
pub struct DistanceGrid {
    /// The first point of the lattice, in `Object` [m].
    origin: Point3<f64>,
    /// Between neighbours [m].
    cell: f64,
    /// Points along each axis.
    counts: [usize; 3],
    /// At each point, rounded [m]. Shape (x, y, z), C order.
    values: Vec<f32>,
    /// The mesh's own box.
    bounds: Aabb,
}

/// Distances up to this are exact [m]: beyond it, in the middle of a ball above all, the search for the nearest of many
/// triangles that are equally near costs most.
const EXACT: f64 = 0.016;

/// Points of a lattice, at most: 32 MiB of distances. A cube of 11 mm has so many in a margin of 12 mm.
const MAX_POINTS: f64 = (1 << 23) as f64;

/// Bound on the rounding error of distances stored as f32 [m]: they stay below a few metres.
const ROUNDING: f64 = 1e-6;

impl DistanceGrid {
    /// `cells` cells along the longest side of the mesh's box, and a margin [m] around it. A small object in its margin has
    /// fewer: distances are as exact, in larger cells.
    ///
    /// # Errors
    /// When it is cancelled.
    pub fn new(
        surface: &Surface,
        solid: &SolidGrid,
        bounds: &Aabb,
        cells: u32,
        margin: f64,
        cancel: &Cancel,
    ) -> Result<Self, Cancelled> {
        let (cell, counts) = lattice(bounds, cells, margin);
        let origin = bounds.min - Vector3::repeat(margin);
        let mut values = Vec::with_capacity(counts.iter().product());
        let at = |[x, y, z]: [usize; 3]| origin + Vector3::new(x as f64, y as f64, z as f64) * cell;
        // Each point starts from the nearest triangle of a neighbour: the search has little left to do.
        let mut column: Option<Closest> = None;
        for x in 0..counts[0] {
            for y in 0..counts[1] {
                cancel.check()?;
                let mut hint = column;
                // How much of the last exact distance is left before the surface may be near.
                let (mut last, mut left) = (0.0, 0.0);
                for z in 0..counts[2] {
                    // Lower bound one cell on: the distance changes by at most the step's length (Lipschitz constant 1).
                    (last, left) = (last - cell, left - cell);
                    if left < 0.0 || z == 0 {
                        // Exact signed distance where the bound does not suffice.
                        let point = at([x, y, z]);
                        hint = surface.closest_from(&point, f64::INFINITY, hint.as_ref());
                        column = if z == 0 { hint } else { column };
                        let distance = hint.map_or(f64::INFINITY, |closest| closest.distance_squared.sqrt());
                        let inside = surface.inside(solid, &point, hint.as_ref());
                        (last, left) = (if inside { -distance } else { distance }, distance - EXACT);
                    }
                    values.push(last as f32);
                }
            }
        }
        Ok(Self { origin, cell, counts, values, bounds: *bounds })
    }

    /// Points of the lattice.
    pub fn points(&self) -> usize {
        self.values.len()
    }

    /// A lower bound of the signed distance from the surface to a point in `Object` [m].
    pub fn at_least(&self, point: &Point3<f64>) -> f64 {
        match self.nearest(point) {
            Some((value, apart)) => value - apart - ROUNDING,
            None => {
                // Beyond the lattice the surface is at least as far as its box.
                let nearest = point.coords.sup(&self.bounds.min.coords).inf(&self.bounds.max.coords);
                (point.coords - nearest).norm()
            }
        }
    }

    /// An upper bound of the signed distance from the surface to a point in `Object` [m], infinite beyond the lattice.
    pub fn at_most(&self, point: &Point3<f64>) -> f64 {
        // What lies deeper than distances are exact is a lower bound: there the surface is at least that far.
        self.nearest(point).map_or(f64::INFINITY, |(value, apart)| value.max(-EXACT) + apart + ROUNDING)
    }

    /// The value at the point of the lattice next to a point, and how far the two are apart at most [m]; `None` beyond the lattice.
    fn nearest(&self, point: &Point3<f64>) -> Option<(f64, f64)> {
        let along = (point - self.origin) / self.cell;
        let mut indices = [0; 3];
        let mut apart = 0.0;
        for axis in 0..3 {
            let nearest = along[axis].round();
            if !(0.0..self.counts[axis] as f64).contains(&nearest) {
                return None;
            }
            indices[axis] = nearest as usize;
            apart += (along[axis] - nearest).powi(2);
        }
        let [x, y, z] = indices;
        let value = f64::from(self.values[(x * self.counts[1] + y) * self.counts[2] + z]);
        Some((value, self.cell * apart.sqrt()))
    }

    /// About the signed distance from the surface to a point in `Object` [m], between the points of the lattice; beyond it the
    /// lower bound.
    pub fn about(&self, point: &Point3<f64>) -> f64 {
        let along = (point - self.origin) / self.cell;
        let low = along.map(f64::floor);
        let fits = |axis: usize| low[axis] >= 0.0 && low[axis] + 1.0 < self.counts[axis] as f64;
        if !(0..3).all(fits) {
            return self.at_least(point);
        }
        let part = along - low;
        let first = (low.x as usize * self.counts[1] + low.y as usize) * self.counts[2] + low.z as usize;
        let value = |index: usize| f64::from(self.values[index]);
        let row = |index: usize| value(index) * (1.0 - part.z) + value(index + 1) * part.z;
        let sheet = |index: usize| row(index) * (1.0 - part.y) + row(index + self.counts[2]) * part.y;
        sheet(first) * (1.0 - part.x) + sheet(first + self.counts[1] * self.counts[2]) * part.x
    }

    /// The mesh's own box, in `Object`.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }
}

/// Side of a cell [m] and points along each axis of a lattice that covers a box and its margin.
fn lattice(bounds: &Aabb, cells: u32, margin: f64) -> (f64, [usize; 3]) {
    let mut cell = bounds.longest_side() / f64::from(cells.max(1));
    loop {
        let counts = bounds.extents().map(|side| ((side + 2.0 * margin) / cell).ceil() as usize + 1);
        let points: f64 = counts.iter().map(|&count| count as f64).product();
        if points <= MAX_POINTS {
            return (cell, counts);
        }
        // Rounding up to whole cells may take one more step.
        cell *= libm::cbrt(points / MAX_POINTS).max(1.001);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(side: f64) -> Aabb {
        Aabb { min: Point3::origin(), max: Point3::origin() + Vector3::repeat(side) }
    }

    #[test]
    fn the_points_of_a_lattice_are_bounded_however_small_the_object() {
        for side in [0.02, 0.012, 0.0051, 0.002, 1e-5, 1e-9] {
            let (cell, counts) = lattice(&cube(side), 64, 0.012);
            let points: usize = counts.iter().product();
            assert!(points <= 1 << 23, "{side}: {points}");
            assert!(counts.iter().all(|&count| (count - 1) as f64 * cell >= side + 0.024), "{side}: {counts:?}");
            // Where it is bounded, the bound is used.
            assert!(side >= 0.012 || points > 8_000_000, "{side}: {points}");
            assert_eq!(cell == side / 64.0, side >= 0.012, "{side}: {cell}");
        }
    }

    #[test]
    fn a_lattice_of_a_usual_object_has_the_cells_that_were_asked_for() {
        let bounds = Aabb { min: Point3::origin(), max: Point3::new(0.016, 0.1, 0.05) };
        assert_eq!(lattice(&bounds, 64, 0.012), (0.1 / 64.0, [27, 81, 49]));
    }
}
