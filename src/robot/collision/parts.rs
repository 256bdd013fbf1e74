//! Boxes, and lists cut into parts that lie together: what trees are hung from.

use nalgebra::Point3;

/// A box along the axes, its corners with least and greatest coordinates [m].
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub low: Point3<f64>,
    pub high: Point3<f64>,
}

impl Bounds {
    pub fn with(self, other: Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// Intersection of two boxes; some side is negative where it is empty.
    pub fn shared(&self, other: &Self) -> Self {
        Self { low: self.low.sup(&other.low), high: self.high.inf(&other.high) }
    }

    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|axis| self.low[axis] <= other.high[axis] && other.low[axis] <= self.high[axis])
    }

    /// A ball around the box.
    pub fn ball(&self) -> (Point3<f64>, f64) {
        (nalgebra::center(&self.low, &self.high), 0.5 * (self.high - self.low).norm() + 1e-9)
    }
}

/// Around things with boxes.
///
/// # Panics
/// If there are no things.
pub(super) fn around<T>(things: &[T], bounds: &impl Fn(&T) -> Bounds) -> Bounds {
    things.iter().map(bounds).reduce(Bounds::with).expect("a list that is not empty")
}

/// Size of the parts of a list that hang below one block of `lanes`, each but the last a full tree of such blocks.
pub(super) fn part_size(count: usize, lanes: usize) -> usize {
    let mut size = 1;
    while size * lanes < count {
        size *= lanes;
    }
    size
}

/// Cuts a list, again and again across its longest side, into parts of `size`, the last perhaps smaller.
pub(super) fn parted<'a, T>(things: &'a mut [T], size: usize, bounds: &impl Fn(&T) -> Bounds) -> Vec<&'a mut [T]> {
    let parts = things.len().div_ceil(size);
    if parts <= 1 {
        return vec![things];
    }
    let whole = around(things, bounds);
    let axis = (whole.high - whole.low).imax();
    let middle = |thing: &T| {
        let Bounds { low, high } = bounds(thing);
        low[axis] + high[axis]
    };
    // A stable sort: equal keys keep their order, so that the tree is the same everywhere.
    things.sort_by(|a, b| middle(a).total_cmp(&middle(b)));
    let (left, right) = things.split_at_mut(parts / 2 * size);
    let mut all = parted(left, size, bounds);
    all.extend(parted(right, size, bounds));
    all
}
