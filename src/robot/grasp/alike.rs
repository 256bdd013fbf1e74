//! Which grasps of a hand are alike: one definition for all samplers. The tolerances are arguments.

use std::f64::consts::PI;

use nalgebra::IsometryMatrix3;

use super::frame::Frame;

/// Nearness at which two frames of a hand count as one. The relation is not transitive, so results depend on the order in which
/// frames are compared; every sampler compares each with those that it kept before, in drawing order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likeness {
    /// Between their origins, below this [m].
    distance: f64,
    /// Cosine of the angle between their rotations, above this.
    cos: f64,
    /// Whether a frame and the one rotated by 180 degrees about its z axis count as one.
    half_turn: bool,
}

impl Likeness {
    /// Grasps of every sampler of pairs, on every object: 20 mm and 15 degrees, with the symmetry of the hand.
    ///
    /// The origin of the compared frames is the middle between the pads of a gripper, else that of the approach frame; z is the
    /// approach.
    pub(super) fn of_grasps(half_turn: bool) -> Self {
        Self { distance: 0.02, cos: libm::cos(PI / 12.0), half_turn }
    }

    /// Duplicates of a search on an object of this radius [m]: max(|between their origins| / radius, angle between their
    /// rotations / 2 pi) is below 0.2.
    pub(super) fn of_search(radius: f64) -> Self {
        Self { distance: 0.2 * radius, cos: COS_APART, half_turn: false }
    }

    /// Whether the least of max(|between their origins| / distance, angle between their rotations / angle) over the symmetries
    /// of the hand is below 1.
    pub(super) fn are_alike(&self, one: &Frame, other: &Frame) -> bool {
        if (one.origin - other.origin).norm_squared() >= self.distance * self.distance {
            return false;
        }
        // tr(A^T B) = 1 + 2 cos(angle); the angle is below 180 degrees.
        let [x, y, z] = [0, 1, 2].map(|axis| one.rotation.column(axis).dot(&other.rotation.column(axis)));
        let min = 1.0 + 2.0 * self.cos;
        // With the symmetry tr(A^T B diag(-1, -1, 1)), too.
        x + y + z > min || self.half_turn && z - x - y > min
    }
}

/// cos(0.4 pi).
const COS_APART: f64 = 0.309_016_994_374_947_45;

/// Grasps that a run has, no two alike.
#[derive(Clone, Debug)]
pub(super) struct KnownGrasps {
    likeness: Likeness,
    frames: Vec<Frame>,
}

impl KnownGrasps {
    /// No grasps yet, of a hand with or without the symmetry
    /// ([`HandSearch::is_half_turn_symmetric`](super::HandSearch::is_half_turn_symmetric)).
    pub(super) fn new(half_turn: bool) -> Self {
        Self { likeness: Likeness::of_grasps(half_turn), frames: Vec::new() }
    }

    /// Whether a grasp is like a known one.
    pub(super) fn has(&self, frame: &Frame) -> bool {
        self.frames.iter().any(|known| self.likeness.are_alike(known, frame))
    }

    /// Remembers a grasp.
    pub(super) fn add(&mut self, frame: Frame) {
        self.frames.push(frame);
    }
}

/// Grasps of an object that are apart as the best states of a search are: of any two, max(|between the origins of their approach
/// frames| / radius, angle between their rotations / 2 pi) is at least 0.2.
#[derive(Clone, Debug)]
pub struct DistinctGrasps(KnownGrasps);

impl DistinctGrasps {
    /// No grasps yet, of an object whose box has half this diagonal [m].
    pub fn new(radius: f64) -> Self {
        Self(KnownGrasps { likeness: Likeness::of_search(radius), frames: Vec::new() })
    }

    /// Whether a grasp is apart from all that were added, by its approach frame.
    pub fn is_apart(&self, object_from_approach: &IsometryMatrix3<f64>) -> bool {
        !self.0.has(&Frame::of(object_from_approach))
    }

    /// Adds a grasp.
    pub fn add(&mut self, object_from_approach: &IsometryMatrix3<f64>) {
        self.0.add(Frame::of(object_from_approach));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Rotation3, Vector3};
    use proptest::prelude::*;

    fn rotation() -> impl Strategy<Value = Rotation3<f64>> {
        [-3.0..3.0, -1.5..1.5, -3.0..3.0f64]
            .prop_map(|[roll, pitch, yaw]| kernel::geom::rotation_from_rpy(roll, pitch, yaw))
    }

    fn frame(rotation: &Rotation3<f64>, x: f64) -> Frame {
        Frame { rotation: *rotation.matrix(), origin: Vector3::new(x, 0.0, 0.0) }
    }

    proptest! {
        #[test]
        fn grasps_are_alike_by_the_least_angle_over_the_symmetries(one in rotation(), by in rotation(), x in 0.0..0.04f64) {
            let other = one * by;
            let half_turn = Rotation3::from_matrix_unchecked(Matrix3::from_diagonal(&[-1.0, -1.0, 1.0].into()));
            let angles = [by.angle(), (one.inverse() * other * half_turn).angle()];
            let max = std::f64::consts::PI / 12.0;
            for (symmetric, angle) in [(false, angles[0]), (true, angles[0].min(angles[1]))] {
                let likeness = Likeness::of_grasps(symmetric);
                let expected = x < 0.02 && angle < max;
                prop_assert_eq!(likeness.are_alike(&frame(&one, 0.0), &frame(&other, x)), expected);
                prop_assert_eq!(likeness.are_alike(&frame(&other, x), &frame(&one, 0.0)), expected, "symmetric");
                // With a half turn twice, the frame is the same.
                let turned = frame(&(other * half_turn), x);
                prop_assert!(!symmetric || likeness.are_alike(&frame(&one, 0.0), &turned) == expected);
            }
        }
    }

    #[test]
    fn a_half_turn_about_the_approach_is_alike_and_one_about_another_axis_is_not() {
        let likeness = Likeness::of_grasps(true);
        let here = frame(&Rotation3::identity(), 0.0);
        for (axis, is_alike) in [(Vector3::z_axis(), true), (Vector3::x_axis(), false), (Vector3::y_axis(), false)] {
            for off in [0.0, 0.2] {
                let other = Rotation3::from_axis_angle(&axis, std::f64::consts::PI - off);
                assert_eq!(likeness.are_alike(&here, &frame(&other, 0.01)), is_alike);
                assert!(!Likeness::of_grasps(false).are_alike(&here, &frame(&other, 0.01)));
            }
        }
    }

    #[test]
    fn known_grasps_are_found_within_the_tolerances_alone() {
        let at = |x: f64, angle: f64| {
            let rotation = Rotation3::from_euler_angles(0.3, -0.4, 0.5);
            frame(&(rotation * Rotation3::from_axis_angle(&Vector3::z_axis(), angle)), x)
        };
        for half_turn in [false, true] {
            let mut known = KnownGrasps::new(half_turn);
            assert!(!known.has(&at(0.0, 0.0)));
            known.add(at(0.0, 0.0));
            assert!(known.has(&at(0.019, 0.25)) && !known.has(&at(0.021, 0.0)) && !known.has(&at(0.0, 0.27)));
            assert_eq!(known.has(&at(0.0, PI + 0.1)), half_turn);
        }
    }
}
