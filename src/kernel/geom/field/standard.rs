//! Signed distance to the cells of the other label, exact in the metric of poses.
//!
//! The squared distance to a union of boxes on a grid is separable: per axis, the square of the gap between a centre and
//! a cell. Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions" (2012), take the lower envelope;
//! axes of 2 to 48 cells are faster by trying every cell.

use super::{Axis, AxisGrid, FieldMetric};
use crate::geom::{SimdLevel, simd_kernel};

/// Metres equivalent to one radian: 45 deg correspond to 0.1 m.
pub const METRES_PER_RADIAN: f64 = 0.127;

/// Lines that are worked side by side: enough for every SIMD width, few enough for registers.
const LANES: usize = 16;

/// Signed distance [m] from the centre of each cell to the union of the closed boxes of the cells of the other label.
///
/// `inside` and the result have one value per cell, in the order of the grid; the result is negative inside. A cell's box
/// reaches half a step to each side of its centre. Lengths are metres on x, y, z and `rho` [m/rad] times radians on roll,
/// pitch, yaw, the shorter direction on periodic axes. `rho` is mostly [`METRES_PER_RADIAN`]. Where no cell has the
/// other label the distance is infinite: +inf everywhere when nothing is inside, -inf when everything is.
///
/// Squares are summed in `f64` and each root is rounded to `f32` once, so the result is within one rounding of the exact
/// distance; sums run in one order and a minimum has no rounding, so the bits are the same on every machine.
///
/// # Panics
/// When `inside` has not one value per cell or `rho` is not finite and above zero.
pub fn signed_distance_standard(inside: &[bool], grid: &AxisGrid, rho: f64) -> Vec<f32> {
    assert_eq!(inside.len(), grid.cells(), "one label per cell");
    assert!(rho.is_finite() && rho > 0.0, "rho = {rho} m/rad must be finite and above zero");
    let mut result = vec![0.0_f32; grid.cells()];
    let mut squares = vec![0.0_f64; grid.cells()];
    let transform = Transform::new(grid, rho);
    // To the outside cells for the cells inside, then the reverse.
    for (label, sign) in [(true, -1.0), (false, 1.0)] {
        for (square, cell) in squares.iter_mut().zip(inside) {
            *square = if *cell == label { f64::INFINITY } else { 0.0 };
        }
        transform.run(&mut squares);
        for ((value, square), cell) in result.iter_mut().zip(&squares).zip(inside) {
            // For every cell, so that the roots are taken side by side.
            let distance = (sign * square.sqrt()) as f32;
            *value = if *cell == label { distance } else { *value };
        }
    }
    result
}

/// Square of the gap between the centre of a cell and the box of the cell at each distance in cells [m^2].
fn squared_gaps(axis: &Axis, rho: f64) -> Vec<f64> {
    let step = FieldMetric::Metres { rho }.scale(axis.unit, axis.step) * axis.step;
    (0..axis.count)
        .map(|apart| {
            let steps = axis.steps_between(0, apart);
            if steps == 0 { 0.0 } else { ((steps as f64 - 0.5) * step).powi(2) }
        })
        .collect()
}

/// Data that every pass over a grid needs.
pub(super) struct Transform {
    counts: [usize; 6],
    strides: [usize; 6],
    gaps: [Vec<f64>; 6],
    simd: SimdLevel,
}

impl Transform {
    fn new(grid: &AxisGrid, rho: f64) -> Self {
        let gaps = grid.axes().each_ref().map(|axis| squared_gaps(axis, rho));
        Self { counts: grid.shape(), strides: grid.strides(), gaps, simd: SimdLevel::detect() }
    }

    /// Along positions only, each with `orientations` orientations side by side.
    pub(super) fn of_positions(axes: &[Axis; 3], orientations: usize) -> Self {
        let [nx, ny, nz] = axes.each_ref().map(|axis| axis.count);
        let [x, y, z] = axes.each_ref().map(|axis| squared_gaps(axis, 1.0));
        Self {
            counts: [nx, ny, nz, 1, 1, orientations],
            strides: [ny * nz * orientations, nz * orientations, orientations, orientations, orientations, 1],
            gaps: [x, y, z, Vec::new(), Vec::new(), Vec::new()],
            simd: SimdLevel::detect(),
        }
    }

    /// Transforms along z, y and x, in place.
    pub(super) fn run_positions(&self, squares: &mut [f64]) {
        let tiles = &mut self.tiles();
        for slab in squares.chunks_exact_mut(self.strides[0]) {
            for block in slab.chunks_exact_mut(self.strides[1]) {
                self.along(block, 2, tiles);
            }
            self.along(slab, 1, tiles);
        }
        self.along(squares, 0, tiles);
    }

    fn tiles(&self) -> Vec<[f64; LANES]> {
        vec![[0.0; LANES]; 2 * self.gaps.iter().map(Vec::len).fold(1, usize::max)]
    }

    /// Transforms along every axis, in place: yaw, pitch, roll and z while the cells of one x and y are in the processor's
    /// cache, then y, then x.
    fn run(&self, squares: &mut [f64]) {
        let tiles = &mut self.tiles();
        for slab in squares.chunks_exact_mut(self.strides[0]) {
            for block in slab.chunks_exact_mut(self.strides[1]) {
                // Lines of one value are their own transform.
                if block.iter().any(|square| *square != block[0]) {
                    (2..6).rev().for_each(|axis| self.along(block, axis, tiles));
                }
            }
            self.along(slab, 1, tiles);
        }
        self.along(squares, 0, tiles);
    }

    /// `out[i] = min over j of in[j] + gap(i, j)^2` along every line of one axis, in place.
    fn along(&self, squares: &mut [f64], axis: usize, tiles: &mut [[f64; LANES]]) {
        let (count, stride) = (self.counts[axis], self.strides[axis]);
        if count == 1 {
            return;
        }
        let lines = squares.len() / count;
        // Scratch for sixteen lines: values as gathered, and their minima.
        let (tile, min) = tiles.split_at_mut(tiles.len() / 2);
        let (tile, min) = (&mut tile[..count], &mut min[..count]);
        for first in (0..lines).step_by(LANES) {
            let used = LANES.min(lines - first);
            // Where lane `l` of the tile starts; neighbouring lanes are neighbours in memory when the stride allows.
            let start = |line: usize| line / stride * stride * count + line % stride;
            let starts: [usize; LANES] = std::array::from_fn(|lane| start(first + lane.min(used - 1)));
            let contiguous = starts[LANES - 1] == starts[0] + LANES - 1;
            // Gather: cell j of sixteen lines side by side, the last line repeated where fewer are left.
            for (j, row) in tile.iter_mut().enumerate() {
                if contiguous {
                    row.copy_from_slice(&squares[starts[0] + j * stride..][..LANES]);
                } else {
                    *row = starts.map(|start| squares[start + j * stride]);
                }
            }
            // A line of one value is its own transform.
            if tile.iter().flatten().all(|square| *square == tile[0][0]) {
                continue;
            }
            // Min-plus transform of the lines by trying every pair of cells.
            min_sums(self.simd, tile, &self.gaps[axis], min);
            // Scatter the minima back.
            for (i, min) in min.iter().enumerate() {
                if contiguous {
                    squares[starts[0] + i * stride..][..LANES].copy_from_slice(min);
                } else {
                    for (start, min) in starts.iter().zip(min) {
                        squares[start + i * stride] = *min;
                    }
                }
            }
        }
    }
}

simd_kernel! {
    /// `min[i] = min over j of tile[j] + gaps[|i - j|]`, lane by lane.
    fn min_sums(tile: &[[f64; LANES]], gaps: &[f64], min: &mut [[f64; LANES]]) = min_sums_body;
}

#[inline(always)]
fn min_sums_body<L>(_: L, tile: &[[f64; LANES]], gaps: &[f64], min: &mut [[f64; LANES]]) {
    for (i, out) in min.iter_mut().enumerate() {
        let mut min = tile[i];
        for (j, row) in tile.iter().enumerate() {
            // The cell itself has no gap: its sum is what `min` started with.
            let gap = gaps[i.abs_diff(j)];
            for lane in 0..LANES {
                let sum = row[lane] + gap;
                // Not `f64::min`, whose care for NaN costs more than the sum.
                min[lane] = if sum < min[lane] { sum } else { min[lane] };
            }
        }
        *out = min;
    }
}

#[cfg(test)]
mod tests {
    use super::{super::fixtures::*, *};

    /// The distance by its definition: over all boxes of the other label.
    fn by_definition(inside: &[bool], grid: &AxisGrid, rho: f64) -> Vec<f64> {
        let cells: Vec<[usize; 6]> = (0..grid.cells()).map(|cell| grid.coordinates(cell)).collect();
        let gap = |k: usize, a: usize, b: usize| {
            let axis = &grid.axes()[k];
            let scale = if k < 3 { 1.0 } else { rho };
            let mut apart = (axis.centre(a) - axis.centre(b)).abs();
            if axis.periodic {
                apart = apart.min(axis.count as f64 * axis.step - apart);
            }
            (scale * (apart - axis.step / 2.0)).max(0.0)
        };
        let squares: [Vec<f64>; 6] = std::array::from_fn(|k| {
            let count = grid.axes()[k].count;
            (0..count * count).map(|pair| gap(k, pair / count, pair % count).powi(2)).collect()
        });
        let shape = grid.shape();
        (0..grid.cells())
            .map(|cell| {
                let others = (0..grid.cells()).filter(|other| inside[*other] != inside[cell]);
                let min = others
                    .map(|other| (0..6).map(|k| squares[k][cells[cell][k] * shape[k] + cells[other][k]]).sum::<f64>())
                    .fold(f64::INFINITY, f64::min);
                if inside[cell] { -min.sqrt() } else { min.sqrt() }
            })
            .collect()
    }

    fn label_sets(grid: &AxisGrid) -> Vec<Vec<bool>> {
        let mut one = vec![false; grid.cells()];
        one[grid.cells() / 3] = true;
        let all_but_one = one.iter().map(|label| !label).collect();
        vec![
            one,
            all_but_one,
            random_labels(grid, 0.003, 1),
            random_labels(grid, 0.5, 2),
            random_labels(grid, 0.999, 3),
            blob_labels(grid, 3, 2.5, 4),
            blob_labels(grid, 1, 4.0, 5),
        ]
    }

    #[test]
    fn distances_are_those_of_the_definition() {
        for grid in grids() {
            for rho in [METRES_PER_RADIAN, 1.0] {
                for (set, labels) in label_sets(&grid).iter().enumerate() {
                    let field = signed_distance_standard(labels, &grid, rho);
                    for (value, exact) in field.iter().zip(by_definition(labels, &grid, rho)) {
                        let error = (f64::from(*value) - exact).abs();
                        assert!(error <= 6.0e-8 * exact.abs(), "{:?} set {set}: {value} {exact}", grid.shape());
                    }
                }
            }
        }
    }

    #[test]
    fn next_to_the_boundary_it_is_half_a_step_and_the_sign_is_the_label() {
        let grid = fetch_grid();
        let mut labels = vec![false; grid.cells()];
        let at = grid.index([5, 11, 10, 1, 0, 7]);
        labels[at] = true;
        let field = signed_distance_standard(&labels, &grid, METRES_PER_RADIAN);
        assert_eq!(field[at], -((0.127 * std::f64::consts::FRAC_PI_8) as f32), "the nearest way out is an angle");
        assert_eq!(field[grid.index([6, 11, 10, 1, 0, 7])], 0.05);
        assert_eq!(field[grid.index([5, 8, 10, 1, 0, 7])], 0.25);
        let eighth = (0.127 * std::f64::consts::FRAC_PI_8) as f32;
        assert_eq!(field[grid.index([5, 11, 10, 1, 0, 0])], eighth, "yaw wraps");
        assert_eq!(field[grid.index([5, 11, 10, 1, 7, 7])], eighth, "pitch wraps");
        assert!(field.iter().zip(&labels).all(|(value, label)| (*value < 0.0) == *label));
    }

    #[test]
    fn without_the_other_label_it_is_infinite() {
        let grid = small_grid();
        let field = |label| signed_distance_standard(&vec![label; grid.cells()], &grid, METRES_PER_RADIAN);
        assert!(field(false).iter().all(|value| *value == f32::INFINITY));
        assert!(field(true).iter().all(|value| *value == f32::NEG_INFINITY));
    }

    /// The other cell of a pose: (r + pi, pi - p, y + pi) on the thesis's grid.
    fn twin([x, y, z, roll, pitch, yaw]: [usize; 6]) -> [usize; 6] {
        // Pitch -pi + 45 deg * i: its mirror image about pi / 2.
        [x, y, z, (roll + 1) % 2, (12 - pitch) % 8, (yaw + 4) % 8]
    }

    #[test]
    fn both_cells_of_a_pose_have_one_value() {
        let grid = fetch_grid();
        let mut labels = blob_labels(&grid, 4, 4.0, 6);
        for cell in 0..grid.cells() {
            let other = grid.index(twin(grid.coordinates(cell)));
            let rotation = |cell| {
                let [_, _, _, roll, pitch, yaw] = grid.pose(cell);
                crate::geom::rotation_from_rpy(roll, pitch, yaw)
            };
            if cell < 128 {
                assert!(rotation(cell).angle_to(&rotation(other)) < 1e-7, "{:?}", grid.coordinates(cell));
            }
            let either = labels[cell] || labels[other];
            (labels[cell], labels[other]) = (either, either);
        }
        let field = signed_distance_standard(&labels, &grid, METRES_PER_RADIAN);
        for cell in 0..grid.cells() {
            assert_eq!(field[cell], field[grid.index(twin(grid.coordinates(cell)))]);
        }
    }

    #[test]
    #[should_panic(expected = "one label per cell")]
    fn a_missing_label_is_refused() {
        let grid = small_grid();
        signed_distance_standard(&vec![false; grid.cells() - 1], &grid, 0.127);
    }

    #[test]
    fn a_rho_that_is_no_length_is_refused() {
        let grid = small_grid();
        for rho in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let labels = vec![false; grid.cells()];
            let refused = std::panic::catch_unwind(|| signed_distance_standard(&labels, &grid, rho));
            assert!(refused.is_err(), "rho = {rho}");
        }
    }
}
