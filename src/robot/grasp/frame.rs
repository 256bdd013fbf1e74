//! Frames as plain numbers, for code that computes many of them per millisecond.

use nalgebra::{Matrix3, Vector3};

/// A frame as plain numbers: rotation and position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) rotation: Matrix3<f64>,
    pub(super) origin: Vector3<f64>,
}

impl Frame {
    pub(super) fn identity() -> Self {
        Self { rotation: Matrix3::identity(), origin: Vector3::zeros() }
    }

    pub(super) fn of(isometry: &nalgebra::IsometryMatrix3<f64>) -> Self {
        Self { rotation: *isometry.rotation.matrix(), origin: isometry.translation.vector }
    }

    pub(super) fn isometry(&self) -> nalgebra::IsometryMatrix3<f64> {
        nalgebra::IsometryMatrix3::from_parts(
            nalgebra::Translation3::from(self.origin),
            nalgebra::Rotation3::from_matrix_unchecked(self.rotation),
        )
    }

    #[inline(always)]
    pub(super) fn times(&self, other: &Self) -> Self {
        Self { rotation: self.rotation * other.rotation, origin: self.rotation * other.origin + self.origin }
    }

    pub(super) fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, origin: -(rotation * self.origin) }
    }

    #[inline(always)]
    pub(super) fn point(&self, of: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * of + self.origin
    }
}
