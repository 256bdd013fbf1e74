//! Which grasps are alike: hands less than 20 mm and 15 degrees apart, up to the hand's own symmetry.

use std::f64::consts::PI;

use nalgebra::{IsometryMatrix3, Matrix3, Point3};

use super::super::solids::HandSolids;
use crate::hand::Hand;
use kernel::geom::Shape;

/// Hands whose middles between the pads are nearer than this can be alike [m].
const DISTANCE: f64 = 0.02;

/// Hands whose rotations differ by less than this can be alike [rad].
const ANGLE: f64 = PI / 12.0;

/// Two solids whose places differ by less than this are mirror images [m].
const SAME: f64 = 1e-4;

/// The half turn about z.
const HALF_TURN: [f64; 3] = [-1.0, -1.0, 1.0];

/// Where a hand is: the middle between its pads, and the rotation of its approach frame, expressed in `Object`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) middle: Point3<f64>,
    pub(super) rotation: Matrix3<f64>,
}

/// Whether grasps of a hand are alike. The relation is not transitive: of a sequence, each is compared with those kept before.
pub(super) struct Unlike {
    /// Whether the hand is the same after half a turn about its approach.
    is_symmetric: bool,
    /// Trace of a rotation by [`ANGLE`].
    trace: f64,
}

impl Unlike {
    /// For a hand whose links have these frames, expressed in the base frame, with a middle between its pads.
    pub(super) fn new(hand: &Hand, solids: &HandSolids, frames: &[IsometryMatrix3<f64>], middle: &Point3<f64>) -> Self {
        let approach = hand.approach_pose(frames).isometry().rotation;
        let half_turn = approach * Matrix3::from_diagonal(&HALF_TURN.into()) * approach.inverse();
        let placed: Vec<(&Shape, IsometryMatrix3<f64>)> =
            solids.solids.iter().map(|solid| (&solid.shape, solid.base_from_shape(frames))).collect();
        let has_image = |(shape, pose): &(&Shape, IsometryMatrix3<f64>)| {
            let centre = middle + half_turn * (Point3::from(pose.translation.vector) - middle);
            let axes = half_turn * pose.rotation.matrix();
            placed.iter().any(|(other, place)| {
                other == shape
                    && (place.translation.vector - centre.coords).norm() < SAME
                    && is_same(shape, &(place.rotation.matrix().transpose() * axes))
            })
        };
        Self { is_symmetric: placed.iter().all(has_image), trace: 1.0 + 2.0 * libm::cos(ANGLE) }
    }

    /// Whether two grasps are alike: max(distance / 20 mm, angle / 15 degrees) is below 1, at the better of the hand's symmetries.
    pub(super) fn are_alike(&self, one: &Held, other: &Held) -> bool {
        if (one.middle - other.middle).norm_squared() >= DISTANCE * DISTANCE {
            return false;
        }
        let between = one.rotation.tr_mul(&other.rotation);
        let trace = |signs: [f64; 3]| (0..3).map(|axis| signs[axis] * between[(axis, axis)]).sum::<f64>();
        trace([1.0; 3]) > self.trace || self.is_symmetric && trace(HALF_TURN) > self.trace
    }
}

/// Whether a rotation about a shape's own frame leaves it as it is.
fn is_same(shape: &Shape, rotation: &Matrix3<f64>) -> bool {
    let along = |axis: usize| (rotation[(axis, axis)].abs() - 1.0).abs() < SAME;
    match shape {
        Shape::Sphere { .. } => true,
        Shape::Capsule { .. } | Shape::Cylinder { .. } => along(2),
        Shape::Box { .. } => (0..3).all(along),
        Shape::Mesh(_) => rotation.relative_eq(&Matrix3::identity(), SAME, SAME),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    #[test]
    fn hands_are_alike_up_to_half_a_turn_about_their_approach() {
        let [plain, symmetric] =
            [false, true].map(|is_symmetric| Unlike { is_symmetric, trace: 1.0 + 2.0 * libm::cos(ANGLE) });
        let held = |x: f64, rotation: Rotation3<f64>| Held {
            middle: Point3::new(x, 0.0, 0.0),
            rotation: rotation.into_inner(),
        };
        let at = |angle: f64| {
            Rotation3::from_euler_angles(0.3, -0.4, 0.5) * Rotation3::from_axis_angle(&Vector3::z_axis(), angle)
        };
        let first = held(0.0, at(0.0));
        for unlike in [&plain, &symmetric] {
            assert!(unlike.are_alike(&first, &held(0.019, at(0.25))));
            assert!(!unlike.are_alike(&first, &held(0.021, at(0.0))));
            assert!(!unlike.are_alike(&first, &held(0.0, at(0.27))));
        }
        assert!(symmetric.are_alike(&first, &held(0.0, at(PI + 0.1))));
        assert!(!plain.are_alike(&first, &held(0.0, at(PI + 0.1))));
        let upside_down = at(0.0) * Rotation3::from_axis_angle(&Vector3::x_axis(), PI);
        assert!(!symmetric.are_alike(&first, &held(0.0, upside_down)));
    }
}
