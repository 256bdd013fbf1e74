//! Boxes that grow with the vertices of a part.

/// An axis-aligned box of single-precision corners [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bounds {
    lower: [f32; 3],
    upper: [f32; 3],
}

impl Bounds {
    /// The box of nothing.
    pub(crate) const EMPTY: Self = Self { lower: [f32::INFINITY; 3], upper: [f32::NEG_INFINITY; 3] };

    pub(crate) fn add(&mut self, point: [f32; 3]) {
        for (axis, coordinate) in point.into_iter().enumerate() {
            self.lower[axis] = self.lower[axis].min(coordinate);
            self.upper[axis] = self.upper[axis].max(coordinate);
        }
    }

    /// Side lengths [m].
    pub(crate) fn sides(&self) -> [f64; 3] {
        std::array::from_fn(|axis| f64::from(self.upper[axis]) - f64::from(self.lower[axis]))
    }

    /// The middle [m].
    pub(crate) fn centre(&self) -> [f64; 3] {
        std::array::from_fn(|axis| (f64::from(self.lower[axis]) + f64::from(self.upper[axis])) / 2.0)
    }

    /// Squared distance between two boxes [m^2].
    pub(crate) fn distance_squared(&self, other: &Self) -> f64 {
        let apart =
            |axis: usize| f64::from((self.lower[axis] - other.upper[axis]).max(other.lower[axis] - self.upper[axis]));
        (0..3).map(|axis| apart(axis).max(0.0)).map(|apart| apart * apart).sum()
    }

    /// No point is in both closed boxes.
    pub(crate) fn is_apart_from(&self, other: &Self) -> bool {
        (0..3).any(|axis| self.lower[axis] > other.upper[axis] || other.lower[axis] > self.upper[axis])
    }

    /// Every point of this box is in the other one.
    pub(crate) fn is_within(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.lower[axis] >= other.lower[axis] && self.upper[axis] <= other.upper[axis])
    }
}
