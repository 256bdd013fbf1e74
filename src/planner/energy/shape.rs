//! Shape of a hand in the space in which canonical grasp types are near or far: spread, three flexions, and the wrist's roll.

use std::f64::consts::TAU;

use nalgebra::Matrix3;

use kernel::words::TYPE_BINS;
use robot::grasp::{KindDigits, wrist_roll};

/// Shape of a hand with one spread and three fingers [rad].
///
/// Canonical types (thesis, 4.1.3) are binned from closed joints, and a state that is searched is open: each type is compared by
/// the [median](Self::median) of the postures before closing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandShape {
    /// Spread of the fingers.
    pub spread: f64,
    /// Flexions of the proximal joints of fingers 1 to 3.
    pub flexions: [f64; 3],
    /// Roll of the hand about its approach against an upright camera, -pi to pi.
    pub roll: f64,
}

impl HandShape {
    /// Shape of a hand whose joints have these values, in the order of its tree [rad]. `rotation` is that of the approach frame,
    /// expressed in a frame whose z axis is up.
    pub fn of(digits: &KindDigits, joints: &[f64], rotation: &Matrix3<f64>) -> Self {
        let [spread, flexions @ ..] = digits.opened_joints(joints);
        Self { spread, flexions, roll: wrist_roll(rotation) }
    }

    /// Distance from another shape, in bins of the grasp types (thesis, equation 4.1): the L2 norm over spread, flexions and roll, the
    /// shorter direction of the roll, which has five bins per revolution.
    pub fn distance(&self, other: &Self) -> f64 {
        let bins = f64::from(TYPE_BINS);
        let [spread, flexion] =
            [KindDigits::SPREAD_RANGE, KindDigits::PROXIMAL_RANGE].map(|[low, high]| bins / (high - low));
        let mut squares = ((self.spread - other.spread) * spread).powi(2);
        for (one, other) in self.flexions.iter().zip(&other.flexions) {
            squares += ((one - other) * flexion).powi(2);
        }
        let apart = ((self.roll - other.roll) * bins / TAU).rem_euclid(bins);
        squares += apart.min(bins - apart).powi(2);
        squares.sqrt()
    }

    /// The median shape of a type's grasps: of the spread and of each flexion, and the roll with the smallest sum of circular
    /// distances from the others, the first of equals. `None` of no shape.
    pub fn median(shapes: &[Self]) -> Option<Self> {
        let rolls = shapes.iter().map(|shape| shape.roll);
        let sum = |roll: f64| {
            let apart = |other: f64| (roll - other).rem_euclid(TAU);
            rolls.clone().map(|other| apart(other).min(TAU - apart(other))).sum::<f64>()
        };
        let roll = rolls.clone().min_by(|one, other| sum(*one).total_cmp(&sum(*other)))?;
        let of = |part: &dyn Fn(&Self) -> f64| {
            let mut values: Vec<f64> = shapes.iter().map(part).collect();
            values.sort_by(f64::total_cmp);
            f64::midpoint(values[(values.len() - 1) / 2], values[values.len() / 2])
        };
        let flexions = std::array::from_fn(|finger| of(&|shape: &Self| shape.flexions[finger]));
        Some(Self { spread: of(&|shape: &Self| shape.spread), flexions, roll })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const AT: HandShape = HandShape { spread: 1.0, flexions: [0.5, 0.6, 0.7], roll: 3.1 };

    #[test]
    fn distances_are_counted_in_bins_and_the_roll_wraps() {
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        close(AT.distance(&HandShape { spread: 1.0 + PI / 5.0, ..AT }), 1.0);
        close(AT.distance(&HandShape { flexions: [0.5, 0.6 + 2.44 / 5.0, 0.7], ..AT }), 1.0);
        close(AT.distance(&HandShape { roll: 3.1 + TAU / 5.0 - TAU, ..AT }), 1.0);
        close(AT.distance(&HandShape { roll: -3.1, ..AT }), (TAU - 6.2) * 5.0 / TAU);
        close(AT.distance(&HandShape { roll: 3.1 - PI, ..AT }), 2.5);
        assert!(AT.distance(&HandShape { roll: f64::NAN, ..AT }).is_nan());
    }

    #[test]
    fn the_median_roll_is_found_across_the_end_of_the_circle() {
        let shapes = [3.1, -3.1, 3.0, 0.2].map(|roll| HandShape { roll, spread: roll, ..AT });
        let median = HandShape::median(&shapes).expect("shapes");
        assert_eq!((median.roll, median.spread), (3.1, f64::midpoint(0.2, 3.0)));
        assert_eq!(HandShape::median(&[]), None);
    }
}
