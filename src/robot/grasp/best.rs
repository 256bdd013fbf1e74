//! The best states of a run, each far from the others.

use super::{frame::Frame, variables::State};

/// Two states of a search that are nearer are duplicates.
const APART: f64 = 0.2;

/// Grasps whose positions and rotations differ by less than these count as alike, for every object [m, rad].
const ALIKE: [f64; 2] = [0.02, std::f64::consts::PI / 12.0];

/// A state of the best list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) energy: f64,
    pub(super) object_from_approach: Frame,
    pub(super) state: State,
}

/// Nearness at which two approach frames count as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Likeness {
    /// Between their positions, below this [m].
    distance: f64,
    /// Cosine of the angle between their rotations, above this.
    cos: f64,
    /// Whether a frame and the one rotated by half a turn about its z axis count as one.
    half_turn: bool,
}

impl Likeness {
    /// Duplicates of a search on an object of this radius [m]: max(|between their positions| / radius, angle between their
    /// rotations / 2 pi) is below [`APART`].
    pub(super) fn of_search(radius: f64) -> Self {
        Self { distance: APART * radius, cos: COS_APART, half_turn: false }
    }

    /// Grasps that are alike: the least of max(|between their positions| / 20 mm, angle between their rotations / 15 degrees)
    /// over the symmetries of the hand, which may have a half turn about the approach, is below 1 ([`ALIKE`]).
    pub(super) fn of_grasps(half_turn: bool) -> Self {
        Self { distance: ALIKE[0], cos: libm::cos(ALIKE[1]), half_turn }
    }

    /// Whether two frames count as one.
    pub(super) fn joins(&self, one: &Frame, other: &Frame) -> bool {
        if (one.origin - other.origin).norm_squared() >= self.distance * self.distance {
            return false;
        }
        // trace = 1 + 2 cos(angle); the angle is below half a turn.
        let [x, y, z] = [0, 1, 2].map(|axis| one.rotation.column(axis).dot(&other.rotation.column(axis)));
        let min = 1.0 + 2.0 * self.cos;
        // tr(A^T B diag(-1, -1, 1)) after half a turn.
        x + y + z > min || self.half_turn && z - x - y > min
    }
}

/// cos(0.4 pi).
const COS_APART: f64 = 0.309_016_994_374_947_45;

/// The best list: best first.
pub(super) struct BestList {
    max: usize,
    likeness: Likeness,
    list: Vec<Candidate>,
}

impl BestList {
    pub(super) fn new(max: usize) -> Self {
        Self { max, likeness: Likeness::of_search(1.0), list: Vec::with_capacity(max + 1) }
    }

    /// Begins again, on an object of this radius [m].
    pub(super) fn clear(&mut self, radius: f64) {
        self.likeness = Likeness::of_search(radius);
        self.list.clear();
    }

    pub(super) fn list(&self) -> &[Candidate] {
        &self.list
    }

    /// Takes a state in where it is good enough; of duplicates the better stays.
    pub(super) fn offer(&mut self, energy: f64, object_from_approach: &Frame, state: &State) {
        if self.list.len() == self.max && self.list.last().is_some_and(|worst| energy >= worst.energy) {
            return;
        }
        let likeness = self.likeness;
        let is_same = |known: &Candidate| likeness.joins(&known.object_from_approach, object_from_approach);
        if self.list.iter().take_while(|known| known.energy <= energy).any(is_same) {
            return;
        }
        self.list.retain(|known| known.energy <= energy || !is_same(known));
        let index = self.list.partition_point(|known| known.energy <= energy);
        self.list.insert(index, Candidate { energy, object_from_approach: *object_from_approach, state: *state });
        self.list.truncate(self.max);
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
                prop_assert_eq!(likeness.joins(&frame(&one, 0.0), &frame(&other, x)), expected);
                prop_assert_eq!(likeness.joins(&frame(&other, x), &frame(&one, 0.0)), expected, "symmetric");
                // With a half turn twice, the frame is the same.
                let turned = frame(&(other * half_turn), x);
                prop_assert!(!symmetric || likeness.joins(&frame(&one, 0.0), &turned) == expected);
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
                assert_eq!(likeness.joins(&here, &frame(&other, 0.01)), is_alike);
                assert!(!Likeness::of_grasps(false).joins(&here, &frame(&other, 0.01)));
            }
        }
    }
}
