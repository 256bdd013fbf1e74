//! The orientation of an object in each view.

use std::{collections::BTreeMap, f64::consts::PI};

use nalgebra::{Quaternion, Rotation3, UnitQuaternion};

use super::frames::rotation_from_rpy;

/// An ordered set of rotations of the object, world from object.
#[derive(Clone, Debug, PartialEq)]
pub enum ViewSet {
    /// Every combination of roll, pitch and yaw [rad], R = Rz(yaw) Ry(pitch) Rx(roll). Index (a, b, c) over
    /// (roll, pitch, yaw), c fastest.
    RollPitchYaw {
        /// Roll angles [rad].
        roll: Vec<f64>,
        /// Pitch angles [rad].
        pitch: Vec<f64>,
        /// Yaw angles [rad].
        yaw: Vec<f64>,
    },
    /// This many rotations spread evenly over SO(3); see [`super_fibonacci`].
    Even {
        /// Number of views.
        count: u32,
    },
    /// Rotations one by one.
    List(Vec<Rotation3<f64>>),
}

/// `from`, ..., `to` in `count` equal steps, both ends included.
pub fn closed_linspace(from: f64, to: f64, count: u32) -> Vec<f64> {
    let steps = f64::from(count.saturating_sub(1).max(1));
    (0..count).map(|k| if k + 1 == count && k > 0 { to } else { from + (to - from) * f64::from(k) / steps }).collect()
}

/// `from`, ... in `count` equal steps that end one step before `to`: a full revolution without its first angle twice.
pub fn open_linspace(from: f64, to: f64, count: u32) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * f64::from(k) / f64::from(count)).collect()
}

impl ViewSet {
    /// The `thesis` grid: 11 x 6 x 11 = 726 views, closed at both ends, so that only 420 rotations differ.
    ///
    /// The thesis (section 5.3) states only "uniformly in roll-pitch-yaw space, 11*6*11"; the ends are our reading.
    pub fn thesis() -> Self {
        Self::RollPitchYaw {
            roll: closed_linspace(-PI, PI, 11),
            pitch: closed_linspace(-PI / 2.0, PI / 2.0, 6),
            yaw: closed_linspace(-PI, PI, 11),
        }
    }

    /// The `standard` grid: 11 x 6 x 11 = 726 different rotations; roll and yaw stop one step before the full revolution,
    /// pitch runs from -75 to 75 degrees.
    pub fn standard() -> Self {
        Self::RollPitchYaw {
            roll: open_linspace(-PI, PI, 11),
            pitch: closed_linspace(-75.0, 75.0, 6).into_iter().map(|degrees| degrees / 180.0 * PI).collect(),
            yaw: open_linspace(-PI, PI, 11),
        }
    }

    /// The object upright, seen at its own height from 12 sides.
    pub fn head_on() -> Self {
        Self::RollPitchYaw { roll: vec![0.0], pitch: vec![0.0], yaw: open_linspace(-PI, PI, 12) }
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        match self {
            Self::RollPitchYaw { roll, pitch, yaw } => roll.len() * pitch.len() * yaw.len(),
            Self::Even { count } => *count as usize,
            Self::List(rotations) => rotations.len(),
        }
    }

    /// Whether there is no view.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The rotation of a view.
    ///
    /// # Panics
    /// If `view` is not below [`ViewSet::len`].
    pub fn rotation(&self, view: usize) -> Rotation3<f64> {
        match self {
            Self::RollPitchYaw { roll, pitch, yaw } => {
                let (a, rest) = (view / (pitch.len() * yaw.len()), view % (pitch.len() * yaw.len()));
                rotation_from_rpy(roll[a], pitch[rest / yaw.len()], yaw[rest % yaw.len()])
            }
            Self::Even { count } => {
                assert!(view < *count as usize, "view {view} of {count}");
                super_fibonacci(view as u32, *count)
            }
            Self::List(rotations) => rotations[view],
        }
    }

    /// Which views show the same rotation: for each view, the lowest view with an equal rotation. Rotations
    /// whose matrices agree within 1e-9 are equal, those that differ by more than 1e-6 are not. Linear in the count of
    /// views, up to a logarithm.
    pub fn equal_rotations(&self) -> Vec<u32> {
        let mut first_of = BTreeMap::new();
        (0..self.len())
            .map(|view| {
                let keys = matrix_keys(&self.rotation(view));
                let found = keys.iter().find_map(|key| first_of.get(key).copied()).unwrap_or(view as u32);
                for key in keys {
                    first_of.entry(key).or_insert(found);
                }
                found
            })
            .collect()
    }

    /// Number of rotations that differ.
    pub fn distinct_rotations(&self) -> usize {
        self.equal_rotations().iter().enumerate().filter(|(view, first)| *view == **first as usize).count()
    }
}

/// Cells of side 1e-6 that hold the nine entries of a matrix: one key, or several where an entry lies within 1e-9 of
/// the border of its cell, so that two equal rotations always share a key.
fn matrix_keys(rotation: &Rotation3<f64>) -> Vec<[i32; 9]> {
    const CELL: f64 = 1e-6;
    const SAME: f64 = 1e-9;
    // Shifts the borders away from 0, 1/2 and 1, the entries of most rotations in a grid.
    const SHIFT: f64 = 0.347_296_355;
    let mut keys = vec![[0; 9]];
    for (index, entry) in rotation.matrix().iter().enumerate() {
        let cell_of = |value: f64| (value / CELL + SHIFT).floor() as i32;
        let (low, high) = (cell_of(entry - SAME), cell_of(entry + SAME));
        keys.iter_mut().for_each(|key| key[index] = low);
        if high != low {
            let others: Vec<_> = keys
                .iter()
                .map(|key| {
                    let mut other = *key;
                    other[index] = high;
                    other
                })
                .collect();
            keys.extend(others);
        }
    }
    keys
}

/// Rotation `index` of `count` on a super-Fibonacci spiral (Alexa 2022, "Super-Fibonacci Spirals: Fast, Low-Discrepancy
/// Sampling of SO(3)", CVPR, algorithm 1): phi^2 = 2 and psi the root of psi^4 = psi + 4 near 1.53.
///
/// The paper's quaternion is taken in the order (x, y, z, w). `libm`, so the same bits everywhere.
pub fn super_fibonacci(index: u32, count: u32) -> Rotation3<f64> {
    const PHI: f64 = std::f64::consts::SQRT_2;
    const PSI: f64 = 1.533_751_168_755_204_2;
    let s = f64::from(index) + 0.5;
    let t = s / f64::from(count);
    let angle = 2.0 * PI * s;
    let (inner, outer) = (libm::sqrt(t), libm::sqrt(1.0 - t));
    let ((sin_a, cos_a), (sin_b, cos_b)) = (libm::sincos(angle / PHI), libm::sincos(angle / PSI));
    rotation_from_quaternion([outer * cos_b, inner * sin_a, inner * cos_a, outer * sin_b])
}

/// The rotation of a quaternion in the order (w, x, y, z), of any length above zero.
pub fn rotation_from_quaternion([w, x, y, z]: [f64; 4]) -> Rotation3<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_rotation_matrix()
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn the_thesis_grid_holds_420_rotations_and_the_standard_grid_726() {
        let (thesis, standard) = (ViewSet::thesis(), ViewSet::standard());
        assert_eq!((thesis.len(), thesis.distinct_rotations()), (726, 420));
        assert_eq!((standard.len(), standard.distinct_rotations()), (726, 726));
    }

    #[test]
    fn equal_rotations_agree_with_comparing_every_pair() {
        let views = ViewSet::thesis();
        let first = views.equal_rotations();
        for (view, found) in first.into_iter().enumerate() {
            let rotation = views.rotation(view);
            let expected = (0..=view)
                .find(|other| (views.rotation(*other).matrix() - rotation.matrix()).abs().max() < 1e-9)
                .expect("a view equals itself");
            assert_eq!(found as usize, expected, "view {view}");
        }
    }

    #[test]
    fn linspace_meets_its_ends() {
        assert_eq!(closed_linspace(-1.0, 1.0, 5), [-1.0, -0.5, 0.0, 0.5, 1.0]);
        assert_eq!(open_linspace(0.0, 1.0, 4), [0.0, 0.25, 0.5, 0.75]);
        assert_eq!(closed_linspace(3.0, 9.0, 1), [3.0]);
        assert_eq!(closed_linspace(-PI, PI, 11)[10], PI);
    }

    #[test]
    fn the_even_spread_is_even() {
        let views = ViewSet::Even { count: 4000 };
        assert_eq!(views.distinct_rotations(), 4000);
        // Uniform on SO(3): the mean matrix vanishes, and the trace of R^T Q for a fixed Q averages to 0 with a
        // second moment of 1 (the character of the vector representation).
        for reference in [Rotation3::identity(), rotation_from_rpy(0.3, -1.1, 2.0)] {
            let traces: Vec<f64> =
                (0..4000).map(|view| (views.rotation(view).inverse() * reference).matrix().trace()).collect();
            let mean = traces.iter().sum::<f64>() / 4000.0;
            let second = traces.iter().map(|trace| trace * trace).sum::<f64>() / 4000.0;
            assert!(mean.abs() < 0.01 && (second - 1.0).abs() < 0.02, "{mean} {second}");
        }
        let up: Vector3<f64> = (0..4000).map(|view| views.rotation(view) * Vector3::z()).sum::<Vector3<f64>>() / 4000.0;
        assert!(up.norm() < 0.01, "{up}");
    }

    #[test]
    fn psi_is_the_root_of_its_equation() {
        let psi = 1.533_751_168_755_204_2_f64;
        assert!((psi.powi(4) - psi - 4.0).abs() < 1e-14);
    }

    #[test]
    fn a_quaternion_turns_as_its_angles_do() {
        let half = 0.35_f64;
        let about_z = rotation_from_quaternion([2.0 * half.cos(), 0.0, 0.0, 2.0 * half.sin()]);
        assert!((about_z.matrix() - rotation_from_rpy(0.0, 0.0, 0.7).matrix()).abs().max() < 1e-15);
    }
}
