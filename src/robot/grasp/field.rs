//! Signed distances to an object as annealing reads them: between the points of a lattice, sixteen points at a time.

use nalgebra::{Point3, Vector3};

use kernel::{
    contact::ContactSurface,
    geom::lanes::{Lanes, each_of},
};

/// Cells along the longest side of the lattice.
const CELLS: u32 = 128;

/// Margin of the lattice around the object's box [m].
const MARGIN: f64 = 0.06;

/// Cells along each axis of a block.
const BLOCK: usize = 2;

/// Stride between lattice points with exact distances; nearer to the surface than [`BAND`] [m], every point is exact.
const COARSE: usize = 2;
const BAND: f64 = 0.012;

/// Signed distance to an object's surface around it, negative inside.
///
/// Compared with exact distances its error is that of trilinear interpolation between points a 128th of the padded
/// box's longest side apart (1.9 mm for a mug): some hundredths of a millimetre at smooth points, up to half a cell at
/// edges and in the middle of thin walls, where the direction to the surface also jumps. Kept grasps are rated again
/// with exact distances. Of class `exact`.
pub struct DistanceField {
    origin: [f32; 3],
    cell: f32,
    counts: [i32; 3],
    /// At each point, 16-bit little-endian counts of `step`. Shape (x, y, z), C order.
    values: Vec<u8>,
    /// [m].
    step: f32,
    /// Blocks of [`BLOCK`] cells along each axis, and of each the least (low half) and largest value (high half) between its
    /// points: a megabyte, which stays in the cache. Larger blocks bound less and cost more distances than they save.
    block_counts: [i32; 3],
    blocks: Vec<u32>,
}

/// Distance and direction at sixteen points.
pub(super) struct Near<L: Lanes> {
    /// Signed [m].
    pub(super) distance: L::F,
    /// Away from the surface's closest point outside, towards it inside; a unit vector.
    pub(super) outward: [L::F; 3],
}

/// Sixteen cells of the lattice.
struct Cell<L: Lanes> {
    /// Both ends of the cell's four edges along z, in steps; y varies first, then x.
    ends: [[L::F; 2]; 4],
    /// Where in the cell, 0 to 1.
    shares: [L::F; 3],
    /// Distance of the position beyond the lattice [m].
    beyond: [L::F; 3],
}

impl DistanceField {
    /// Around an object: 1.6 million distances for a box of equal sides.
    pub fn new(surface: &ContactSurface) -> Self {
        Self::with_cells(surface, CELLS)
    }

    /// Around an object, with this number of cells along the longest side of the lattice, at least 1.
    pub fn with_cells(surface: &ContactSurface, cells: u32) -> Self {
        let bounds = surface.bounds();
        let sides = bounds.extents().map(|side| side + 2.0 * MARGIN);
        let cell = sides.iter().fold(0.0, |a: f64, b| a.max(*b)) / f64::from(cells);
        let origin = bounds.min - Vector3::repeat(MARGIN);
        // Enough points for the coarse lattice to end where the fine one does.
        let counts: [usize; 3] = std::array::from_fn(|axis| {
            let cells = (sides[axis] / cell).ceil() as usize;
            cells.div_ceil(COARSE) * COARSE + 1
        });
        Self::from_lattice(&origin, cell, counts, &distances(surface, &origin, cell, counts))
    }

    /// From signed distances [m] at the points of a lattice, shape `counts` (x, y, z) in C order: `origin` in `Object` is the first
    /// point, `cell` the distance between neighbours [m].
    ///
    /// # Panics
    /// When there are fewer than two points along an axis, not one distance per point, or no distance other than 0 and infinity.
    pub fn from_lattice(origin: &Point3<f64>, cell: f64, counts: [usize; 3], distances: &[f64]) -> Self {
        assert!(counts.iter().all(|count| *count > 1), "a lattice of {counts:?} points");
        assert_eq!(distances.len(), counts.iter().product::<usize>(), "one distance per point");
        let largest = distances.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert!(largest > 0.0 && largest.is_finite(), "distances up to {largest} m");
        let step = largest / f64::from(i16::MAX);
        let steps: Vec<i16> = distances.iter().map(|distance| (distance / step).round() as i16).collect();
        let (block_counts, blocks) = blocks(&steps, counts);
        Self {
            block_counts: block_counts.map(|count| count as i32),
            blocks,
            origin: origin.coords.map(|part| part as f32).into(),
            cell: cell as f32,
            counts: counts.map(|count| count as i32),
            values: steps.iter().flat_map(|steps| steps.to_le_bytes()).collect(),
            step: step as f32,
        }
    }

    /// Size in memory [bytes].
    pub fn bytes(&self) -> usize {
        self.values.len()
    }

    /// Lower and upper bounds of [`DistanceField::distance`] at sixteen points, for a quarter of its work.
    #[inline(always)]
    pub(super) fn bounds<L: Lanes>(&self, l: L, point: [L::F; 3]) -> [L::F; 2] {
        let inverse = l.splat(1.0 / (self.cell * BLOCK as f32));
        let [x, y, z]: [L::I; 3] = each_of!([0, 1, 2], axis => {
            let along = l.mul(l.sub(point[axis], l.splat(self.origin[axis])), inverse);
            l.truncate(l.min(l.max(along, l.splat(0.0)), l.splat((self.block_counts[axis] - 1) as f32)))
        });
        let row = l.add_i(l.mul_i(x, l.splat_i(self.block_counts[1])), y);
        let index = l.add_i(l.mul_i(row, l.splat_i(self.block_counts[2])), z);
        // SAFETY: the points were held inside the blocks.
        #[expect(unsafe_code, reason = "gathers from indices that were held inside the table")]
        let pair = unsafe { l.gather_i(&self.blocks, index) };
        let step = l.splat(self.step);
        let [low, high] = [l.sar_i::<16>(l.shl_i::<16>(pair)), l.sar_i::<16>(pair)];
        [l.mul(l.to_float(low), step), l.mul(l.to_float(high), step)]
    }

    /// Signed distance at sixteen points in `Object` [m]; beyond the lattice that of its nearest point, which is less.
    #[inline(always)]
    pub(super) fn distance<L: Lanes>(&self, l: L, point: [L::F; 3]) -> L::F {
        let cell = self.cell(l, point);
        let [x, y, z] = cell.shares;
        let [a, b, c, d] = each_of!([0, 1, 2, 3], edge => mixed(l, cell.ends[edge][0], cell.ends[edge][1], z));
        l.mul(mixed(l, mixed(l, a, b, y), mixed(l, c, d, y), x), l.splat(self.step))
    }

    /// Distance and direction at sixteen points in `Object` [m]. Beyond the lattice: from where the lattice's nearest point has
    /// the surface.
    #[inline(always)]
    pub(super) fn near<L: Lanes>(&self, l: L, point: [L::F; 3]) -> Near<L> {
        let Cell { ends, shares: [fx, fy, fz], beyond } = self.cell(l, point);
        let [a, b, c, d] = each_of!([0, 1, 2, 3], edge => mixed(l, ends[edge][0], ends[edge][1], fz));
        let [da, db, dc, dd] = each_of!([0, 1, 2, 3], edge => l.sub(ends[edge][1], ends[edge][0]));
        let (lower, upper) = (mixed(l, a, b, fy), mixed(l, c, d, fy));
        let distance = l.mul(mixed(l, lower, upper, fx), l.splat(self.step));
        let slope = [
            l.sub(upper, lower),
            mixed(l, l.sub(b, a), l.sub(d, c), fx),
            mixed(l, mixed(l, da, db, fy), mixed(l, dc, dd, fy), fx),
        ];
        let (outward, _) = unit(l, slope);
        let outside = l.lt(l.splat(0.0), l.add(l.add(l.abs(beyond[0]), l.abs(beyond[1])), l.abs(beyond[2])));
        if l.bits(outside) == 0 {
            return Near { distance, outward };
        }
        let offset: [L::F; 3] = each_of!([0, 1, 2], axis => l.add(beyond[axis], l.mul(outward[axis], distance)));
        let (straight, far) = unit(l, offset);
        Near {
            distance: l.select(outside, far, distance),
            outward: each_of!([0, 1, 2], axis => l.select(outside, straight[axis], outward[axis])),
        }
    }

    /// The cells of the lattice that sixteen points lie in, or are nearest to.
    #[inline(always)]
    fn cell<L: Lanes>(&self, l: L, point: [L::F; 3]) -> Cell<L> {
        let inverse = l.splat(1.0 / self.cell);
        let along: [L::F; 3] =
            each_of!([0, 1, 2], axis => l.mul(l.sub(point[axis], l.splat(self.origin[axis])), inverse));
        let held: [L::F; 3] = each_of!([0, 1, 2], axis =>
            l.min(l.max(along[axis], l.splat(0.0)), l.splat((self.counts[axis] - 1) as f32)));
        // The last cell ends where the lattice does.
        let low: [L::F; 3] = each_of!([0, 1, 2], axis =>
            l.min(l.to_float(l.truncate(held[axis])), l.splat((self.counts[axis] - 2) as f32)));
        let [x, y, z] = each_of!([0, 1, 2], axis => l.truncate(low[axis]));
        let row = l.add_i(l.mul_i(x, l.splat_i(self.counts[1])), y);
        let first = l.shl_i::<1>(l.add_i(l.mul_i(row, l.splat_i(self.counts[2])), z));
        let (next_y, next_x) = (2 * self.counts[2], 2 * self.counts[1] * self.counts[2]);
        let ends: [[L::F; 2]; 4] = each_of!([0, next_y, next_x, next_x + next_y], offset => {
            // SAFETY: the cell's corners are points of the lattice.
            #[expect(unsafe_code, reason = "gathers from indices that were held inside the lattice")]
            let pair = unsafe { l.gather_bytes(&self.values, l.add_i(first, l.splat_i(offset))) };
            [l.to_float(l.sar_i::<16>(l.shl_i::<16>(pair))), l.to_float(l.sar_i::<16>(pair))]
        });
        let cell = l.splat(self.cell);
        Cell {
            ends,
            shares: each_of!([0, 1, 2], axis => l.sub(held[axis], low[axis])),
            beyond: each_of!([0, 1, 2], axis => l.mul(l.sub(along[axis], held[axis]), cell)),
        }
    }
}

#[inline(always)]
fn mixed<L: Lanes>(l: L, a: L::F, b: L::F, share: L::F) -> L::F {
    l.add(a, l.mul(share, l.sub(b, a)))
}

/// A vector scaled to unit length, and how long it was.
#[inline(always)]
fn unit<L: Lanes>(l: L, of: [L::F; 3]) -> ([L::F; 3], L::F) {
    let length = l.sqrt(l.add(l.add(l.mul(of[0], of[0]), l.mul(of[1], of[1])), l.mul(of[2], of[2])));
    let inverse = l.div(l.splat(1.0), l.max(length, l.splat(1e-6)));
    (each_of!([0, 1, 2], axis => l.mul(of[axis], inverse)), length)
}

/// Smallest and largest value of the points in each block of cells. A position that rounding moves into the next block
/// is still between the points of both: each block includes the points around it.
fn blocks(steps: &[i16], counts: [usize; 3]) -> ([usize; 3], Vec<u32>) {
    let block_counts = counts.map(|count| (count - 1).div_ceil(BLOCK));
    let around =
        |block: usize, count: usize| (block * BLOCK).saturating_sub(1)..=((block + 1) * BLOCK + 1).min(count - 1);
    let mut blocks = Vec::with_capacity(block_counts.iter().product());
    for x in 0..block_counts[0] {
        for y in 0..block_counts[1] {
            for z in 0..block_counts[2] {
                let (mut min, mut largest) = (i16::MAX, i16::MIN);
                for x in around(x, counts[0]) {
                    for y in around(y, counts[1]) {
                        let row = (x * counts[1] + y) * counts[2];
                        for z in around(z, counts[2]) {
                            (min, largest) = (min.min(steps[row + z]), largest.max(steps[row + z]));
                        }
                    }
                }
                blocks.push(u32::from(min as u16) | u32::from(largest as u16) << 16);
            }
        }
    }
    (block_counts, blocks)
}

/// Signed distances at the points of a lattice [m].
fn distances(surface: &ContactSurface, origin: &Point3<f64>, cell: f64, counts: [usize; 3]) -> Vec<f64> {
    let point = |x: usize, y: usize, z: usize| (x * counts[1] + y) * counts[2] + z;
    let at = |x: usize, y: usize, z: usize| origin + Vector3::new(x as f64, y as f64, z as f64) * cell;
    let mut values = vec![f64::NAN; counts.iter().product()];
    // Pass 1: exact distances at the coarse points.
    // Each point starts from the nearest triangle of a neighbour: the search has little left to do.
    let mut hint = None;
    for x in (0..counts[0]).step_by(COARSE) {
        for y in (0..counts[1]).step_by(COARSE) {
            for z in (0..counts[2]).step_by(COARSE) {
                let (closest, distance) = surface.closest(&at(x, y, z), hint.as_ref());
                hint = Some(closest);
                values[point(x, y, z)] = distance;
            }
        }
    }
    // Pass 2: the points between, interpolated far from the surface, exact near it.
    let coarse = values.clone();
    for x in 0..counts[0] {
        for y in 0..counts[1] {
            for z in 0..counts[2] {
                if [x, y, z].iter().all(|along| along.is_multiple_of(COARSE)) {
                    continue;
                }
                // Between the coarse points around it.
                let ends =
                    |along: usize| if along.is_multiple_of(COARSE) { [along, along] } else { [along - 1, along + 1] };
                let [xs, ys, zs] = [x, y, z].map(ends);
                let mut mean = 0.0;
                for corner in 0..8 {
                    mean += coarse[point(xs[corner & 1], ys[corner >> 1 & 1], zs[corner >> 2])] / 8.0;
                }
                values[point(x, y, z)] = if mean.abs() > BAND {
                    mean
                } else {
                    let (closest, distance) = surface.closest(&at(x, y, z), hint.as_ref());
                    hint = Some(closest);
                    distance
                };
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use assets::{built_in_source, prepare};
    use kernel::{
        geom::{MeshQuery, lanes::Scalar},
        seed::Stream,
        voxel::InsideTest,
    };

    /// Errors against parry's exact projections, near the surface and anywhere around it, beyond the lattice too.
    #[test]
    fn distances_and_directions_are_close_to_exact_ones() {
        let mesh = prepare(&built_in_source("mug-01@16k")).expect("a sound shape").mesh;
        let surface = ContactSurface::new(&mesh, InsideTest::Crossings).expect("a surface");
        let query = MeshQuery::new(&mesh).expect("a surface");
        let field = DistanceField::new(&surface);
        let bounds = surface.bounds();
        let mut draw = Stream::of_job(1, b"", "field");
        let (mut near, mut all, mut angles) = (Vec::new(), Vec::new(), Vec::new());
        while near.len() < 5_000 {
            // The lattice ends 60 mm from the box.
            let point = Point3::from_slice(&std::array::from_fn::<_, 3, _>(|axis| {
                draw.uniform(bounds.min[axis] - 0.1, bounds.max[axis] + 0.1)
            }));
            let beyond = (0..3)
                .map(|axis| (bounds.min[axis] - point[axis]).max(point[axis] - bounds.max[axis]))
                .fold(0.0, f64::max);
            let (exact, closest) = (surface.signed_distance(&point), query.closest_point(&point));
            let found = field.near(Scalar, each_of!([0, 1, 2], axis => [point[axis] as f32; 16]));
            let error = (f64::from(found.distance[0]) - exact).abs();
            if beyond > MARGIN {
                assert!(error < 0.1 * exact, "{error} m of {exact} m");
                continue;
            }
            all.push(error);
            if exact.abs() < 0.005 {
                near.push(error);
            }
            if exact > 1e-4 {
                let outward = Vector3::from(found.outward.map(|part| f64::from(part[0])));
                angles.push(outward.angle(&(point - closest)).to_degrees());
            }
        }
        let at = |list: &mut Vec<f64>, share: f64| {
            list.sort_by(f64::total_cmp);
            list[((list.len() - 1) as f64 * share) as usize]
        };
        let cell = f64::from(field.cell);
        println!(
            "cell {:.2} mm; error median, 99 %, worst: near {:.3} {:.2} {:.2} mm, all {:.3} {:.2} {:.2} mm; direction {:.1} deg median, {:.0} at 95 %",
            1e3 * cell,
            1e3 * at(&mut near, 0.5),
            1e3 * at(&mut near, 0.99),
            1e3 * at(&mut near, 1.0),
            1e3 * at(&mut all, 0.5),
            1e3 * at(&mut all, 0.99),
            1e3 * at(&mut all, 1.0),
            at(&mut angles, 0.5),
            at(&mut angles, 0.95),
        );
        assert!(at(&mut near, 0.5) < 0.03 * cell && at(&mut near, 0.99) < 0.4 * cell && at(&mut near, 1.0) < cell);
        assert!(at(&mut all, 0.99) < 0.4 * cell && at(&mut angles, 0.5) < 4.0);
    }
}
