//! Volumes of voxels that are finer than a grid: steps 1 to 4 of the thesis's algorithm 2 (chapter 5.3).
//!
//! Two formulas of the printed text are corrected, as in its author's program. Printed, a new voxel weighs its neighbours by
//! their distance, which would empty an occupied cell among empty ones: nearer ones count more here. Printed, the smooth field
//! is bound by v f >= 0, whose smoothest member is f = 0, no surface at all: see `smooth.rs` for the margin.

use kernel::geom::{GridPlacement, OccupancyGrid};

/// Share of the observed cloud's density that the completed cloud should have.
const DENSITY_SHARE: f64 = 3.0 / 8.0;
/// Largest factor of upsampling: memory and time grow with its cube.
const MAX_FACTOR: usize = 4;
/// Stride of the points that are compared with the others.
const SAMPLE_STEP: usize = 10;

/// Voxels, each occupied or empty: shape (side, side, side) indexed (x, y, z), C order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Volume {
    side: usize,
    voxels: Vec<bool>,
}

impl Volume {
    /// From voxels in C order; `None` when their count does not fit the side.
    pub fn from_voxels(side: usize, voxels: Vec<bool>) -> Option<Self> {
        (voxels.len() == side.pow(3)).then_some(Self { side, voxels })
    }

    /// A grid with `factor` voxels per cell along each axis. A voxel is occupied where cells of weight +1 (occupied) and -1
    /// (empty, and everything outside of the grid), interpolated at its centre between the centres of cells, sum to more
    /// than 0.
    ///
    /// # Panics
    /// If the factor is 0.
    pub fn upsampled(grid: &OccupancyGrid, factor: usize) -> Self {
        assert!(factor > 0, "at least one voxel per cell");
        let n = grid.resolution() as usize;
        let mut weights = vec![-1_i32; n.pow(3)];
        for [x, y, z] in grid.cells() {
            weights[(x as usize * n + y as usize) * n + z as usize] = 1;
        }
        // One axis after the other, in whole numbers of 1 / (2 factor): no rounding decides a tie.
        let mut shape = [n; 3];
        for axis in [2, 1, 0] {
            weights = refined(&weights, shape, axis, factor);
            shape[axis] *= factor;
        }
        Self { side: n * factor, voxels: weights.iter().map(|weight| *weight > 0).collect() }
    }

    /// Voxels along each axis.
    pub fn side(&self) -> usize {
        self.side
    }

    /// The voxels in C order.
    pub fn voxels(&self) -> &[bool] {
        &self.voxels
    }

    /// Occupies each voxel that holds an observed point; points are in `CameraCv` [m], and those outside are left out.
    pub fn add_points(&mut self, points: &[[f32; 3]], placement: &GridPlacement) {
        let factor = self.side as f64 / f64::from(placement.resolution);
        for point in points {
            let cell = placement.coordinates_of(point.map(f64::from)).map(|value| (value * factor).floor());
            if cell.iter().all(|value| (0.0..self.side as f64).contains(value)) {
                let [x, y, z] = cell.map(|value| value as usize);
                self.voxels[(x * self.side + y) * self.side + z] = true;
            }
        }
    }

    /// Fills, behind the first occupied run of each stack along z, the first gap when it is at most `longest` voxels.
    pub fn fill_gaps(&mut self, longest: usize) {
        for stack in self.voxels.chunks_exact_mut(self.side) {
            let Some(first) = stack.iter().position(|occupied| *occupied) else { continue };
            let Some(gap) = stack[first..].iter().position(|occupied| !occupied) else { continue };
            let gap = first + gap;
            let Some(length) = stack[gap..].iter().position(|occupied| *occupied) else { continue };
            if length <= longest {
                stack[gap..gap + length].fill(true);
            }
        }
    }
}

/// Weights at `factor` times as many points along one axis, times 2 `factor`; outside of the grid the weight is -1.
fn refined(weights: &[i32], shape: [usize; 3], axis: usize, factor: usize) -> Vec<i32> {
    let stride: usize = shape[axis + 1..].iter().product();
    let count = shape[axis];
    // Earlier axes have scaled the weight of the outside.
    let outside = -(2 * factor as i32).pow(2 - axis as u32);
    let mut finer = Vec::with_capacity(weights.len() * factor);
    for block in weights.chunks_exact(stride * count) {
        let at = |cell: Option<usize>, offset: usize| {
            cell.filter(|cell| *cell < count).map_or(outside, |cell| block[cell * stride + offset])
        };
        for cell in 0..count {
            for part in 0..factor {
                // The voxel's centre from the cell's, in units of 1 / (2 factor) cells.
                let shift = (2 * part + 1) as i32 - factor as i32;
                let neighbour = if shift < 0 { cell.checked_sub(1) } else { Some(cell + 1) };
                let (near, far) = (2 * factor as i32 - shift.abs(), shift.abs());
                finer.extend((0..stride).map(|offset| near * at(Some(cell), offset) + far * at(neighbour, offset)));
            }
        }
    }
    finer
}

/// Voxels per cell along each axis that algorithm 2 requires: 1 if the completed cells, one per `cell_size`, are denser
/// than 3/8 of the observed points, otherwise as many as make them so, at most 4.
///
/// Points are in `CameraCv` [m]. Density is one over the mean distance from every tenth point to the nearest of the others.
/// Points outside the grid are ignored; with fewer than ten points, the result is 1.
pub fn upsampling_factor(points: &[[f32; 3]], placement: &GridPlacement) -> usize {
    let Some(spacing) = mean_spacing(points, placement) else { return 1 };
    // Both in cells: the completed cloud's density is 1.
    let wanted = DENSITY_SHARE / spacing;
    if wanted < 1.0 { 1 } else { (wanted.ceil() as usize).clamp(1, MAX_FACTOR) }
}

/// Mean distance [cells] from every tenth point to the nearest of the others.
fn mean_spacing(points: &[[f32; 3]], placement: &GridPlacement) -> Option<f64> {
    let n = placement.resolution as usize;
    let inside = points.iter().map(|point| placement.coordinates_of(point.map(f64::from)));
    let inside: Vec<[f64; 3]> =
        inside.filter(|point| point.iter().all(|value| (0.0..n as f64).contains(value))).collect();
    let is_sample = |index: usize| index.is_multiple_of(SAMPLE_STEP);
    if inside.len() < SAMPLE_STEP {
        return None;
    }
    let bin_of = |point: &[f64; 3]| {
        let [x, y, z] = point.map(|value| value as usize);
        (x * n + y) * n + z
    };
    let mut others: Vec<(usize, [f64; 3])> = inside
        .iter()
        .enumerate()
        .filter(|(index, _)| !is_sample(*index))
        .map(|(_, point)| (bin_of(point), *point))
        .collect();
    others.sort_by_key(|(bin, _)| *bin);
    let starts: Vec<usize> = (0..=n.pow(3)).map(|bin| others.partition_point(|(other, _)| *other < bin)).collect();
    let samples: Vec<&[f64; 3]> = inside.iter().step_by(SAMPLE_STEP).collect();
    let mut sum = 0.0;
    for point in &samples {
        sum += nearest(point, n, |bin| &others[starts[bin]..starts[bin + 1]]).sqrt();
    }
    Some(sum / samples.len() as f64)
}

/// Squared distance [cells^2] to the nearest point, in growing shells of cells.
fn nearest<'a>(point: &[f64; 3], n: usize, bin: impl Fn(usize) -> &'a [(usize, [f64; 3])]) -> f64 {
    let cell = point.map(|value| value as i64);
    let mut best = f64::INFINITY;
    for reach in 0..n as i64 {
        let span = |axis: usize| (cell[axis] - reach).max(0)..=(cell[axis] + reach).min(n as i64 - 1);
        for (x, y) in span(0).flat_map(|x| span(1).map(move |y| (x, y))) {
            let on_side = (x - cell[0]).abs() == reach || (y - cell[1]).abs() == reach;
            for z in span(2).filter(|z| on_side || (z - cell[2]).abs() == reach) {
                for (_, other) in bin(((x * n as i64 + y) * n as i64 + z) as usize) {
                    best = best.min((0..3).map(|axis| (other[axis] - point[axis]).powi(2)).sum());
                }
            }
        }
        // Everything within `reach` cells has been seen.
        if best <= (reach * reach) as f64 {
            break;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placement() -> GridPlacement {
        GridPlacement { resolution: 40, centre: [0.1, -0.2, 0.7].into(), cell_size: 0.004 }
    }

    #[test]
    fn upsampling_keeps_cells_and_rounds_corners() {
        let mut grid = OccupancyGrid::new(6);
        [[2, 2, 2], [2, 2, 3], [2, 3, 2], [5, 5, 5]].iter().for_each(|cell| grid.set(*cell));
        let same = Volume::upsampled(&grid, 1);
        let cells: Vec<bool> = (0..216).map(|at| grid.get([at / 36, at / 6 % 6, at % 6])).collect();
        assert_eq!(same.voxels(), cells);
        for factor in 2..=4 {
            let volume = Volume::upsampled(&grid, factor);
            let at = |x: f64, y: f64, z: f64| {
                let [x, y, z] = [x, y, z].map(|value| (value * factor as f64) as usize);
                volume.voxels()[(x * volume.side() + y) * volume.side() + z]
            };
            // The middle of an occupied cell stays, even of one at the grid's corner; its own corner goes.
            assert!(factor % 2 == 0 || at(5.5, 5.5, 5.5), "{factor}");
            assert!(!at(5.01, 5.01, 5.01) && !at(5.99, 5.99, 5.99), "{factor}");
            // Against the definition, with the eight nearest cells by hand.
            let weight = |x: i64, y: i64, z: i64| {
                let is_in = [x, y, z].iter().all(|value| (0..6).contains(value));
                if is_in && grid.get([x as u32, y as u32, z as u32]) { 1.0 } else { -1.0 }
            };
            for index in 0..volume.side().pow(3) {
                let side = volume.side();
                let centre = [index / side / side, index / side % side, index % side]
                    .map(|value| (value as f64 + 0.5) / factor as f64 - 0.5);
                let base = centre.map(f64::floor);
                let mut sum = 0.0;
                for corner in 0..8 {
                    let offset: [f64; 3] = std::array::from_fn(|axis| f64::from(corner >> axis & 1));
                    let share: f64 =
                        (0..3).map(|axis| 1.0 - (centre[axis] - base[axis] - offset[axis]).abs()).product();
                    let cell: [i64; 3] = std::array::from_fn(|axis| (base[axis] + offset[axis]) as i64);
                    sum += share * weight(cell[0], cell[1], cell[2]);
                }
                assert!(sum.abs() < 1e-9 || volume.voxels()[index] == (sum > 0.0), "{factor} {index} {sum}");
                assert!(sum.abs() >= 1e-9 || !volume.voxels()[index], "a tie is empty");
            }
        }
    }

    #[test]
    fn only_the_first_short_gap_is_filled() {
        let row = |text: &str| text.chars().map(|letter| letter == '#').collect::<Vec<_>>();
        for (before, longest, after) in [
            ("..#.#.#.", 1, "..###.#."),
            ("..#..##.", 1, "..#..##."),
            ("..#..##.", 2, "..#####."),
            ("#......#", 6, "########"),
            ("........", 3, "........"),
            ("..##....", 8, "..##...."),
        ] {
            let mut volume = Volume::from_voxels(8, row(before).repeat(64)).expect("8 voxels per side");
            volume.fill_gaps(longest);
            assert_eq!(volume.voxels(), row(after).repeat(64), "{before}");
        }
    }

    #[test]
    fn points_occupy_their_voxels_and_those_outside_are_left_out() {
        let placement = placement();
        let mut volume = Volume::upsampled(&OccupancyGrid::new(40), 2);
        let cell = placement.cell_size as f32;
        volume.add_points(
            &[[0.1 + 0.25 * cell, -0.2 - 0.25 * cell, 0.7 + 0.25 * cell], [9.0, 0.0, 0.0], [f32::NAN; 3]],
            &placement,
        );
        let occupied: Vec<usize> = (0..80_usize.pow(3)).filter(|index| volume.voxels()[*index]).collect();
        assert_eq!(occupied, [(40 * 80 + 39) * 80 + 36]);
    }

    #[test]
    fn the_factor_follows_the_density_of_the_points() {
        let placement = placement();
        // A sheet of points `spacing` cells apart: every nearest one is that far.
        let sheet = |spacing: f64| -> Vec<[f32; 3]> {
            let count = (30.0 / spacing) as usize;
            let along = move |index: usize| ((index as f64 + 0.5) * spacing - 15.0) * placement.cell_size;
            let points = (0..count).flat_map(|x| (0..count).map(move |y| [0.1 + along(x), -0.2 + along(y), 0.7]));
            points.map(|point| point.map(|value| value as f32)).collect()
        };
        for (spacing, factor) in [(0.5, 1), (0.38, 1), (0.3, 2), (0.2, 2), (0.15, 3), (0.1, 4), (0.05, 4)] {
            assert_eq!(upsampling_factor(&sheet(spacing), &placement), factor, "{spacing}");
        }
        assert_eq!(upsampling_factor(&[[0.1, -0.2, 0.7]; 9], &placement), 1, "too few");
        assert_eq!(upsampling_factor(&[[0.1, -0.2, 0.7]; 50], &placement), 4, "all at one point: as fine as allowed");
    }
}
