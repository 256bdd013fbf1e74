//! Values of a field over six axes between the centres of its cells.
#![expect(unsafe_code, reason = "64 loads whose bounds the grid promises")]

use super::{AxisGrid, FieldMetric};
use crate::geom::{SimdLevel, doubles::Doubles, lanes::each_of, simd_kernel};

/// Lookups between the centres of a grid's cells, prepared once for a grid and a metric.
#[derive(Clone, Debug)]
pub(super) struct AxisLookup {
    grid: AxisGrid,
    metric: FieldMetric,
    simd: SimdLevel,
    first: [f64; 6],
    inverse_step: [f64; 6],
    /// Largest coordinate [steps from the centre of cell 0]; coordinates on periodic axes reach the count itself, cell 0 again.
    limit: [f64; 6],
    /// Largest lower cell, below the count.
    top: [i32; 6],
    /// Where an axis begins in `offsets`.
    start: [usize; 6],
    /// Difference of the index from a lower cell to the one above it; on a periodic axis the first cell follows the
    /// last.
    offsets: Vec<[u32; 2]>,
}

impl AxisLookup {
    /// Prepares lookups in fields over this grid.
    pub(super) fn new(grid: &AxisGrid, metric: FieldMetric) -> Self {
        let (axes, strides) = (grid.axes(), grid.strides());
        let (mut start, mut offsets) = ([0; 6], Vec::new());
        for (k, axis) in axes.iter().enumerate() {
            start[k] = offsets.len();
            let above = |low: usize| if axis.periodic { (low + 1) % axis.count } else { (low + 1).min(axis.count - 1) };
            // Below `AxisGrid::MAX_CELLS`.
            offsets.extend((0..axis.count).map(|low| [low, above(low)].map(|cell| (cell * strides[k]) as u32)));
        }
        Self {
            // AVX-512 gains nothing on four lanes.
            simd: SimdLevel::Avx2.usable(),
            first: axes.map(|axis| axis.first),
            inverse_step: grid.inverse_steps(),
            limit: axes.map(|axis| (if axis.periodic { axis.count } else { axis.count - 1 }) as f64),
            top: axes.map(|axis| (if axis.periodic { axis.count - 1 } else { axis.count.saturating_sub(2) }) as i32),
            start,
            offsets,
            grid: grid.clone(),
            metric,
        }
    }

    /// With these vector instructions, or the machine's best where that is less; the bits are the same.
    #[must_use]
    pub(super) fn with_simd(self, level: SimdLevel) -> Self {
        Self { simd: level.usable(), ..self }
    }

    /// Value and gradient as in `FieldLookup::value_and_gradient`. At a centre, where the gradient jumps, it is that of
    /// the side above (below on the last centre).
    #[inline]
    pub(super) fn value_and_gradient(&self, field: &[f32], pose: &[f64; 6]) -> (f64, [f64; 6]) {
        assert_eq!(field.len(), self.grid.cells(), "one value a cell");
        if field[0].is_infinite() {
            return (f64::from(field[0]), [0.0; 6]);
        }
        let mut answer = (0.0, [0.0; 6]);
        look_up(self.simd, self, field, pose, &mut answer);
        answer
    }

    /// Coordinates brought into `0..=limit`: wrapped, or clamped. How far the clamped ones were beyond, in units of the field.
    #[cold]
    fn bring_inside(&self, coordinates: &mut [f64; 6]) -> [f64; 6] {
        let mut beyond = [0.0; 6];
        for (k, axis) in self.grid.axes().iter().enumerate() {
            let coordinate = axis.wrap(coordinates[k]);
            // NaN becomes a coordinate, too, and shows in `beyond`.
            coordinates[k] = if coordinate >= 0.0 { coordinate.min(self.limit[k]) } else { 0.0 };
            beyond[k] = (coordinate - coordinates[k]) * axis.step * self.metric.scale(axis.unit, axis.step);
        }
        beyond
    }

    #[cold]
    fn add_beyond(&self, beyond: &[f64; 6], (value, gradient): &mut (f64, [f64; 6])) {
        if *beyond != [0.0; 6] {
            let distance = beyond.iter().map(|part| part * part).sum::<f64>().sqrt();
            *value += distance;
            for (k, axis) in self.grid.axes().iter().enumerate() {
                if beyond[k] != 0.0 {
                    gradient[k] = beyond[k] / distance * self.metric.scale(axis.unit, axis.step);
                }
            }
        }
    }
}

simd_kernel! {
    /// Value and gradient of a field of one finite value per cell.
    fn look_up(lookup: &AxisLookup, field: &[f32], pose: &[f64; 6], answer: &mut (f64, [f64; 6])) = look_up_body;
}

#[inline(always)]
fn look_up_body<L: Doubles>(l: L, lookup: &AxisLookup, field: &[f32], pose: &[f64; 6], answer: &mut (f64, [f64; 6])) {
    let (mut coordinates, mut inside) = ([0.0; 6], true);
    for k in 0..6 {
        coordinates[k] = (pose[k] - lookup.first[k]) * lookup.inverse_step[k];
        inside &= (coordinates[k] >= 0.0) & (coordinates[k] <= lookup.limit[k]);
    }
    // Most poses are: what others need is kept off their path.
    let beyond = if inside { [0.0; 6] } else { lookup.bring_inside(&mut coordinates) };
    let (mut low, mut share) = ([0; 6], [0.0; 6]);
    for k in 0..6 {
        // SAFETY: coordinates are in 0..=limit, and counts fit.
        low[k] = unsafe { coordinates[k].to_int_unchecked::<i32>() }.min(lookup.top[k]);
        share[k] = coordinates[k] - f64::from(low[k]);
    }
    // One by one: an array of arrays would be built and read again in different widths, which processors do slowly.
    let offsets = each_of!([0, 1, 2, 3, 4, 5], k => {
        let [low, high] = lookup.offsets[lookup.start[k] + low[k] as usize];
        [low as usize, high as usize]
    });
    let [.., [yaw, above]] = offsets;
    // SAFETY: each axis moves the index by less than its count times its stride, so all sums are below the count of
    // cells, which is the length of the field.
    let (value, slopes) = unsafe {
        if above == yaw + 1 {
            multilinear::<L, true>(l, field, offsets, share)
        } else {
            multilinear::<L, false>(l, field, offsets, share)
        }
    };
    *answer = (value, each_of!([0, 1, 2, 3, 4, 5], k => slopes[k] * lookup.inverse_step[k]));
    if !inside {
        lookup.add_beyond(&beyond, answer);
    }
}

/// Value and slopes [per step] at `share` of the interval between two cells on each axis.
///
/// One axis after the other is folded: z, y, x, roll on four lanes (pitch low, pitch high; of each yaw low, yaw high),
/// then pitch, then yaw.
///
/// # Safety
/// The sums of one offset an axis are below the length of the field. With `NEXT` the upper yaw is the one after the lower.
#[inline(always)]
unsafe fn multilinear<L: Doubles, const NEXT: bool>(
    l: L,
    field: &[f32],
    [x, y, z, roll, pitch, yaw]: [[usize; 2]; 6],
    share: [f64; 6],
) -> (f64, [f64; 6]) {
    // Offsets of the four angle cells (pitch, yaw) for the lower and the upper roll.
    let angles = each_of!([0, 1], side => {
        each_of!([0, 1, 2, 3], corner => roll[side] + pitch[corner / 2] + yaw[corner % 2])
    });
    // Trilinear part: eight positions, each with four lanes of angles.
    let [low, high] = each_of!([angles[0], angles[1]], angles => {
        // SAFETY: as the caller guarantees.
        let corners = unsafe { each_of!([0, 1, 2, 3, 4, 5, 6, 7], corner => {
            let position = x[corner / 4] + y[corner / 2 % 2] + z[corner % 2];
            if NEXT {
                l.pairs(field, position + angles[0], position + angles[2])
            } else {
                l.four(field, each_of!([0, 1, 2, 3], angle => position + angles[angle]))
            }
        }) };
        fold_positions(l, corners, [share[0], share[1], share[2]])
    });
    // Roll: value with its slope, and the position slopes blended.
    let by = l.splat(share[3]);
    let (value, slope_roll) = fold(l, low[0], high[0], by);
    let [x, y, z] = each_of!([1, 2, 3], k => blend(l, low[k], high[k], by));
    // Pitch: the two numbers of a quantity become those of yaw, and two quantities are stored side by side.
    let by = l.splat(share[4]);
    let [low, high] = l.halves(value, x);
    let (value_x, slope_pitch) = fold(l, low, high, by);
    let [low, high] = l.halves(y, z);
    let y_z = blend(l, low, high, by);
    let [low, high] = l.halves(slope_roll, slope_roll);
    let roll = blend(l, low, high, by);
    // Yaw: even and odd lanes are the lower and the upper cell.
    let by = l.splat(share[5]);
    let [low, high] = l.alternate(value_x, y_z);
    let (all, slope_yaw) = fold(l, low, high, by);
    let [low, high] = l.alternate(roll, slope_pitch);
    let [roll, pitch, ..] = l.array(blend(l, low, high, by));
    let ([value, y, x, z], [yaw, ..]) = (l.array(all), l.array(slope_yaw));
    (value, [x, y, z, roll, pitch, yaw])
}

/// Value and slopes along x, y, z of the corners, corner 4 x + 2 y + z.
#[inline(always)]
fn fold_positions<L: Doubles>(l: L, corners: [L::D; 8], share: [f64; 3]) -> [L::D; 4] {
    let [x, y, z] = each_of!([0, 1, 2], k => l.splat(share[k]));
    let edges = each_of!([0, 2, 4, 6], low => fold(l, corners[low], corners[low + 1], z));
    let [low, high] = each_of!([0, 2], low => {
        let (value, slope_y) = fold(l, edges[low].0, edges[low + 1].0, y);
        (value, slope_y, blend(l, edges[low].1, edges[low + 1].1, y))
    });
    let (value, slope_x) = fold(l, low.0, high.0, x);
    [value, slope_x, blend(l, low.1, high.1, x), blend(l, low.2, high.2, x)]
}

/// `low` moved by `share` towards `high`.
#[inline(always)]
fn blend<L: Doubles>(l: L, low: L::D, high: L::D, share: L::D) -> L::D {
    fold(l, low, high, share).0
}

/// [`blend`], and the slopes from `low` to `high`.
#[inline(always)]
fn fold<L: Doubles>(l: L, low: L::D, high: L::D, share: L::D) -> (L::D, L::D) {
    let slope = l.sub(high, low);
    (l.add(low, l.mul(share, slope)), slope)
}

#[cfg(test)]
mod tests {
    use super::{super::fixtures::*, super::signed_distance_standard, *};
    use std::f64::consts::TAU;

    const METRES: FieldMetric = FieldMetric::Metres { rho: 0.127 };

    fn random_field(grid: &AxisGrid) -> Vec<f32> {
        let mut draws = Draws(11);
        (0..grid.cells()).map(|_| (draws.unit() * 4.0 - 2.0) as f32).collect()
    }

    /// A pose whose coordinate on each axis lies in `span` of 0..=count - 1, wider on periodic axes.
    fn random_pose(grid: &AxisGrid, draws: &mut Draws, span: [f64; 2]) -> [f64; 6] {
        std::array::from_fn(|k| {
            let axis = &grid.axes()[k];
            let along = span[0] + draws.unit() * (span[1] - span[0]);
            let steps = if axis.periodic { along * 3.0 * axis.count as f64 } else { along * (axis.count - 1) as f64 };
            axis.first + steps * axis.step
        })
    }

    #[test]
    fn a_centre_has_the_value_of_its_cell() {
        for grid in grids() {
            let (field, lookup) = (random_field(&grid), AxisLookup::new(&grid, METRES));
            for (cell, exact) in field.iter().enumerate() {
                let value = lookup.value_and_gradient(&field, &grid.pose(cell)).0;
                assert!((value - f64::from(*exact)).abs() < 1e-12, "{value} {exact}");
            }
        }
    }

    #[test]
    fn values_are_the_weighted_corners() {
        let grid = small_grid();
        let lookup = AxisLookup::new(&grid, METRES);
        let (field, mut draws) = (random_field(&grid), Draws(1));
        for _ in 0..2_000 {
            let pose = random_pose(&grid, &mut draws, [0.0, 1.0]);
            let mut sum = 0.0;
            for corner in 0..64_usize {
                let (mut weight, mut cell) = (1.0, [0; 6]);
                for (k, axis) in grid.axes().iter().enumerate() {
                    let coordinate = (pose[k] - axis.first) / axis.step;
                    let low = if axis.periodic {
                        coordinate.floor()
                    } else {
                        coordinate.floor().min((axis.count - 2) as f64)
                    };
                    let high = (corner >> k & 1) as f64;
                    weight *= if high == 1.0 { coordinate - low } else { 1.0 - (coordinate - low) };
                    cell[k] = (low + high).rem_euclid(axis.count as f64) as usize % axis.count;
                }
                sum += weight * f64::from(field[grid.index(cell)]);
            }
            let value = lookup.value_and_gradient(&field, &pose).0;
            assert!((value - sum).abs() < 1e-12, "{value} {sum}");
        }
    }

    #[test]
    fn gradients_are_finite_differences() {
        let mut greatest = 0.0_f64;
        for grid in grids() {
            let (field, mut draws) = (random_field(&grid), Draws(2));
            for metric in [METRES, FieldMetric::Cells] {
                let lookup = AxisLookup::new(&grid, metric);
                for round in 0..2_000 {
                    // Every other pose may lie outside.
                    let span = if round % 2 == 0 { [0.0, 1.0] } else { [-0.6, 1.6] };
                    let pose = random_pose(&grid, &mut draws, span);
                    let gradient = lookup.value_and_gradient(&field, &pose).1;
                    for (k, axis) in grid.axes().iter().enumerate() {
                        let step = 1e-6 * axis.step;
                        let coordinate = axis.wrap((pose[k] - axis.first) / axis.step);
                        // Not across a centre, where the slope jumps.
                        if (coordinate - coordinate.round()).abs() < 1e-5 {
                            continue;
                        }
                        let at = |by: f64| {
                            let mut moved = pose;
                            moved[k] += by;
                            lookup.value_and_gradient(&field, &moved).0
                        };
                        let slope = (at(step) - at(-step)) / (2.0 * step);
                        let error = (slope - gradient[k]).abs() * axis.step;
                        greatest = greatest.max(error);
                        assert!(error < 1e-6, "axis {k} at {pose:?}: {slope} {}", gradient[k]);
                    }
                }
            }
        }
        println!("greatest difference of a gradient: {greatest:e} a step");
    }

    #[test]
    fn periods_change_nothing() {
        let grid = fetch_grid();
        let lookup = AxisLookup::new(&grid, METRES);
        let (field, mut draws) = (random_field(&grid), Draws(3));
        for _ in 0..1_000 {
            let pose = random_pose(&grid, &mut draws, [-0.2, 1.2]);
            let (value, gradient) = lookup.value_and_gradient(&field, &pose);
            for periods in [-2.0, 1.0, 5.0] {
                for k in 3..6 {
                    let mut shifted = pose;
                    shifted[k] += periods * TAU;
                    let (other, slopes) = lookup.value_and_gradient(&field, &shifted);
                    assert!((value - other).abs() < 1e-10, "{value} {other}");
                    // A pose on a centre may fall to its other side.
                    assert!((0..6).all(|k| (gradient[k] - slopes[k]).abs() < 1e-8), "{gradient:?} {slopes:?}");
                }
            }
        }
    }

    #[test]
    fn between_the_last_and_the_first_yaw_both_count() {
        let grid = fetch_grid();
        let mut field = vec![0.0; grid.cells()];
        field[grid.index([3, 4, 5, 0, 2, 7])] = 1.0;
        field[grid.index([3, 4, 5, 0, 2, 0])] = 3.0;
        let mut pose = grid.pose(grid.index([3, 4, 5, 0, 2, 7]));
        pose[5] += grid.axes()[5].step / 4.0;
        assert!((AxisLookup::new(&grid, METRES).value_and_gradient(&field, &pose).0 - 1.5).abs() < 1e-12);
    }

    #[test]
    fn outside_the_distance_to_the_box_is_added() {
        let grid = fetch_grid();
        let field = vec![0.5; grid.cells()];
        let (value, gradient) =
            AxisLookup::new(&grid, METRES).value_and_gradient(&field, &[1.4, -1.5, 0.5, 9.0, 9.0, 9.0]);
        assert!((value - 1.0).abs() < 1e-12, "{value}");
        assert!((gradient[0] - 0.6).abs() < 1e-12 && (gradient[1] + 0.8).abs() < 1e-12, "{gradient:?}");
        assert_eq!(gradient[2..], [0.0; 4]);
        let (value, gradient) =
            AxisLookup::new(&grid, FieldMetric::Cells).value_and_gradient(&field, &[1.4, -1.5, 0.5, 9.0, 9.0, 9.0]);
        assert!((value - 5.5).abs() < 1e-12 && (gradient[0] - 6.0).abs() < 1e-12, "{value} {gradient:?}");
    }

    #[test]
    fn odd_poses_and_infinite_fields_are_answered() {
        let grid = small_grid();
        let (field, lookup) = (random_field(&grid), AxisLookup::new(&grid, METRES));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            for k in 0..6 {
                let mut pose = grid.pose(700);
                pose[k] = bad;
                let value = lookup.value_and_gradient(&field, &pose).0;
                assert!(bad.abs() < f64::INFINITY || !value.is_finite(), "axis {k} at {bad}: {value}");
            }
        }
        for label in [false, true] {
            let field = signed_distance_standard(&vec![label; grid.cells()], &grid, 0.127);
            let answer = lookup.value_and_gradient(&field, &grid.pose(123));
            assert_eq!(answer, (f64::from(field[0]), [0.0; 6]));
        }
    }

    #[test]
    #[should_panic(expected = "one value a cell")]
    fn a_missing_value_is_refused() {
        AxisLookup::new(&small_grid(), METRES).value_and_gradient(&[0.0; 3], &[0.0; 6]);
    }

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        for grid in grids().into_iter().chain([fetch_grid()]) {
            let (field, mut draws) = (random_field(&grid), Draws(4));
            let levels: Vec<AxisLookup> =
                SimdLevel::available().map(|level| AxisLookup::new(&grid, METRES).with_simd(level)).collect();
            for _ in 0..2_000 {
                let pose = random_pose(&grid, &mut draws, [-0.2, 1.2]);
                let [scalar, others @ ..] = levels.as_slice() else { panic!("the scalar level is always there") };
                let (value, gradient) = scalar.value_and_gradient(&field, &pose);
                for other in others {
                    let (same, slopes) = other.value_and_gradient(&field, &pose);
                    assert_eq!(value.to_bits(), same.to_bits());
                    assert_eq!(gradient.map(f64::to_bits), slopes.map(f64::to_bits));
                }
            }
        }
    }
}
