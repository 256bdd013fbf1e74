//! Signed distances to a surface on a lattice around it.

use std::sync::{Arc, OnceLock};

use nalgebra::{Point3, Vector3};

use crate::{
    geom::{Aabb, PackedSolid},
    voxel::channels::{Closest, Surface},
};

/// Signed distances to a mesh's surface at the points of a lattice around it, negative inside: exact near the surface, lower
/// bounds farther away.
///
/// Distances change by at most one metre per metre, so that a lattice point bounds those around it. They are measured
/// in bricks of points, each on first use, since nothing ever comes near most of a mesh. A brick's distances depend
/// only on the mesh and the brick.
pub struct DistanceGrid {
    surface: Arc<Surface>,
    solid: Arc<PackedSolid>,
    /// The mesh's own box.
    bounds: Aabb,
    /// The first point of the lattice, in `Object` [m].
    origin: Point3<f64>,
    /// Between neighbours [m].
    cell: f64,
    /// Points along each axis.
    counts: [usize; 3],
    /// Bricks along each axis.
    brick_counts: [usize; 3],
    /// Shape (x, y, z), C order.
    bricks: Vec<OnceLock<Brick>>,
}

/// Distances at the points of a brick [`STEP`]. Shape (x, y, z), C order; those beyond the lattice are 0.
type Brick = Box<[i16; SIDE * SIDE * SIDE]>;

/// Step by which distances are stored [m]: two bytes reach twice as far as distances are exact.
const STEP: f64 = 1e-6;

/// Points along each side of a brick.
const SIDE: usize = 8;

/// Distances up to this are exact [m]. Farther inside, above all in the middle of a ball, many triangles are equally
/// near and the search for the nearest costs most.
const EXACT: f64 = 0.016;

/// Smallest cell [m], even for small objects: finer cells take longer to measure than they save.
const MIN_CELL: f64 = 0.0015;

/// Bound on the rounding error of stored distances [m].
const ROUNDING: f64 = 1e-6;

/// Smallest distance that is stored [m]; deeper points are stored with this value too.
const DEEPEST: f64 = i16::MIN as f64 * STEP;

impl DistanceGrid {
    /// `cells` cells along the longest side of the mesh's box, and a margin [m] around it. A small object has fewer:
    /// distances are as exact, in larger cells.
    pub fn new(surface: Arc<Surface>, solid: Arc<PackedSolid>, bounds: &Aabb, cells: u32, margin: f64) -> Self {
        let (cell, counts) = lattice(bounds, cells, margin);
        let brick_counts = counts.map(|count| count.div_ceil(SIDE));
        let bricks = (0..brick_counts.iter().product()).map(|_| OnceLock::new()).collect();
        let origin = bounds.min - Vector3::repeat(margin);
        Self { surface, solid, bounds: *bounds, origin, cell, counts, brick_counts, bricks }
    }

    /// The value at a point of the lattice [m].
    fn value(&self, point: [usize; 3]) -> f64 {
        let [x, y, z] = point.map(|index| index / SIDE);
        let index = (x * self.brick_counts[1] + y) * self.brick_counts[2] + z;
        let brick = self.bricks[index].get_or_init(|| self.measure([x, y, z].map(|brick| brick * SIDE)));
        let [x, y, z] = point.map(|index| index % SIDE);
        f64::from(brick[(x * SIDE + y) * SIDE + z]) * STEP
    }

    /// Measures the brick whose first point of the lattice is `first`.
    fn measure(&self, first: [usize; 3]) -> Brick {
        let mut brick = Box::new([0; SIDE * SIDE * SIDE]);
        let [xs, ys, zs] = [0, 1, 2].map(|axis| SIDE.min(self.counts[axis] - first[axis]));
        // Each point starts from the nearest triangle of a neighbour, which leaves little to search.
        let mut column: Option<Closest> = None;
        for x in 0..xs {
            for y in 0..ys {
                let mut hint = column;
                // How much of the last exact distance is left before the surface may be near.
                let (mut last, mut left) = (0.0, 0.0);
                for z in 0..zs {
                    // Lower bound one cell on: the distance changes by at most the step's length (Lipschitz constant 1).
                    (last, left) = (last - self.cell, left - self.cell);
                    if left < 0.0 || z == 0 {
                        // Exact signed distance where the bound does not suffice.
                        let steps = Vector3::new(first[0] + x, first[1] + y, first[2] + z).map(|index| index as f64);
                        let point = self.origin + steps * self.cell;
                        hint = self.surface.closest_from(&point, f64::INFINITY, hint.as_ref());
                        column = if z == 0 { hint } else { column };
                        let distance = hint.map_or(f64::INFINITY, |closest| closest.distance_squared.sqrt());
                        let inside = self.surface.inside(&*self.solid, &point, hint.as_ref());
                        (last, left) = (if inside { -distance } else { distance }, distance - EXACT);
                    }
                    // What does not fit is cut off.
                    brick[(x * SIDE + y) * SIDE + z] = (last / STEP).round() as i16;
                }
            }
        }
        brick
    }

    /// A lower bound of the signed distance from the surface to a point in `Object` [m].
    pub fn at_least(&self, point: &Point3<f64>) -> f64 {
        match self.nearest(point) {
            // Nothing is deeper than the object is long.
            Some((value, _)) if value <= DEEPEST => -self.bounds.longest_side(),
            Some((value, apart)) => value - apart - ROUNDING,
            None => {
                // Beyond the lattice the surface is at least as far as its box.
                let nearest = point.coords.sup(&self.bounds.min.coords).inf(&self.bounds.max.coords);
                (point.coords - nearest).norm()
            }
        }
    }

    /// An upper bound of the signed distance from the surface to a point in `Object` [m], infinite where the surface is farther
    /// away than distances are exact.
    pub fn at_most(&self, point: &Point3<f64>) -> f64 {
        match self.nearest(point) {
            // Values deeper than the exact range are lower bounds: there the surface is at least that far.
            Some((value, apart)) if value <= EXACT => value.max(-EXACT) + apart + ROUNDING,
            _ => f64::INFINITY,
        }
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
        Some((self.value(indices), self.cell * apart.sqrt()))
    }

    /// Approximate signed distance from the surface to a point in `Object` [m], interpolated between lattice points;
    /// outside the lattice, the lower bound.
    pub fn about(&self, point: &Point3<f64>) -> f64 {
        let along = (point - self.origin) / self.cell;
        let low = along.map(f64::floor);
        let fits = |axis: usize| low[axis] >= 0.0 && low[axis] + 1.0 < self.counts[axis] as f64;
        if !(0..3).all(fits) {
            return self.at_least(point);
        }
        let part = along - low;
        let [x, y, z] = [0, 1, 2].map(|axis| low[axis] as usize);
        let row = |x, y| self.value([x, y, z]) * (1.0 - part.z) + self.value([x, y, z + 1]) * part.z;
        let sheet = |x| row(x, y) * (1.0 - part.y) + row(x, y + 1) * part.y;
        sheet(x) * (1.0 - part.x) + sheet(x + 1) * part.x
    }

    /// The mesh's own box, in `Object`.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }
}

/// Side of a cell [m] and points along each axis of a lattice that covers a box and its margin.
fn lattice(bounds: &Aabb, cells: u32, margin: f64) -> (f64, [usize; 3]) {
    let cell = (bounds.longest_side() / f64::from(cells.max(1))).max(MIN_CELL);
    (cell, bounds.extents().map(|side| ((side + 2.0 * margin) / cell).ceil() as usize + 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        seed::Stream,
        test_shapes::built_in,
        voxel::{InsideTest, solid_occupancy},
    };

    fn cube(side: f64) -> Aabb {
        Aabb { min: Point3::origin(), max: Point3::origin() + Vector3::repeat(side) }
    }

    #[test]
    fn the_points_of_a_lattice_are_bounded_however_small_the_object() {
        for side in [20.0, 0.2, 0.097, 0.02, 0.002, 1e-5, 1e-9] {
            let (cell, counts) = lattice(&cube(side), 64, 0.012);
            let points: usize = counts.iter().product();
            assert!(points <= 82 * 82 * 82, "{side}: {points}");
            assert!(counts.iter().all(|&count| (count - 1) as f64 * cell >= side + 0.024), "{side}: {counts:?}");
            assert_eq!(cell == side / 64.0, side > 0.096, "{side}: {cell}");
        }
    }

    #[test]
    fn a_lattice_of_a_usual_object_has_the_cells_that_were_asked_for() {
        let bounds = Aabb { min: Point3::origin(), max: Point3::new(0.016, 0.1, 0.05) };
        assert_eq!(lattice(&bounds, 64, 0.012), (0.1 / 64.0, [27, 81, 49]));
    }

    #[test]
    fn distances_lie_within_their_bounds_in_whatever_order_they_are_asked_for() {
        for name in ["mug-01", "can-01", "box-01"] {
            let mesh = built_in(name);
            let solid = Arc::new(PackedSolid::from(&solid_occupancy(&mesh, InsideTest::Crossings, false)));
            let (surface, bounds) = (Arc::new(Surface::new(&mesh)), mesh.aabb().expect("vertices"));
            let grid = || DistanceGrid::new(Arc::clone(&surface), Arc::clone(&solid), &bounds, 64, 0.012);
            let mut stream = Stream::of_job(5, b"", "lattice");
            let mut point = || {
                Point3::from([0, 1, 2].map(|axis| stream.uniform(bounds.min[axis] - 0.012, bounds.max[axis] + 0.012)))
            };
            let points: Vec<_> = (0..2000).map(|_| point()).collect();
            let told = |grid: &DistanceGrid, point: &Point3<f64>| {
                [grid.at_least(point), grid.about(point), grid.at_most(point)].map(f64::to_bits)
            };
            let [forth, back] = [grid(), grid()];
            // The first answers measure one brick, or those around a point between bricks.
            told(&forth, &points[0]);
            let measured = forth.bricks.iter().filter(|brick| brick.get().is_some()).count();
            assert!((1..=8).contains(&measured), "{name}: {measured}");
            let in_turn: Vec<_> = points.iter().map(|point| told(&forth, point)).collect();
            let mut reversed: Vec<_> = points.iter().rev().map(|point| told(&back, point)).collect();
            reversed.reverse();
            assert_eq!(in_turn, reversed, "{name}");
            for (point, told) in points.iter().zip(in_turn) {
                let distance = surface.signed_distance(&*solid, point);
                let [least, about, most] = told.map(f64::from_bits);
                // Points next to each other of a lattice are a cell apart, those that bound a point at most .87.
                let slack = 0.87 * forth.cell + 2.0 * ROUNDING;
                assert!(least <= distance && distance <= most, "{name}, {point}: {least} {distance} {most}");
                if distance.abs() < EXACT - slack {
                    assert!(distance - least <= 2.0 * slack && most - distance <= 2.0 * slack, "{name}, {point}");
                    assert!((about - distance).abs() <= 2.0 * slack, "{name}, {point}: {about} {distance}");
                }
            }
        }
    }
}
