//! Share of the solid that lies inside a view's grid.

use nalgebra::Point3;

use super::placement::grid_coordinates;
use crate::geom::{Affine, CameraCv, GridPlacement, Lanes, Object, Pose, SimdLevel, SolidGrid, each_of, simd_kernel};

const BLOCK: usize = 8;

/// Solid cells by blocks of 8 x 8 x 8, those that are not empty; each list filled up to a multiple of 16 with empty ones.
pub(super) struct Blocks {
    /// First cell along each axis.
    first: [Vec<f32>; 3],
    /// Number of solid cells.
    counts: Vec<f32>,
    total: u64,
    /// Box of the blocks [fine cells].
    low: [f32; 3],
    high: [f32; 3],
}

/// From fine cells to grid coordinates.
struct ToGrid {
    rows: [[f32; 4]; 3],
    resolution: f32,
}

impl Blocks {
    pub(super) fn new(solid: &SolidGrid) -> Self {
        const BLOCKS: usize = SolidGrid::SIDE / BLOCK;
        // Solid cells per block: each byte of a word is one block's run along z.
        let mut counts = vec![0_u16; BLOCKS.pow(3)];
        for (index, word) in solid.words.iter().enumerate() {
            if *word != 0 {
                // Word index to column (x, y) and quarter of the column.
                let (x, y, part) = (index / 1024, index / 4 % 256, index % 4);
                let line = &mut counts[((x / BLOCK) * BLOCKS + y / BLOCK) * BLOCKS + part * 8..][..8];
                for (count, byte) in line.iter_mut().zip(word.to_le_bytes()) {
                    *count += byte.count_ones() as u16;
                }
            }
        }
        let mut blocks = Self {
            first: Default::default(),
            counts: Vec::new(),
            total: 0,
            low: [f32::INFINITY; 3],
            high: [f32::NEG_INFINITY; 3],
        };
        // Non-empty blocks, their box and total.
        for (index, count) in counts.into_iter().enumerate().filter(|(_, count)| *count > 0) {
            let first = [index / BLOCKS / BLOCKS, index / BLOCKS % BLOCKS, index % BLOCKS];
            for axis in 0..3 {
                let first = (first[axis] * BLOCK) as f32;
                blocks.first[axis].push(first);
                blocks.low[axis] = blocks.low[axis].min(first);
                blocks.high[axis] = blocks.high[axis].max(first + BLOCK as f32);
            }
            blocks.counts.push(f32::from(count));
            blocks.total += u64::from(count);
        }
        // Fill up to whole vectors with empty blocks.
        let padded = blocks.counts.len().next_multiple_of(16);
        blocks.counts.resize(padded, 0.0);
        blocks.first.iter_mut().for_each(|first| first.resize(padded, 0.0));
        blocks
    }

    /// Share of the solid cells whose centre lies in the grid, in single precision; 1 for an object without solid cells.
    pub(super) fn share(
        &self,
        level: SimdLevel,
        solid: &SolidGrid,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
    ) -> f64 {
        if self.total == 0 {
            return 1.0;
        }
        let base = grid_coordinates(placement, &camera_from_object.point(&Point3::from(solid.origin.coords)));
        let (rotation, scale) = (camera_from_object.rotation().matrix(), solid.pitch / placement.cell_size);
        let rows: [[f32; 4]; 3] = std::array::from_fn(|row| {
            let [a, b, c] = [0, 1, 2].map(|axis| (rotation[(row, axis)] * scale) as f32);
            [a, b, c, base[row] as f32]
        });
        let to_grid = ToGrid { rows, resolution: placement.resolution as f32 };
        if self.box_is_inside(&to_grid) {
            return 1.0;
        }
        let mut inside = 0;
        count_inside(level, self, &solid.words, &to_grid, &mut inside);
        inside as f64 / self.total as f64
    }

    fn box_is_inside(&self, to_grid: &ToGrid) -> bool {
        to_grid.rows.iter().all(|row| {
            let reach = |pick: fn(f32, f32) -> f32| {
                (0..3).map(|axis| pick(row[axis] * self.low[axis], row[axis] * self.high[axis])).sum::<f32>() + row[3]
            };
            reach(f32::min) >= 0.0 && reach(f32::max) < to_grid.resolution
        })
    }
}

simd_kernel! {
    /// Counts the solid cells whose centre lies in the grid: whole blocks where they are decided, else cell by cell.
    fn count_inside(blocks: &Blocks, words: &[u64], to_grid: &ToGrid, inside: &mut u64) = count_inside_body;
}

#[inline(always)]
fn count_inside_body<L: Lanes>(l: L, blocks: &Blocks, words: &[u64], to_grid: &ToGrid, inside: &mut u64) {
    let half = BLOCK as f32 / 2.0;
    let [to_x, to_y, to_z] = each_of!([0, 1, 2], row => Affine::new(l, to_grid.rows[row]));
    // Half extent of a rotated block along each grid axis: the sum of absolute coefficients.
    let [reach_x, reach_y, reach_z] = each_of!([0, 1, 2], row => {
        let [a, b, c, _] = to_grid.rows[row];
        l.splat((a.abs() + b.abs() + c.abs()) * half)
    });
    let (zero, n) = (l.splat(0.0), l.splat(to_grid.resolution));
    let mut whole = zero;
    let [x, y, z] = blocks.first.each_ref().map(|first| first.as_chunks::<16>().0);
    for (((x, y), z), counts) in x.iter().zip(y).zip(z).zip(blocks.counts.as_chunks::<16>().0) {
        let [mx, my, mz] = each_of!([x, y, z], first => l.add(l.load(first), l.splat(half)));
        // Block's interval along each axis: entirely inside, or entirely outside on one axis.
        let [[in_x, out_x], [in_y, out_y], [in_z, out_z]] = each_of!(
            [(&to_x, reach_x), (&to_y, reach_y), (&to_z, reach_z)],
            (row, reach) => {
                let middle = row.at(l, mx, my, mz);
                let (low, high) = (l.sub(middle, reach), l.add(middle, reach));
                [l.both(l.ge(low, zero), l.lt(high, n)), l.either(l.lt(high, zero), l.ge(low, n))]
            }
        );
        let within = l.both(l.both(in_x, in_y), in_z);
        let counts = l.load(counts);
        // Whole numbers below 2^24: exact.
        whole = l.add(whole, l.select(within, counts, zero));
        let decided = l.either(within, l.either(l.either(out_x, out_y), out_z));
        // The fillers at the end lie on the grid's first block: they must not count it again.
        let mut cut = l.bits(l.both(l.lt(zero, counts), l.not(decided)));
        while cut != 0 {
            let block = cut.trailing_zeros() as usize;
            *inside += count_cells(l, [x[block], y[block], z[block]], [&to_x, &to_y, &to_z], n, words);
            cut &= cut - 1;
        }
    }
    // Sum of the lanes' whole blocks.
    let mut lanes = [0.0; 16];
    l.store(whole, &mut lanes);
    *inside += lanes.iter().map(|count| *count as u64).sum::<u64>();
}

/// Solid cells of one block whose centre lies in the grid, two rows along z at a time.
#[inline(always)]
fn count_cells<L: Lanes>(l: L, first: [f32; 3], rows: [&Affine<L>; 3], n: L::F, words: &[u64]) -> u64 {
    let corner = first.map(|first| first as usize);
    let lane = l.load_i(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    let z = l.add(l.to_float(l.and_i(lane, l.splat_i(7))), l.splat(first[2] + 0.5));
    let second = l.to_float(l.shr_i::<3>(lane));
    let (zero, mut inside) = (l.splat(0.0), 0);
    for x in 0..BLOCK {
        let at_x = l.splat(first[0] + x as f32 + 0.5);
        for y in (0..BLOCK).step_by(2) {
            let byte = |y: usize| {
                words[((corner[0] + x) * 256 + corner[1] + y) * 4 + corner[2] / 64] >> (corner[2] % 64) & 0xff
            };
            let solid = (byte(y) | byte(y + 1) << 8) as u32;
            if solid == 0 {
                continue;
            }
            let at_y = l.add(second, l.splat(first[1] + y as f32 + 0.5));
            let [in_x, in_y, in_z] = each_of!([0, 1, 2], row => {
                let value = rows[row].at(l, at_x, at_y, z);
                l.both(l.ge(value, zero), l.lt(value, n))
            });
            inside += u64::from((l.bits(l.both(l.both(in_x, in_y), in_z)) & solid).count_ones());
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    /// A ball around the middle and the whole of the lattice's first block, which fillers of a list lie on.
    fn ball_and_corner() -> SolidGrid {
        let mut solid = SolidGrid::new(Point3::new(-0.1, -0.1, -0.1), 0.2);
        for x in 0..SolidGrid::SIDE {
            for y in 0..SolidGrid::SIDE {
                for z in 0..SolidGrid::SIDE {
                    let square: f64 = [x, y, z].iter().map(|index| (*index as f64 - 127.5).powi(2)).sum();
                    if square < 70.0 * 70.0 || x.max(y).max(z) < BLOCK {
                        solid.words[(x * SolidGrid::SIDE + y) * 4 + z / 64] |= 1 << (z % 64);
                    }
                }
            }
        }
        solid
    }

    /// The definition, cell by cell in double precision: (inside, cells whose centre is within `doubt` of a face, all).
    fn by_cells(
        solid: &SolidGrid,
        pose: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        doubt: f64,
    ) -> (u64, u64, u64) {
        let n = f64::from(placement.resolution);
        let (mut inside, mut doubtful, mut total) = (0, 0, 0);
        for (index, word) in solid.words.iter().enumerate() {
            for bit in (0..64).filter(|bit| word >> bit & 1 != 0) {
                let cell = [index / 1024, index / 4 % 256, index % 4 * 64 + bit].map(|index| index as f64 + 0.5);
                let point = solid.origin + Vector3::from(cell) * solid.pitch;
                let at = grid_coordinates(placement, &pose.point(&point));
                total += 1;
                inside += u64::from(at.iter().all(|value| (0.0..n).contains(value)));
                doubtful += u64::from(at.iter().any(|value| value.abs().min((value - n).abs()) < doubt));
            }
        }
        (inside, doubtful, total)
    }

    #[test]
    fn the_share_is_that_of_counting_cells() {
        let solid = ball_and_corner();
        let blocks = Blocks::new(&solid);
        for (angle, cell_size, shift) in
            [(0.0, 0.0054, 0.0), (0.7, 0.003, 0.02), (2.0, 0.002, -0.03), (1.1, 0.001, 0.0)]
        {
            let rotation = Rotation3::from_euler_angles(angle, 0.4 * angle, -angle);
            let pose = Pose::new(rotation, Vector3::new(0.0, 0.0, 1.0));
            let placement = GridPlacement { resolution: 40, centre: Point3::new(shift, 0.0, 1.0), cell_size };
            let (inside, doubtful, total) = by_cells(&solid, &pose, &placement, 1e-4);
            let shares: Vec<f64> =
                SimdLevel::available().map(|level| blocks.share(level, &solid, &pose, &placement)).collect();
            assert!(shares.windows(2).all(|pair| pair[0].to_bits() == pair[1].to_bits()), "{shares:?}");
            let error = (shares[0] * total as f64 - inside as f64).abs();
            assert!(error <= doubtful as f64 + 1e-6, "{error} cells off, {doubtful} in doubt, of {total}");
            assert!(shares[0] <= 1.0);
        }
    }
}
