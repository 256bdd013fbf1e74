//! Signed distance over positions, directions and roll, by the angle between rotations.
//!
//! The squared distance is a sum of a part of position and a part of orientation. The first is separable; for the
//! second, orientations are tried from the nearest on until no other can be nearer, so it is also exact.

use nalgebra::{UnitQuaternion, Vector4};

use super::{SphereGrid, standard::Transform};
use crate::geom::{SimdLevel, rotation_from_rpy, simd_kernel};

/// Positions that are worked side by side.
const LANES: usize = 16;

/// Signed distance [m] from the centre of each cell to the union of the closed cells of the other label.
///
/// The distance between two poses is sqrt(|dp|^2 + (rho * angle)^2), angle being that between the two rotations [rad] and
/// `rho` [m/rad] mostly [`METRES_PER_RADIAN`](super::METRES_PER_RADIAN). A cell is the box that reaches half a step to
/// each side of its position, times the ball of rotations about its own that reaches half-way to the nearest other
/// orientation of the grid; on an evenly divided circle these are the cells of
/// [`signed_distance_standard`](super::signed_distance_standard). `inside` and the result have one value per cell; negative
/// inside. Where no cell has the other label the distance is infinite: +inf everywhere when nothing is inside, -inf when
/// everything is.
///
/// Squares are summed in `f64` and each root is rounded to `f32` once. A minimum has no rounding and each sum runs in one
/// order, so the bits are the same on every machine.
///
/// # Panics
/// When `inside` has not one value per cell or `rho` is not finite and above zero.
pub fn signed_distance_sphere(inside: &[bool], grid: &SphereGrid, rho: f64) -> Vec<f32> {
    let counts = grid.position_axes().map(|axis| axis.count);
    assert_eq!(inside.len(), counts.iter().product::<usize>() * grid.orientations(), "one label per cell");
    assert!(rho.is_finite() && rho > 0.0, "rho = {rho} m/rad must be finite and above zero");
    let mut result = vec![0.0_f32; inside.len()];
    let mut squares = vec![0.0_f64; inside.len()];
    let (positions, rotations) =
        (Transform::of_positions(grid.position_axes(), grid.orientations()), RotationTransform::new(grid, rho));
    // To the outside cells for the cells inside, then the reverse.
    for (label, sign) in [(true, -1.0), (false, 1.0)] {
        for (square, cell) in squares.iter_mut().zip(inside) {
            *square = if *cell == label { f64::INFINITY } else { 0.0 };
        }
        positions.run_positions(&mut squares);
        rotations.run(&mut squares);
        for ((value, square), cell) in result.iter_mut().zip(&squares).zip(inside) {
            let distance = (sign * square.sqrt()) as f32;
            *value = if *cell == label { distance } else { *value };
        }
    }
    result
}

/// Neighbourhood of each orientation among the others.
struct RotationTransform {
    rolls: usize,
    directions: Vec<Others>,
    simd: SimdLevel,
}

/// The other orientations as seen from a direction at roll 0, the nearest first.
struct Others {
    /// Square of the gap from the centre here to the ball of each [m^2].
    gaps: Vec<f64>,
    /// Index of each among the directions, each with its rolls twice over: those of another roll are as many indices on.
    indices: Vec<u32>,
}

impl RotationTransform {
    fn new(grid: &SphereGrid, rho: f64) -> Self {
        let (rolls, count) = (grid.roll().count, grid.directions().count());
        // Unit quaternion of each orientation of the grid.
        let quaternions: Vec<Vector4<f64>> = (0..grid.orientations())
            .map(|orientation| {
                let [roll, pitch, yaw] = grid.rpy(orientation);
                UnitQuaternion::from_rotation_matrix(&rotation_from_rpy(roll, pitch, yaw)).coords
            })
            .collect();
        // Rotating both about their x axes by the same roll changes no angle: those at roll 0 are enough.
        let angles = |direction: usize| {
            let from = quaternions[direction * rolls];
            quaternions.iter().map(move |to| {
                // 4 asin loses nothing of small angles; a quaternion and its negative are one rotation.
                let apart = (from - to).norm_squared().min((from + to).norm_squared());
                4.0 * libm::asin((0.5 * libm::sqrt(apart)).min(1.0))
            })
        };
        // Radius of each orientation's ball: half the angle to its nearest neighbour.
        let half_to_nearest = |direction: usize| {
            let others = angles(direction).enumerate().filter(|(index, _)| *index != direction * rolls);
            0.5 * others.map(|(_, angle)| angle).fold(f64::INFINITY, f64::min)
        };
        let reaches: Vec<f64> = (0..count).map(half_to_nearest).collect();
        // Gap to each other ball, as squares, the nearest first.
        let others = |direction: usize| {
            let gap = |(index, angle): (usize, f64)| {
                let gap = rho * (angle - reaches[index / rolls]).max(0.0);
                // Rolls are stored twice over: a shift in roll is an offset without wrapping.
                (gap * gap, (index / rolls * 2 * rolls + index % rolls) as u32)
            };
            let others = angles(direction).enumerate().filter(|(index, _)| *index != direction * rolls);
            let mut others: Vec<(f64, u32)> = others.map(gap).collect();
            others.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let (gaps, indices) = others.into_iter().unzip();
            Others { gaps, indices }
        };
        Self { rolls, directions: (0..count).map(others).collect(), simd: SimdLevel::detect() }
    }

    /// At every position `out[i] = min over j of in[j] + gap(i, j)^2`, in place.
    fn run(&self, squares: &mut [f64]) {
        let (rolls, orientations) = (self.rolls, self.rolls * self.directions.len());
        let mut tile = vec![[0.0; LANES]; 2 * orientations];
        let mut min = vec![[0.0; LANES]; orientations];
        for group in squares.chunks_mut(LANES * orientations) {
            if group.iter().all(|square| *square == group[0]) {
                continue;
            }
            let used = group.len() / orientations;
            for orientation in 0..orientations {
                let row = std::array::from_fn(|lane| group[lane.min(used - 1) * orientations + orientation]);
                let index = orientation / rolls * 2 * rolls + orientation % rolls;
                (tile[index], tile[index + rolls]) = (row, row);
            }
            min_over_rotations(self.simd, self, &tile, &mut min);
            for (orientation, row) in min.iter().enumerate() {
                for (lane, square) in row[..used].iter().enumerate() {
                    group[lane * orientations + orientation] = *square;
                }
            }
        }
    }
}

simd_kernel! {
    /// `min[i] = min over j of tile[j] + gap(i, j)^2`, lane by lane.
    fn min_over_rotations(rotations: &RotationTransform, tile: &[[f64; LANES]], min: &mut [[f64; LANES]]) = min_over_rotations_body;
}

#[inline(always)]
fn min_over_rotations_body<L>(_: L, rotations: &RotationTransform, tile: &[[f64; LANES]], min: &mut [[f64; LANES]]) {
    // Candidates between two checks whether any can still be nearer.
    const RUN: usize = 8;
    let rolls = rotations.rolls;
    let mut floor = [f64::INFINITY; LANES];
    for row in tile {
        for lane in 0..LANES {
            floor[lane] = if row[lane] < floor[lane] { row[lane] } else { floor[lane] };
        }
    }
    for (direction, (others, out)) in rotations.directions.iter().zip(min.chunks_exact_mut(rolls)).enumerate() {
        for (roll, out) in out.iter_mut().enumerate() {
            let mut best = tile[direction * 2 * rolls + roll];
            for (gaps, indices) in others.gaps.chunks(RUN).zip(others.indices.chunks(RUN)) {
                if (0..LANES).all(|lane| floor[lane] + gaps[0] >= best[lane]) {
                    break;
                }
                for (gap, index) in gaps.iter().zip(indices) {
                    let row = &tile[*index as usize + roll];
                    for lane in 0..LANES {
                        let sum = row[lane] + gap;
                        best[lane] = if sum < best[lane] { sum } else { best[lane] };
                    }
                }
            }
            *out = best;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{HealPix, METRES_PER_RADIAN, PoseGrid, fixtures::*},
        *,
    };

    fn sphere(counts: [usize; 3], nside: u32, rolls: usize) -> SphereGrid {
        SphereGrid::new(position_axes(counts), HealPix::new(nside).unwrap(), rolls).unwrap()
    }

    /// The distance by its definition: over all cells of the other label.
    fn by_definition(inside: &[bool], grid: &SphereGrid, rho: f64) -> Vec<f64> {
        let poses = PoseGrid::Sphere(grid.clone());
        let n = grid.orientations();
        let rotations: Vec<_> = (0..n).map(|orientation| poses.rotation(orientation)).collect();
        let angle = |a: usize, b: usize| {
            let between = rotations[a].inverse() * rotations[b];
            let m = between.matrix();
            let twice_sine = nalgebra::Vector3::new(m.m32 - m.m23, m.m13 - m.m31, m.m21 - m.m12).norm();
            libm::atan2(twice_sine, m.trace() - 1.0)
        };
        let reach: Vec<f64> = (0..n)
            .map(|a| 0.5 * (0..n).filter(|b| *b != a).map(|b| angle(a, b)).fold(f64::INFINITY, f64::min))
            .collect();
        let gaps: Vec<f64> = (0..n * n)
            .map(|pair| {
                let (a, b) = (pair / n, pair % n);
                if a == b { 0.0 } else { rho * (angle(a, b) - reach[b]) }
            })
            .collect();
        let square = |from: usize, to: usize| {
            let (at, other) = (poses.centre(from / n), poses.centre(to / n));
            let apart: f64 =
                (0..3).map(|k| ((at[k] - other[k]).abs() - 0.5 * grid.position_axes()[k].step).max(0.0).powi(2)).sum();
            apart + gaps[from % n * n + to % n].powi(2)
        };
        (0..inside.len())
            .map(|cell| {
                let others = (0..inside.len()).filter(|other| inside[*other] != inside[cell]);
                let min = others.map(|other| square(cell, other)).fold(f64::INFINITY, f64::min);
                if inside[cell] { -min.sqrt() } else { min.sqrt() }
            })
            .collect()
    }

    #[test]
    fn distances_are_those_of_the_definition() {
        for grid in [sphere([3, 2, 3], 1, 5), sphere([2, 1, 3], 2, 4), sphere([1, 1, 1], 2, 3), sphere([5, 4, 2], 1, 1)]
        {
            for rho in [METRES_PER_RADIAN, 1.0, 0.01] {
                let cells = grid.position_axes().iter().map(|axis| axis.count).product::<usize>() * grid.orientations();
                for (share, seed) in [(0.003, 1), (0.05, 2), (0.5, 3), (0.98, 4), (0.999, 5)] {
                    let mut draws = Draws(seed);
                    let labels: Vec<bool> = (0..cells).map(|_| draws.unit() < share).collect();
                    let field = signed_distance_sphere(&labels, &grid, rho);
                    for (value, exact) in field.iter().zip(by_definition(&labels, &grid, rho)) {
                        let value = f64::from(*value);
                        let same = value == exact || (value - exact).abs() <= 1e-7 * exact.abs();
                        assert!(same, "{:?} rho {rho} share {share}: {value} {exact}", grid.directions());
                    }
                    assert!(field.iter().zip(&labels).all(|(value, label)| (*value < 0.0) == *label));
                }
            }
        }
    }

    #[test]
    fn next_to_the_border_it_is_half_a_step() {
        let grid = sphere([5, 5, 5], 2, 8);
        let (poses, n) = (PoseGrid::Sphere(grid.clone()), grid.orientations());
        let mut labels = vec![false; poses.cells()];
        let at = poses.cells_at([2, 2, 2]).start + 100;
        labels[at] = true;
        let field = signed_distance_sphere(&labels, &grid, 10.0);
        assert_eq!(field[at], -0.05, "turning is dear: the nearest way out is a step");
        assert_eq!(field[at + n], 0.05);
        assert_eq!(field[at + 2 * n], 0.15);
        let field = signed_distance_sphere(&labels, &grid, 0.01);
        let angle = |other: usize| poses.rotation(100).angle_to(&poses.rotation(other));
        let nearest = (0..n).filter(|other| *other != 100).map(angle).fold(f64::INFINITY, f64::min);
        assert!((f64::from(field[at]) + 0.01 * nearest / 2.0).abs() < 1e-3, "{} {nearest}", field[at]);
    }

    #[test]
    fn without_the_other_label_it_is_infinite() {
        let grid = sphere([2, 2, 2], 1, 3);
        let field = |label| signed_distance_sphere(&vec![label; 8 * grid.orientations()], &grid, METRES_PER_RADIAN);
        assert!(field(false).iter().all(|value| *value == f32::INFINITY));
        assert!(field(true).iter().all(|value| *value == f32::NEG_INFINITY));
    }

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        let grid = sphere([3, 3, 3], 1, 6);
        let mut draws = Draws(9);
        let squares: Vec<f64> = (0..27 * grid.orientations()).map(|_| draws.unit()).collect();
        let results: Vec<Vec<u64>> = SimdLevel::available()
            .map(|simd| {
                let mut squares = squares.clone();
                RotationTransform { simd, ..RotationTransform::new(&grid, 0.1) }.run(&mut squares);
                squares.into_iter().map(f64::to_bits).collect()
            })
            .collect();
        assert!(results.iter().all(|result| *result == results[0]));
    }
}
