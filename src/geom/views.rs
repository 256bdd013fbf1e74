//! Which way an object is turned in each view.

use nalgebra::Rotation3;

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
    /// Rotations one by one.
    List(Vec<Rotation3<f64>>),
}

impl ViewSet {
    /// Count of views.
    pub fn len(&self) -> usize {
        match self {
            Self::RollPitchYaw { roll, pitch, yaw } => roll.len() * pitch.len() * yaw.len(),
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
            Self::List(rotations) => rotations[view],
        }
    }
}
