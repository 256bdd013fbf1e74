//! Every cell that the surface meets: exact, closed triangle against closed cell.

use super::columns::{Ticks, in_cells, mark};
use crate::geom::SolidGrid;

const SIDE: usize = SolidGrid::SIDE;

/// Slack against rounding [cells]; vertices themselves are held to 4e-6 of a cell.
const SLACK: f64 = 1e-9;

/// A closed interval [cells].
#[derive(Clone, Copy)]
struct Span {
    low: f64,
    high: f64,
}

impl Span {
    const EMPTY: Self = Self { low: f64::INFINITY, high: f64::NEG_INFINITY };

    fn widen(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    fn meet(self, other: Self) -> Self {
        Self { low: self.low.max(other.low), high: self.high.min(other.high) }
    }

    /// The closed cells that meet this span, among `side` cells, as a half-open range.
    fn cells(self, side: usize) -> (usize, usize) {
        // Cell i meets it when i <= high and i + 1 >= low; casts saturate at 0.
        let first = ((self.low - SLACK).ceil() - 1.0).max(0.0) as usize;
        let end = ((self.high + SLACK).floor() + 1.0).max(0.0) as usize;
        (first, end.min(side))
    }
}

/// Marks every cell whose closed box meets a triangle.
pub(super) fn mark_surface(triangles: impl Iterator<Item = [Ticks; 3]>, grid: &mut SolidGrid) {
    let mut columns = ColumnsMet::new(SIDE);
    for triangle in triangles {
        mark_triangle(triangle.map(in_cells), &mut columns, grid);
    }
}

fn mark_triangle(corners: [[f64; 3]; 3], columns: &mut ColumnsMet, grid: &mut SolidGrid) {
    columns.each(&corners, |x, y, low, high| {
        let column = (x * SIDE + y) * (SIDE / 64);
        mark(&mut grid.words[column..column + SIDE / 64], low, high);
    });
}

/// Cells along the columns of a grid that triangles meet; its memory is used again for every triangle.
pub(super) struct ColumnsMet {
    side: usize,
    over_y: Vec<Span>,
}

impl ColumnsMet {
    /// Memory for a grid of `side` cells along each axis.
    pub(super) fn new(side: usize) -> Self {
        Self { side, over_y: Vec::with_capacity(side) }
    }

    /// Calls `found` with each column (x, y) in which a closed cell meets the triangle, and the half-open range of these cells
    /// along z. Corners are in grid coordinates [cells].
    ///
    /// A triangle and a box are apart exactly when they are apart in one of the three flat projections or the plane misses
    /// the box (separating axes: the three projections cover the box's axes and the nine edge products). In a projection
    /// the part of the triangle over one row of cells is convex, so its span along the other axis gives the cells of the
    /// row that it meets.
    #[inline]
    pub(super) fn each(&mut self, corners: &[[f64; 3]; 3], mut found: impl FnMut(usize, usize, usize, usize)) {
        let (side, over_y) = (self.side, &mut self.over_y);
        let full = |axis: usize| {
            let mut span = Span::EMPTY;
            corners.iter().for_each(|corner| span.widen(corner[axis]));
            span
        };
        let (y_first, y_end) = full(1).cells(side);
        over_y.clear();
        over_y.extend((y_first..y_end).map(|y| span_over(corners, 1, y, 2)));
        let plane = Plane::of(corners);
        let (x_first, x_end) = full(0).cells(side);
        for x in x_first..x_end {
            let over_x = span_over(corners, 0, x, 2);
            let (first, end) = span_over(corners, 0, x, 1).cells(side);
            for y in first.max(y_first)..end.min(y_end) {
                let (low, high) = plane.over(x, y).meet(over_x).meet(over_y[y - y_first]).cells(side);
                if low < high {
                    found(x, y, low, high);
                }
            }
        }
    }
}

/// The span along axis `along` of the part of the triangle with `row <= coordinate[axis] <= row + 1`.
fn span_over(corners: &[[f64; 3]; 3], axis: usize, row: usize, along: usize) -> Span {
    let (low, high) = (row as f64 - SLACK, row as f64 + 1.0 + SLACK);
    let mut span = Span::EMPTY;
    for edge in 0..3 {
        let (a, b) = (&corners[edge], &corners[(edge + 1) % 3]);
        if (low..=high).contains(&a[axis]) {
            span.widen(a[along]);
        }
        for bound in [low, high] {
            if (a[axis] < bound) != (b[axis] < bound) {
                let share = (bound - a[axis]) / (b[axis] - a[axis]);
                span.widen(a[along] + share * (b[along] - a[along]));
            }
        }
    }
    span
}

/// Height of a triangle's plane above the lower corner of column (0, 0) and its slopes [cells].
struct Plane {
    height: f64,
    slope_x: f64,
    slope_y: f64,
    slack: f64,
}

impl Plane {
    fn of([a, b, c]: &[[f64; 3]; 3]) -> Self {
        let (u, v) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let area = u[0] * v[1] - u[1] * v[0];
        let slope_x = (u[2] * v[1] - u[1] * v[2]) / area;
        let slope_y = (u[0] * v[2] - u[2] * v[0]) / area;
        let height = a[2] - slope_x * a[0] - slope_y * a[1];
        Self { height, slope_x, slope_y, slack: SLACK * (slope_x.abs() + slope_y.abs()) }
    }

    /// Heights above the closed column (x, y); everything for an upright plane.
    fn over(&self, x: usize, y: usize) -> Span {
        let corner = self.height + self.slope_x * x as f64 + self.slope_y * y as f64;
        if !corner.is_finite() {
            return Span { low: f64::NEG_INFINITY, high: f64::INFINITY };
        }
        Span {
            low: corner + self.slope_x.min(0.0) + self.slope_y.min(0.0) - self.slack,
            high: corner + self.slope_x.max(0.0) + self.slope_y.max(0.0) + self.slack,
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::*;

    /// Whether a triangle and a closed unit cell are apart, by all 13 axes (Akenine-Möller 2001), with their gap.
    fn gap(corners: &[[f64; 3]; 3], cell: [usize; 3]) -> f64 {
        let centre = Point3::from(cell.map(|index| index as f64 + 0.5));
        let points = corners.map(|corner| Point3::from(corner) - centre);
        let edges = [points[1] - points[0], points[2] - points[1], points[0] - points[2]];
        let units = [Vector3::x(), Vector3::y(), Vector3::z()];
        let mut axes = units.to_vec();
        axes.push(edges[0].cross(&edges[1]));
        axes.extend(edges.iter().flat_map(|edge| units.iter().map(move |unit| unit.cross(edge))));
        axes.iter()
            .filter_map(|axis| axis.try_normalize(1e-12))
            .map(|axis| {
                let reach = 0.5 * (axis.x.abs() + axis.y.abs() + axis.z.abs());
                let along = points.map(|point| point.dot(&axis));
                let (low, high) =
                    (along.iter().copied().fold(f64::MAX, f64::min), along.iter().copied().fold(f64::MIN, f64::max));
                (low - reach).max(-reach - high)
            })
            .fold(f64::MIN, f64::max)
    }

    #[test]
    fn agrees_with_the_separating_axis_test() {
        // A small congruential generator: the triangles only have to be varied.
        let mut state = 1u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 40) as f64 / (1u64 << 24) as f64
        };
        for trial in 0..60 {
            let size = [1.5, 6.0, 20.0][trial % 3];
            let base: [f64; 3] = std::array::from_fn(|_| 100.0 + 5.0 * next());
            let mut corners: [[f64; 3]; 3] = std::array::from_fn(|_| base.map(|value| value + size * (next() - 0.5)));
            match trial % 7 {
                0 => corners.iter_mut().for_each(|corner| corner[trial % 3] = 100.25),
                1 => corners[1] = corners[0],
                2 => corners[2][2] = corners[0][2] + 1e-7,
                _ => {}
            }
            let mut grid = SolidGrid::new(Point3::origin(), 256.0);
            mark_triangle(corners, &mut ColumnsMet::new(SIDE), &mut grid);
            for x in 88..118 {
                for y in 88..118 {
                    for z in 88..118 {
                        let gap = gap(&corners, [x, y, z]);
                        if gap.abs() > 1e-6 {
                            assert_eq!(grid.get(x, y, z), gap < 0.0, "trial {trial}, cell {x} {y} {z}, gap {gap}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_face_on_a_boundary_touches_both_sides() {
        let mut grid = SolidGrid::new(Point3::origin(), 256.0);
        mark_triangle([[1.25, 1.25, 8.0], [1.75, 1.25, 8.0], [1.5, 1.75, 8.0]], &mut ColumnsMet::new(SIDE), &mut grid);
        assert_eq!(grid.count(), 2);
        assert!(grid.get(1, 1, 7) && grid.get(1, 1, 8));
    }
}
