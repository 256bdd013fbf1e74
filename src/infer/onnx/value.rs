//! Shapes, and facts about a tensor known before the network runs.

use std::fmt;

use super::bounds;

/// Sides of a tensor, each at least 1; at most [`bounds::RANK`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Shape(Vec<u64>);

/// Knowledge of a tensor.
#[derive(Clone, Debug)]
pub(super) enum Value {
    /// Single precision, computed by the network.
    Computed(Shape),
    /// Single-precision constant of the file, by its index.
    Weight(Shape, usize),
    /// Known integers, of a constant or of shapes.
    Whole(Shape, Vec<i64>),
}

impl Shape {
    /// Creates a shape from its sides; `None` if a side is 0 or there are too many axes or elements.
    pub(super) fn new(sides: Vec<u64>) -> Option<Self> {
        let shape = Self(sides);
        let is_bounded = shape.0.len() <= bounds::RANK && shape.0.iter().all(|side| *side > 0);
        let elements = shape.0.iter().try_fold(1_u64, |product, side| product.checked_mul(*side));
        (is_bounded && elements.is_some()).then_some(shape)
    }

    pub(super) fn sides(&self) -> &[u64] {
        &self.0
    }

    pub(super) fn rank(&self) -> usize {
        self.0.len()
    }

    /// Number of elements.
    pub(super) fn elements(&self) -> u64 {
        self.0.iter().product()
    }

    /// The shape that NumPy broadcasts both to: sides are equal from the last one on, or one of them is 1.
    pub(super) fn broadcast(&self, other: &Self) -> Option<Self> {
        let rank = self.rank().max(other.rank());
        let side = |shape: &Self, axis: usize| (axis + shape.rank()).checked_sub(rank).map_or(1, |axis| shape.0[axis]);
        let sides = (0..rank).map(|axis| match (side(self, axis), side(other, axis)) {
            (a, b) if a == b || b == 1 => Some(a),
            (1, b) => Some(b),
            _ => None,
        });
        Self::new(sides.collect::<Option<_>>()?)
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sides: Vec<String> = self.0.iter().map(u64::to_string).collect();
        write!(f, "({})", sides.join(", "))
    }
}

impl Value {
    pub(super) fn shape(&self) -> &Shape {
        match self {
            Self::Computed(shape) | Self::Weight(shape, _) | Self::Whole(shape, _) => shape,
        }
    }
}
