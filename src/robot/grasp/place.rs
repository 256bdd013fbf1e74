//! Frames as plain numbers, for many of them a millisecond.

use nalgebra::{Matrix3, Vector3};

/// A frame as plain numbers: turn and place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) turn: Matrix3<f64>,
    pub(super) at: Vector3<f64>,
}

impl Place {
    pub(super) fn identity() -> Self {
        Self { turn: Matrix3::identity(), at: Vector3::zeros() }
    }

    pub(super) fn of(isometry: &nalgebra::IsometryMatrix3<f64>) -> Self {
        Self { turn: *isometry.rotation.matrix(), at: isometry.translation.vector }
    }

    pub(super) fn isometry(&self) -> nalgebra::IsometryMatrix3<f64> {
        nalgebra::IsometryMatrix3::from_parts(
            nalgebra::Translation3::from(self.at),
            nalgebra::Rotation3::from_matrix_unchecked(self.turn),
        )
    }

    #[inline(always)]
    pub(super) fn times(&self, other: &Self) -> Self {
        Self { turn: self.turn * other.turn, at: self.turn * other.at + self.at }
    }

    pub(super) fn inverse(&self) -> Self {
        let turn = self.turn.transpose();
        Self { turn, at: -(turn * self.at) }
    }

    #[inline(always)]
    pub(super) fn point(&self, of: &Vector3<f64>) -> Vector3<f64> {
        self.turn * of + self.at
    }
}
