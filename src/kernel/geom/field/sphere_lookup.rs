//! Values of a field over positions, directions and roll, between the centres of its cells.

use nalgebra::Vector3;

use super::{FieldMetric, SphereGrid, healpix::Mesh, sphere_grid::roll_about};

/// Lookups prepared once for a grid and a metric.
#[derive(Clone, Debug)]
pub(super) struct SphereLookup {
    grid: SphereGrid,
    metric: FieldMetric,
    mesh: Mesh,
    /// Difference of a cell's index per step along x, y, z.
    strides: [usize; 3],
}

impl SphereLookup {
    pub(super) fn new(grid: &SphereGrid, metric: FieldMetric) -> Self {
        let [_, ny, nz] = grid.position_axes().map(|axis| axis.count);
        let n = grid.orientations();
        Self { grid: grid.clone(), metric, mesh: Mesh::new(grid.directions()), strides: [ny * nz * n, nz * n, n] }
    }

    /// Value and gradient as in `FieldLookup::value_and_gradient`.
    pub(super) fn value_and_gradient(&self, field: &[f32], pose: &[f64; 6]) -> (f64, [f64; 6]) {
        let cells = self.strides[0] * self.grid.position_axes()[0].count;
        assert_eq!(field.len(), cells, "one value a cell");
        if field[0].is_infinite() {
            return (f64::from(field[0]), [0.0; 6]);
        }
        if !pose.iter().all(|coordinate| coordinate.is_finite()) {
            return (f64::NAN, [f64::NAN; 6]);
        }
        let [.., roll, pitch, yaw] = *pose;
        let ((sr, cr), (sp, cp), (sy, cy)) = (libm::sincos(roll), libm::sincos(pitch), libm::sincos(yaw));
        // The x and y axis of the end effector.
        let ahead = Vector3::new(cy * cp, sy * cp, -sp);
        let side = Vector3::new(cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr);
        let (corners, beyond) = self.corners(pose);
        let (directions, weights, slopes) = self.mesh.around(&ahead);
        let axis = self.grid.roll();
        let (mut value, mut along) = (0.0, [0.0; 3]);
        // By the end effector's angular velocity, in the frame of the poses.
        let mut rotation_slope = Vector3::zeros();
        for ((direction, weight), slope) in directions.into_iter().zip(weights).zip(slopes) {
            let frame = &self.grid.frames()[direction];
            let coordinate = axis.wrap((roll_about(frame, &ahead, &side) - axis.first) / axis.step);
            let low = (coordinate as usize).min(axis.count - 1);
            let share = coordinate - low as f64;
            let high = if low + 1 == axis.count { 0 } else { low + 1 };
            let [low, high] = [low, high].map(|roll| corners.blend(field, direction * axis.count + roll));
            let own = low[0] + share * (high[0] - low[0]);
            value += weight * own;
            for k in 0..3 {
                along[k] += weight * (low[k + 1] + share * (high[k + 1] - low[k + 1]));
            }
            // The direction moves with velocity x ahead.
            rotation_slope += own * ahead.cross(&slope);
            // Swung along, the roll about the other direction grows so (half the two axes' sum, over the cosine squared of
            // half the angle between them).
            let towards = frame.column(0);
            let by_roll = weight * (high[0] - low[0]) / axis.step / (1.0 + ahead.dot(&towards));
            rotation_slope += by_roll * (ahead + towards);
        }
        let by_pitch = rotation_slope.y * cy - rotation_slope.x * sy;
        let mut gradient = [along[0], along[1], along[2], rotation_slope.dot(&ahead), by_pitch, rotation_slope.z];
        if beyond != [0.0; 3] {
            let distance = beyond.iter().map(|part| part * part).sum::<f64>().sqrt();
            value += distance;
            for (k, axis) in self.grid.position_axes().iter().enumerate().filter(|(k, _)| beyond[*k] != 0.0) {
                gradient[k] = beyond[k] / distance * self.metric.scale(axis.unit, axis.step);
            }
        }
        (value, gradient)
    }

    /// The eight positions around a pose, and how far it lies beyond them along each axis, in units of the field.
    fn corners(&self, pose: &[f64; 6]) -> (Corners, [f64; 3]) {
        let (mut corners, mut beyond) =
            (Corners { cells: [[0; 2]; 3], share: [0.0; 3], per_metre: [0.0; 3] }, [0.0; 3]);
        for (k, axis) in self.grid.position_axes().iter().enumerate() {
            let coordinate = (pose[k] - axis.first) / axis.step;
            let inside = coordinate.clamp(0.0, (axis.count - 1) as f64);
            beyond[k] = (coordinate - inside) * axis.step * self.metric.scale(axis.unit, axis.step);
            let low = (inside as usize).min(axis.count.saturating_sub(2));
            let high = (low + 1).min(axis.count - 1);
            corners.cells[k] = [low, high].map(|cell| cell * self.strides[k]);
            corners.share[k] = inside - low as f64;
            corners.per_metre[k] = 1.0 / axis.step;
        }
        (corners, beyond)
    }
}

/// Eight positions and their shares.
struct Corners {
    /// Cells below and above along each axis, at orientation 0.
    cells: [[usize; 2]; 3],
    share: [f64; 3],
    per_metre: [f64; 3],
}

impl Corners {
    /// Value at an orientation, and its slopes along x, y, z.
    #[inline]
    fn blend(&self, field: &[f32], orientation: usize) -> [f64; 4] {
        let ([x, y, z], [sx, sy, sz]) = (self.cells, self.share);
        let at = |i: usize, j: usize, k: usize| f64::from(field[x[i] + y[j] + z[k] + orientation]);
        let edge = |i: usize, j: usize| {
            let (low, high) = (at(i, j, 0), at(i, j, 1));
            [low + sz * (high - low), high - low]
        };
        let face = |i: usize| {
            let ([low, low_z], [high, high_z]) = (edge(i, 0), edge(i, 1));
            [low + sy * (high - low), high - low, low_z + sy * (high_z - low_z)]
        };
        let ([low, low_y, low_z], [high, high_y, high_z]) = (face(0), face(1));
        let per = self.per_metre;
        [
            low + sx * (high - low),
            (high - low) * per[0],
            (low_y + sx * (high_y - low_y)) * per[1],
            (low_z + sx * (high_z - low_z)) * per[2],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{FieldLookup, HealPix, PoseGrid, fixtures::*, signed_distance_sphere},
        *,
    };
    use crate::geom::rotation_from_rpy;
    use std::f64::consts::{PI, TAU};

    const METRES: FieldMetric = FieldMetric::Metres { rho: 0.127 };

    fn grids() -> Vec<PoseGrid> {
        let of = |counts, nside, rolls| {
            PoseGrid::on_sphere(position_axes(counts), HealPix::new(nside).unwrap(), rolls).unwrap()
        };
        vec![of([4, 3, 5], 2, 8), of([1, 2, 3], 1, 1), of([2, 1, 2], 3, 5)]
    }

    fn random_field(grid: &PoseGrid) -> Vec<f32> {
        let mut draws = Draws(11);
        (0..grid.cells()).map(|_| (draws.unit() * 4.0 - 2.0) as f32).collect()
    }

    fn random_pose(grid: &PoseGrid, draws: &mut Draws, span: [f64; 2]) -> [f64; 6] {
        let [x, y, z] = std::array::from_fn(|k| {
            let axis = &grid.position_axes()[k];
            let along = span[0] + draws.unit() * (span[1] - span[0]);
            // A single cell has no interval between centres: the point is outside it.
            axis.first + along * (axis.count - 1).max(1) as f64 * axis.step
        });
        let mut angle = || (draws.unit() - 0.5) * 3.0 * TAU;
        [x, y, z, angle(), angle(), angle()]
    }

    #[test]
    fn a_centre_has_the_value_of_its_cell() {
        for grid in grids() {
            let (field, lookup) = (random_field(&grid), FieldLookup::new(&grid, METRES));
            for (cell, exact) in field.iter().enumerate() {
                let value = lookup.value_and_gradient(&field, &grid.pose(cell)).0;
                assert!((value - f64::from(*exact)).abs() < 1e-10, "{value} {exact}");
                assert_eq!(grid.nearest(grid.pose(cell)), cell);
            }
        }
    }

    #[test]
    fn gradients_are_finite_differences() {
        let mut worst = 0;
        for grid in grids() {
            let (field, mut draws) = (random_field(&grid), Draws(2));
            let lookup = FieldLookup::new(&grid, METRES);
            for round in 0..3_000 {
                let span = if round % 2 == 0 { [0.0, 1.0] } else { [-0.6, 1.6] };
                let pose = random_pose(&grid, &mut draws, span);
                let gradient = lookup.value_and_gradient(&field, &pose).1;
                for k in 0..6 {
                    let at = |by: f64| {
                        let mut moved = pose;
                        moved[k] += by;
                        lookup.value_and_gradient(&field, &moved).0
                    };
                    let step = 1e-7;
                    let (above, below) = ((at(step) - at(0.0)) / step, (at(0.0) - at(-step)) / step);
                    // Across a side of a triangle or the middle of a cell the slope jumps.
                    if (above - below).abs() > 1e-4 {
                        worst += 1;
                        continue;
                    }
                    let error = ((above + below) / 2.0 - gradient[k]).abs();
                    assert!(error < 1e-5 * (1.0 + gradient[k].abs()), "axis {k} at {pose:?}: {above} {}", gradient[k]);
                }
            }
        }
        assert!(worst < 60, "{worst} jumps of 54,000");
    }

    /// From pose to pose the value moves by no more than slopes allow: no jumps across triangles, rolls or the poles.
    #[test]
    fn values_do_not_jump() {
        for grid in grids() {
            let (field, lookup) = (random_field(&grid), FieldLookup::new(&grid, METRES));
            let mut draws = Draws(3);
            for _ in 0..200 {
                let (from, to) =
                    (random_pose(&grid, &mut draws, [0.0, 1.0]), random_pose(&grid, &mut draws, [0.0, 1.0]));
                let mut last = None;
                for step in 0..=500 {
                    let share = f64::from(step) * 2e-7;
                    let pose = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
                    let value = lookup.value_and_gradient(&field, &pose).0;
                    assert!(last.is_none_or(|last: f64| (value - last).abs() < 2e-3), "{pose:?}: {value} {last:?}");
                    last = Some(value);
                }
            }
            // Through the poles and the middles of all faces of the table of hints.
            for pitch in [-PI / 2.0, PI / 2.0, 0.0, PI / 4.0] {
                for yaw in [0.0, PI / 4.0, PI / 2.0, PI] {
                    let [x, y, z, ..] = grid.pose(0);
                    let values = [-1e-9, 1e-9].map(|by| {
                        [[by, 0.0], [0.0, by]]
                            .map(|[p, q]| lookup.value_and_gradient(&field, &[x, y, z, 0.3, pitch + p, yaw + q]).0)
                    });
                    let values = values.concat();
                    assert!(values.iter().all(|value| (value - values[0]).abs() < 1e-6), "{values:?}");
                }
            }
        }
    }

    /// All numbers for the same rotation have its value: the lookup is by rotation.
    #[test]
    fn numbers_of_one_rotation_have_one_value() {
        for grid in grids() {
            let (field, lookup, mut draws) = (random_field(&grid), FieldLookup::new(&grid, METRES), Draws(4));
            for _ in 0..500 {
                let [x, y, z, roll, pitch, yaw] = random_pose(&grid, &mut draws, [0.0, 1.0]);
                let value =
                    |angles: [f64; 3]| lookup.value_and_gradient(&field, &[x, y, z, angles[0], angles[1], angles[2]]).0;
                let plain = value([roll, pitch, yaw]);
                for other in [[roll + PI, PI - pitch, yaw + PI], [roll + TAU, pitch - TAU, yaw - 3.0 * TAU]] {
                    assert!((value(other) - plain).abs() < 1e-9);
                }
            }
        }
    }

    /// By trying all orientations.
    #[test]
    fn the_nearest_cell_is_nearest_by_angle() {
        for grid in grids() {
            let mut draws = Draws(7);
            for _ in 0..2_000 {
                let pose = random_pose(&grid, &mut draws, [-0.3, 1.3]);
                let cell = grid.nearest(pose);
                let rotation = rotation_from_rpy(pose[3], pose[4], pose[5]);
                let angle = |orientation: usize| grid.rotation(orientation).angle_to(&rotation);
                let min = (0..grid.orientations()).map(angle).fold(f64::INFINITY, f64::min);
                assert!(angle(cell % grid.orientations()) < min + 1e-7);
                assert!(angle(cell % grid.orientations()) <= grid.covering().radius + 1e-9);
            }
        }
    }

    #[test]
    fn outside_the_distance_to_the_box_is_added_and_odd_poses_are_answered() {
        let grid = &grids()[0];
        let lookup = FieldLookup::new(grid, METRES);
        let last = grid.pose(grid.cells() - 1);
        let (value, gradient) = lookup
            .value_and_gradient(&vec![0.5; grid.cells()], &[last[0] + 0.3, last[1] + 0.4, last[2], 9.0, 9.0, 9.0]);
        assert!((value - 1.0).abs() < 1e-12, "{value}");
        assert!((gradient[0] - 0.6).abs() < 1e-12 && (gradient[1] - 0.8).abs() < 1e-12, "{gradient:?}");
        for k in 0..6 {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut pose = last;
                pose[k] = bad;
                assert!(lookup.value_and_gradient(&vec![0.5; grid.cells()], &pose).0.is_nan());
            }
            let mut pose = last;
            pose[k] = 1e300;
            assert!(!lookup.value_and_gradient(&vec![0.5; grid.cells()], &pose).0.is_nan());
        }
        let PoseGrid::Sphere(sphere) = grid else { panic!("a grid of directions") };
        let field = signed_distance_sphere(&vec![true; grid.cells()], sphere, 0.127);
        assert_eq!(lookup.value_and_gradient(&field, &last), (f64::NEG_INFINITY, [0.0; 6]));
    }
}
