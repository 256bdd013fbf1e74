//! Grasp types (thesis, equation 4.1): the joints of the closed hand and its roll, binned.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use crate::hand::Hand;
use kernel::words::{TYPE_BINS, TYPE_DIGITS};

/// Angle between a direction of sight and the world's z axis [rad] below which the x axis is up.
const NEARLY_UP: f64 = PI / 36.0;

/// Joints of a hand that are binned into digits: indices in its tree of joints, in the order of the digits, with the
/// range of each [rad].
#[derive(Clone, Debug, PartialEq)]
pub struct KindDigits {
    joints: [(usize, [f64; 2]); TYPE_DIGITS - 1],
}

impl KindDigits {
    /// Range of the spread that is binned [rad].
    pub const SPREAD_RANGE: [f64; 2] = [0.0, PI];
    /// Range of each proximal joint that is binned [rad].
    pub const PROXIMAL_RANGE: [f64; 2] = [0.0, 2.44];

    /// Digits for a hand with one joint that spreads its fingers and three fingers of two joints, each closed by its
    /// own motor, like a Barrett hand. `None` for every other hand.
    pub fn new(hand: &Hand) -> Option<Self> {
        let (closing, spreading): (Vec<_>, Vec<_>) =
            hand.driven().iter().partition(|driven| driven.closing_sign() != 0.0);
        let [spread] = spreading[..] else { return None };
        let [a, b, c] = closing[..] else { return None };
        let distal = |driven: &crate::hand::Driven| match &driven.followers[..] {
            [follower] => Some(follower.joint),
            _ => None,
        };
        let (full, proximal, tip) = (Self::SPREAD_RANGE, Self::PROXIMAL_RANGE, [0.0, 0.84]);
        Some(Self {
            joints: [
                (spread.joint, full),
                (a.joint, proximal),
                (b.joint, proximal),
                (c.joint, proximal),
                (distal(a)?, tip),
                (distal(b)?, tip),
                (distal(c)?, tip),
            ],
        })
    }

    /// Values of the joints that shape a hand before it closes: the spread, and the proximal joints of fingers 1 to 3 [rad]. `joints`
    /// are all values in the tree's order.
    pub fn opened_joints(&self, joints: &[f64]) -> [f64; 4] {
        std::array::from_fn(|digit| joints[self.joints[digit].0])
    }

    /// The type of a closed hand, `sum of bin_i 5^i`: below 390,625. `joints` are all values in the tree's order, `rotation` is
    /// that of the approach frame expressed in the object's frame.
    pub fn kind(&self, joints: &[f64], rotation: &Matrix3<f64>) -> u32 {
        let fingers = self.joints.iter().map(|(joint, range)| bin(joints[*joint], *range));
        let digits = fingers.chain([bin(wrist_roll(rotation), [-PI, PI])]);
        digits.zip(0..).map(|(digit, exponent)| digit * TYPE_BINS.pow(exponent)).sum()
    }
}

/// A grasp type with another digit of the roll: that of the hand against an upright camera in the frame in which `rotation`, the
/// approach frame's, is expressed.
pub fn kind_in_frame(kind: u32, rotation: &Matrix3<f64>) -> u32 {
    let digit = TYPE_BINS.pow(TYPE_DIGITS as u32 - 1);
    kind % digit + bin(wrist_roll(rotation), [-PI, PI]) * digit
}

fn bin(value: f64, [low, high]: [f64; 2]) -> u32 {
    let share = f64::from(TYPE_BINS) * (value - low) / (high - low);
    share.floor().clamp(0.0, f64::from(TYPE_BINS - 1)) as u32
}

/// Roll of the hand about its approach against a camera that points along it, upright [rad], from -pi to pi: the angle from
/// the camera's x axis (to the right) to the approach frame's. Up is the object's z axis, or its x axis where the approach is
/// within 5 degrees of that.
pub fn wrist_roll(rotation: &Matrix3<f64>) -> f64 {
    let [right, down] = camera_axes(&rotation.column(2).into_owned());
    let x = rotation.column(0);
    libm::atan2(x.dot(&down), x.dot(&right))
}

/// The axes to the right and down of an upright camera that points along a direction, in the same frame.
pub fn camera_axes(sight: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let up = if sight.z.abs() > libm::cos(NEARLY_UP) { Vector3::x() } else { Vector3::z() };
    let right = sight.cross(&up).normalize();
    [right, sight.cross(&right)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::words::type_digits;

    #[test]
    fn bins_end_where_the_ranges_do() {
        assert_eq!([-1.0, 0.0, 0.487, 0.489, 2.44, 9.0].map(|value| bin(value, [0.0, 2.44])), [0, 0, 0, 1, 4, 4]);
        assert_eq!(type_digits(5 + 3 * 125 + 4 * 78_125), [0, 1, 0, 3, 0, 0, 0, 4]);
    }

    #[test]
    fn another_frame_changes_the_digit_of_the_roll_alone() {
        let fingers = 3 + 2 * 25 + 15_625;
        for kind in [fingers, fingers + 4 * 78_125] {
            // Above the hand's approach x is up, to the right y: its own x axis rolls from -pi, the middle digit is straight ahead.
            for (roll, digit) in [(-3.0, 0), (0.0, 2), (3.0, 4)] {
                let (sin, cos) = libm::sincos(roll);
                let [right, down] = camera_axes(&-Vector3::z());
                let x = right * cos + down * sin;
                let rotation = Matrix3::from_columns(&[x, (-Vector3::z()).cross(&x), -Vector3::z()]);
                assert_eq!(kind_in_frame(kind, &rotation), fingers + digit * 78_125);
            }
        }
    }

    #[test]
    fn roll_is_against_an_upright_camera() {
        // With the camera along y and z up, right is x.
        let [right, down] = camera_axes(&Vector3::y());
        assert_eq!((right, down), (Vector3::x(), -Vector3::z()));
        for roll in [-2.5, -0.3, 0.0, 1.2, 3.0] {
            let (sin, cos) = libm::sincos(roll);
            let x = right * cos + down * sin;
            let rotation = Matrix3::from_columns(&[x, Vector3::y().cross(&x), Vector3::y()]);
            assert!((wrist_roll(&rotation) - roll).abs() < 1e-12);
        }
        // Straight down.
        let [right, down] = camera_axes(&-Vector3::z());
        assert!(right.dot(&Vector3::x()).abs() < 1e-12 && (down + Vector3::x()).norm() < 1e-12);
    }
}
