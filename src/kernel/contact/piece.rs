//! Parts of a solid's core.

use nalgebra::Vector3;

use super::Probe;

/// A core is cut into pieces no longer than this [m]; each is a point where a contact may be.
const PIECE: f64 = 0.004;

/// A box of the core's frame.
#[derive(Clone, Copy)]
pub(super) struct Piece {
    pub(super) centre: Vector3<f64>,
    pub(super) half: Vector3<f64>,
}

impl Piece {
    /// All of a core.
    pub(super) fn whole(probe: &Probe) -> Self {
        Self { centre: Vector3::zeros(), half: probe.half.into() }
    }

    /// Two pieces, parted across the longest side; `None` for one that is small enough.
    pub(super) fn halves(&self) -> Option<[Self; 2]> {
        let axis = self.half.imax();
        if 2.0 * self.half[axis] <= PIECE {
            return None;
        }
        let (mut half, mut shift) = (self.half, Vector3::zeros());
        half[axis] /= 2.0;
        shift[axis] = half[axis];
        Some([-shift, shift].map(|shift| Self { centre: self.centre + shift, half }))
    }
}
