//! Values of a field between the centres of its cells.

use super::{AxisUnit, PoseGrid};

/// What the values of a field count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldMetric {
    /// Metres, angles weighted by `rho` (profile `standard`).
    Metres {
        /// Metres that count as much as one radian [m/rad].
        rho: f64,
    },
    /// Cells, all axes equal (profile `thesis`).
    Cells,
}

impl FieldMetric {
    /// Field units in one unit of an axis.
    pub(super) fn scale(self, unit: AxisUnit, step: f64) -> f64 {
        match (self, unit) {
            (Self::Metres { .. }, AxisUnit::Metre) => 1.0,
            (Self::Metres { rho }, AxisUnit::Radian) => rho,
            (Self::Cells, _) => 1.0 / step,
        }
    }
}

/// Value and gradient of a field at a pose: x, y, z [m], roll, pitch, yaw [rad].
///
/// Multilinear between the 2^6 nearest centres; periodic axes wrap. Beyond the box of the centres (non-periodic axes):
/// the value at the nearest point of the box plus the distance to it in the metric of the field, and the gradient of that
/// sum. The gradient is in field units per metre (x, y, z) and per radian (roll, pitch, yaw); at a centre, where it
/// jumps, it is that of the side above (below on the last centre). An infinite field is infinite everywhere, with a zero
/// gradient; a pose that is not finite gives NaN or an infinite value.
///
/// # Panics
/// When `field` has not one value a cell.
pub fn value_and_gradient(field: &[f32], grid: &PoseGrid, metric: FieldMetric, pose: [f64; 6]) -> (f64, [f64; 6]) {
    assert_eq!(field.len(), grid.cells(), "one value a cell");
    if field[0].is_infinite() {
        return (f64::from(field[0]), [0.0; 6]);
    }
    let (strides, inverse_steps) = (grid.strides(), grid.inverse_steps());
    let mut low = 0;
    let (mut up, mut share, mut beyond) = ([0_isize; 6], [0.0; 6], [0.0; 6]);
    for (k, axis) in grid.axes().iter().enumerate() {
        let (mut place, last) = (axis.wrap((pose[k] - axis.first) * inverse_steps[k]), axis.count - 1);
        let index;
        if axis.periodic {
            index = (place as usize).min(last);
            up[k] = if index == last { -((last * strides[k]) as isize) } else { strides[k] as isize };
        } else {
            let clamped = place.clamp(0.0, last as f64);
            beyond[k] = (place - clamped) * axis.step * metric.scale(axis.unit, axis.step);
            place = clamped;
            index = (place as usize).min(last.saturating_sub(1));
            up[k] = if last == 0 { 0 } else { strides[k] as isize };
        }
        low += index * strides[k];
        share[k] = place - index as f64;
    }
    let (mut value, mut gradient) = multilinear(field, low, up, share);
    for (slope, inverse_step) in gradient.iter_mut().zip(inverse_steps) {
        *slope *= inverse_step;
    }
    if beyond != [0.0; 6] {
        let distance = beyond.iter().map(|part| part * part).sum::<f64>().sqrt();
        value += distance;
        for (k, axis) in grid.axes().iter().enumerate() {
            if beyond[k] != 0.0 {
                gradient[k] = beyond[k] / distance * metric.scale(axis.unit, axis.step);
            }
        }
    }
    (value, gradient)
}

/// Value and gradient [per step] at `share` of the way from cell `low` to the cells `up` from it.
fn multilinear(field: &[f32], low: usize, up: [isize; 6], share: [f64; 6]) -> (f64, [f64; 6]) {
    // Corner 4 a + 2 b + c of three axes.
    let offsets = |[a, b, c]: [isize; 3]| [0, c, b, b + c, a, a + c, a + b, a + b + c];
    let [x, y, z, roll, pitch, yaw] = up;
    let (places, turns) = (offsets([x, y, z]), offsets([roll, pitch, yaw]));
    let mut corners = [0.0_f32; 64];
    for (eight, place) in corners.as_chunks_mut::<8>().0.iter_mut().zip(places) {
        let first = low.wrapping_add_signed(place);
        *eight = turns.map(|turn| field[first.wrapping_add_signed(turn)]);
    }
    let corners = corners.map(f64::from);
    // One axis after the other is folded: the values, and the slopes along the axes before it.
    let (corners, slope_x) = fold::<64, 32>(&corners, share[0]);
    let (corners, slope_y) = fold::<32, 16>(&corners, share[1]);
    let slope_x = blend::<32, 16>(&slope_x, share[1]);
    let (corners, slope_z) = fold::<16, 8>(&corners, share[2]);
    let [slope_x, slope_y] = [slope_x, slope_y].map(|slope| blend::<16, 8>(&slope, share[2]));
    let (corners, slope_roll) = fold::<8, 4>(&corners, share[3]);
    let [slope_x, slope_y, slope_z] = [slope_x, slope_y, slope_z].map(|slope| blend::<8, 4>(&slope, share[3]));
    let (corners, slope_pitch) = fold::<4, 2>(&corners, share[4]);
    let slopes = [slope_x, slope_y, slope_z, slope_roll].map(|slope| blend::<4, 2>(&slope, share[4]));
    let (value, slope_yaw) = fold::<2, 1>(&corners, share[5]);
    let [x, y, z, roll] = slopes.map(|slope| blend::<2, 1>(&slope, share[5])[0]);
    (value[0], [x, y, z, roll, blend::<2, 1>(&slope_pitch, share[5])[0], slope_yaw[0]])
}

/// The first half moved by `share` towards the second.
#[inline(always)]
fn blend<const N: usize, const HALF: usize>(values: &[f64; N], share: f64) -> [f64; HALF] {
    std::array::from_fn(|i| values[i] + share * (values[HALF + i] - values[i]))
}

/// [`blend`], and the slopes from the first half to the second.
#[inline(always)]
fn fold<const N: usize, const HALF: usize>(values: &[f64; N], share: f64) -> ([f64; HALF], [f64; HALF]) {
    let slopes: [f64; HALF] = std::array::from_fn(|i| values[HALF + i] - values[i]);
    (std::array::from_fn(|i| values[i] + share * slopes[i]), slopes)
}

#[cfg(test)]
mod tests {
    use super::{super::fixtures::*, super::signed_distance_standard, *};
    use std::{f64::consts::TAU, hint::black_box, time::Instant};

    const METRES: FieldMetric = FieldMetric::Metres { rho: 0.127 };

    fn random_field(grid: &PoseGrid) -> Vec<f32> {
        let mut draws = Draws(11);
        (0..grid.cells()).map(|_| (draws.unit() * 4.0 - 2.0) as f32).collect()
    }

    /// A pose whose place on each axis lies in `span` of 0..=count - 1, wider on periodic axes.
    fn random_pose(grid: &PoseGrid, draws: &mut Draws, span: [f64; 2]) -> [f64; 6] {
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
            let field = random_field(&grid);
            for (cell, exact) in field.iter().enumerate() {
                let value = value_and_gradient(&field, &grid, METRES, grid.pose(cell)).0;
                assert!((value - f64::from(*exact)).abs() < 1e-12, "{value} {exact}");
            }
        }
    }

    #[test]
    fn values_are_the_weighted_corners() {
        let grid = small_grid();
        let (field, mut draws) = (random_field(&grid), Draws(1));
        for _ in 0..2_000 {
            let pose = random_pose(&grid, &mut draws, [0.0, 1.0]);
            let mut sum = 0.0;
            for corner in 0..64_usize {
                let (mut weight, mut cell) = (1.0, [0; 6]);
                for (k, axis) in grid.axes().iter().enumerate() {
                    let place = (pose[k] - axis.first) / axis.step;
                    let low = if axis.periodic { place.floor() } else { place.floor().min((axis.count - 2) as f64) };
                    let high = (corner >> k & 1) as f64;
                    weight *= if high == 1.0 { place - low } else { 1.0 - (place - low) };
                    cell[k] = (low + high).rem_euclid(axis.count as f64) as usize % axis.count;
                }
                sum += weight * f64::from(field[grid.index(cell)]);
            }
            let value = value_and_gradient(&field, &grid, METRES, pose).0;
            assert!((value - sum).abs() < 1e-12, "{value} {sum}");
        }
    }

    #[test]
    fn gradients_are_finite_differences() {
        let mut greatest = 0.0_f64;
        for grid in grids() {
            let (field, mut draws) = (random_field(&grid), Draws(2));
            for metric in [METRES, FieldMetric::Cells] {
                for round in 0..2_000 {
                    // Every other pose may lie outside.
                    let span = if round % 2 == 0 { [0.0, 1.0] } else { [-0.6, 1.6] };
                    let pose = random_pose(&grid, &mut draws, span);
                    let gradient = value_and_gradient(&field, &grid, metric, pose).1;
                    for (k, axis) in grid.axes().iter().enumerate() {
                        let step = 1e-6 * axis.step;
                        let place = axis.wrap((pose[k] - axis.first) / axis.step);
                        // Not across a centre, where the slope jumps.
                        if (place - place.round()).abs() < 1e-5 {
                            continue;
                        }
                        let at = |by: f64| {
                            let mut moved = pose;
                            moved[k] += by;
                            value_and_gradient(&field, &grid, metric, moved).0
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
    fn turns_change_nothing() {
        let grid = fetch_grid();
        let (field, mut draws) = (random_field(&grid), Draws(3));
        for _ in 0..1_000 {
            let pose = random_pose(&grid, &mut draws, [-0.2, 1.2]);
            let (value, gradient) = value_and_gradient(&field, &grid, METRES, pose);
            for turns in [-2.0, 1.0, 5.0] {
                for k in 3..6 {
                    let mut turned = pose;
                    turned[k] += turns * TAU;
                    let (other, slopes) = value_and_gradient(&field, &grid, METRES, turned);
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
        assert!((value_and_gradient(&field, &grid, METRES, pose).0 - 1.5).abs() < 1e-12);
    }

    #[test]
    fn outside_the_distance_to_the_box_is_added() {
        let grid = fetch_grid();
        let field = vec![0.5; grid.cells()];
        let (value, gradient) = value_and_gradient(&field, &grid, METRES, [1.4, -1.5, 0.5, 9.0, 9.0, 9.0]);
        assert!((value - 1.0).abs() < 1e-12, "{value}");
        assert!((gradient[0] - 0.6).abs() < 1e-12 && (gradient[1] + 0.8).abs() < 1e-12, "{gradient:?}");
        assert_eq!(gradient[2..], [0.0; 4]);
        let (value, gradient) = value_and_gradient(&field, &grid, FieldMetric::Cells, [1.4, -1.5, 0.5, 9.0, 9.0, 9.0]);
        assert!((value - 5.5).abs() < 1e-12 && (gradient[0] - 6.0).abs() < 1e-12, "{value} {gradient:?}");
    }

    #[test]
    fn odd_poses_and_infinite_fields_are_answered() {
        let grid = small_grid();
        let field = random_field(&grid);
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300] {
            for k in 0..6 {
                let mut pose = grid.pose(700);
                pose[k] = bad;
                let value = value_and_gradient(&field, &grid, METRES, pose).0;
                assert!(bad.abs() < f64::INFINITY || !value.is_finite(), "axis {k} at {bad}: {value}");
            }
        }
        for label in [false, true] {
            let field = signed_distance_standard(&vec![label; grid.cells()], &grid, 0.127);
            let answer = value_and_gradient(&field, &grid, METRES, grid.pose(123));
            assert_eq!(answer, (f64::from(field[0]), [0.0; 6]));
        }
    }

    #[test]
    #[should_panic(expected = "one value a cell")]
    fn a_missing_value_is_refused() {
        value_and_gradient(&[0.0; 3], &small_grid(), METRES, [0.0; 6]);
    }

    #[test]
    fn a_lookup_takes_less_than_a_moment() {
        let grid = fetch_grid();
        let (field, mut draws) = (random_field(&grid), Draws(4));
        let poses: Vec<[f64; 6]> = (0..100_000).map(|_| random_pose(&grid, &mut draws, [0.0, 1.0])).collect();
        let near: Vec<[f64; 6]> = (0..100_000).map(|i| poses[0].map(|x| x + 1e-9 * f64::from(i))).collect();
        let wide: Vec<[f64; 6]> = (0..100_000).map(|_| random_pose(&grid, &mut draws, [-0.5, 1.5])).collect();
        for (name, poses) in [("random", &poses), ("along a path", &near), ("half outside", &wide)] {
            let start = Instant::now();
            let sum: f64 = poses.iter().map(|pose| value_and_gradient(&field, &grid, METRES, black_box(*pose)).0).sum();
            println!("{name}: {:.0} ns a lookup ({sum:.3})", start.elapsed().as_nanos() as f64 / poses.len() as f64);
        }
    }
}
