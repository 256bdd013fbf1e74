//! Where the surface crosses the vertical line through each column of cells: the exact part of every inside test.
//!
//! Vertices are rounded to 2^-18 of a cell, finer than an `f32` resolves across the box. Every edge test is then exact in
//! 64-bit integers, and lines through an edge or a corner are decided by moving the line by
//! (e, e^2), e infinitely small (simulation of simplicity, Edelsbrunner and Mücke 1990). So the triangles around an
//! edge or a corner agree about every line, whether they share vertices by index or by position only: a closed surface
//! cannot leak.

use nalgebra::Point3;

use crate::geom::{SolidGrid, TriMesh};

/// A point in ticks.
pub(super) type Ticks = [i32; 3];

const TICK_BITS: u32 = 18;

/// Ticks a cell.
pub(super) const TICKS: f64 = (1 << TICK_BITS) as f64;

/// A point in cells.
pub(super) fn in_cells(point: Ticks) -> [f64; 3] {
    point.map(|ticks| f64::from(ticks) / TICKS)
}

/// The nearest point in ticks, at most 2^27 off the origin: beyond every grid.
pub(super) fn in_ticks(cells: [f64; 3]) -> Ticks {
    cells.map(|cells| round((cells * TICKS).clamp(-134_217_728.0, 134_217_728.0)))
}

/// To the nearest whole number; `f64::round` is a library call on plain x86-64.
fn round(value: f64) -> i32 {
    (value + 0.5f64.copysign(value)) as i32
}

/// The frame of a solid grid: cell (i, j, k) spans ticks i * TICKS .. (i + 1) * TICKS, and so on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lattice {
    /// Lower corner of the mesh's box [m].
    pub(super) origin: Point3<f64>,
    /// Longest side of that box [m].
    pub(super) longest_side: f64,
}

impl Lattice {
    /// Over the box of the vertices; `None` for a mesh without triangles, without extent, or with a coordinate that
    /// is not finite.
    pub(super) fn of(mesh: &TriMesh) -> Option<Self> {
        let aabb = mesh.aabb()?;
        let lattice = Self { origin: aabb.min, longest_side: aabb.longest_side() };
        let finite = mesh.vertices.iter().flatten().all(|coordinate| coordinate.is_finite());
        (finite && !mesh.triangles.is_empty() && lattice.longest_side > 0.0).then_some(lattice)
    }

    /// Vertices in ticks, shape (vertices, 3).
    pub(super) fn vertices(&self, mesh: &TriMesh) -> Vec<Ticks> {
        let cells_per_metre = SolidGrid::SIDE as f64 / self.longest_side;
        let point = |vertex: &[f32; 3]| {
            in_ticks(std::array::from_fn(|axis| (f64::from(vertex[axis]) - self.origin[axis]) * cells_per_metre))
        };
        mesh.vertices.iter().map(point).collect()
    }
}

/// The crossings of every column of a grid of `SIDE` cells per side (256 at most), bottom to top.
#[derive(Debug)]
pub(super) struct Columns<const SIDE: usize> {
    /// Column (x, y) owns `packed[starts[x * SIDE + y]..starts[x * SIDE + y + 1]]`.
    starts: Vec<u32>,
    /// `2 * cell + leaves`: the first cell (0 to `SIDE`) whose centre is not below the crossing; `leaves` is 1 where the
    /// winding number falls by one upwards. Sorted within a column.
    packed: Vec<u16>,
}

/// One crossing of a column, upwards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Crossing {
    /// The first cell whose centre is not below the crossing, 0 to the grid's side.
    pub(super) cell: usize,
    /// Change of the winding number there: +1 or -1.
    pub(super) step: i32,
}

impl<const SIDE: usize> Columns<SIDE> {
    /// All crossings of the triangles.
    pub(super) fn of(triangles: impl Iterator<Item = [Ticks; 3]>) -> Self {
        let mut found = Vec::with_capacity(1 << 17);
        for triangle in triangles {
            cross::<SIDE>(triangle, &mut found);
        }
        let mut starts = vec![0u32; SIDE * SIDE + 1];
        for crossing in &found {
            starts[(crossing >> 16) as usize + 1] += 1;
        }
        let mut total = 0;
        for start in &mut starts {
            total += *start;
            *start = total;
        }
        // Filling moves each start to the end of its column, which is the start of the next.
        let mut packed = vec![0u16; found.len()];
        for crossing in &found {
            let next = &mut starts[(crossing >> 16) as usize];
            packed[*next as usize] = *crossing as u16;
            *next += 1;
        }
        starts.rotate_right(1);
        starts[0] = 0;
        for column in starts.windows(2) {
            packed[column[0] as usize..column[1] as usize].sort_unstable();
        }
        Self { starts, packed }
    }

    /// The crossings of column `x * SIDE + y`, bottom to top.
    pub(super) fn column(&self, column: usize) -> impl Iterator<Item = Crossing> + '_ {
        self.packed[self.starts[column] as usize..self.starts[column + 1] as usize]
            .iter()
            .map(|packed| Crossing { cell: usize::from(packed >> 1), step: 1 - 2 * i32::from(packed & 1) })
    }

    /// The winding number at the centre of a cell.
    pub(super) fn winding(&self, [x, y, z]: [usize; 3]) -> i32 {
        self.column(x * SIDE + y).take_while(|crossing| crossing.cell <= z).map(|crossing| crossing.step).sum()
    }

    /// Calls `mark` with (column, first cell, end cell) for every run of cells whose winding number is not 0.
    pub(super) fn for_each_run(&self, mut mark: impl FnMut(usize, usize, usize)) {
        for column in 0..SIDE * SIDE {
            let (mut winding, mut from) = (0, 0);
            for Crossing { cell, step } in self.column(column) {
                if winding != 0 {
                    mark(column, from, cell);
                }
                winding += step;
                from = cell;
            }
        }
    }
}

impl Columns<{ SolidGrid::SIDE }> {
    /// Marks every cell whose centre has a winding number other than 0.
    pub(super) fn fill(&self, grid: &mut SolidGrid) {
        const WORDS: usize = SolidGrid::SIDE / 64;
        self.for_each_run(|column, from, to| mark(&mut grid.words[column * WORDS..(column + 1) * WORDS], from, to));
    }
}

/// Sets bits `from..to` of a column.
pub(super) fn mark(words: &mut [u64], from: usize, to: usize) {
    for (index, word) in words.iter_mut().enumerate() {
        let (low, high) = (from.saturating_sub(64 * index).min(64), to.saturating_sub(64 * index).min(64));
        if low < high {
            *word |= (u64::MAX >> (64 - (high - low))) << low;
        }
    }
}

/// The columns that `triangle` crosses, as `column << 16 | 2 * cell + leaves`.
fn cross<const SIDE: usize>(triangle: [Ticks; 3], found: &mut Vec<u32>) {
    let [a, b, c] = triangle.map(|corner| corner.map(i64::from));
    // Twice the signed area of the projection along z. Vertical triangles cross no column.
    let doubled_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if doubled_area == 0 {
        return;
    }
    // Seen from above, a counter-clockwise triangle faces up: going up means going out.
    let (leaves, [a, b, c]) = if doubled_area > 0 { (1, [a, b, c]) } else { (0, [a, c, b]) };
    // Columns whose centre lies in the triangle's range.
    let span = |axis: usize| {
        let (low, high) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
        let half = 1 << (TICK_BITS - 1);
        (((low + half - 1) >> TICK_BITS).max(0), ((high + half) >> TICK_BITS).min(SIDE as i64))
    };
    let ((x_low, x_end), (y_low, y_end)) = (span(0), span(1));
    if x_low >= x_end || y_low >= y_end {
        return;
    }
    // Edge functions at the first column's centre, stepped by constants: whole numbers, so exact.
    let corner = [x_low, y_low].map(|column| (2 * column + 1) << (TICK_BITS - 1));
    let edges = [(a, b), (b, c), (c, a)].map(|(p, q)| Edge::new(p, q, corner));
    let height = Height::new([a, b, c], corner, SIDE as f64);
    let mut rows = edges.map(|edge| edge.value);
    for x in x_low..x_end {
        let mut values = rows;
        for y in y_low..y_end {
            // One sign bit for all three.
            if values[0] | values[1] | values[2] >= 0 {
                // Crossing height of the plane, and the first cell whose centre lies above it.
                let cell = height.first_cell_above((x - x_low) as f64, (y - y_low) as f64);
                found.push(((x as usize * SIDE + y as usize) as u32) << 16 | cell << 1 | leaves);
            }
            for (value, edge) in values.iter_mut().zip(&edges) {
                *value += edge.step_y;
            }
        }
        for (row, edge) in rows.iter_mut().zip(&edges) {
            *row += edge.step_x;
        }
    }
}

/// An edge test that moves with the column: not negative on the left of the edge, ties decided by the infinitely small
/// move of the column by (e, e^2).
#[derive(Clone, Copy)]
struct Edge {
    value: i64,
    step_x: i64,
    step_y: i64,
}

impl Edge {
    fn new(from: [i64; 3], to: [i64; 3], corner: [i64; 2]) -> Self {
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let value = dx * (corner[1] - from[1]) - dy * (corner[0] - from[0]);
        let tie_is_inside = dy < 0 || (dy == 0 && dx > 0);
        // "> 0" is ">= 1".
        let value = value - i64::from(!tie_is_inside);
        Self { value, step_x: -dy << TICK_BITS, step_y: dx << TICK_BITS }
    }
}

/// Height of a triangle's plane above the columns [cells], held inside the triangle's own range and the grid's.
struct Height {
    at_corner: f64,
    step_x: f64,
    step_y: f64,
    low: f64,
    high: f64,
    side: f64,
}

impl Height {
    fn new([a, b, c]: [[i64; 3]; 3], corner: [i64; 2], side: f64) -> Self {
        let along = |to: [i64; 3]| [0, 1, 2].map(|axis| (to[axis] - a[axis]) as f64);
        let (u, v) = (along(b), along(c));
        let per_area = 1.0 / (u[0] * v[1] - u[1] * v[0]);
        let step_x = (u[2] * v[1] - u[1] * v[2]) * per_area;
        let step_y = (u[0] * v[2] - u[2] * v[0]) * per_area;
        let at_corner = a[2] as f64 + step_x * (corner[0] - a[0]) as f64 + step_y * (corner[1] - a[1]) as f64;
        Self {
            at_corner: at_corner / TICKS,
            step_x,
            step_y,
            low: (a[2].min(b[2]).min(c[2]) as f64 / TICKS).clamp(0.0, side),
            high: (a[2].max(b[2]).max(c[2]) as f64 / TICKS).clamp(0.0, side),
            side,
        }
    }

    /// The first cell, 0 to the grid's side, whose centre is not below the plane, `x` and `y` columns from the corner.
    fn first_cell_above(&self, x: f64, y: f64) -> u32 {
        // Plain comparisons: f64::max and min also test for NaN.
        let height = self.at_corner + x * self.step_x + y * self.step_y;
        let height = if height > self.low { height } else { self.low };
        let height = if height < self.high { height } else { self.high };
        // ceil(height - 0.5) for 0 <= height <= side.
        self.side as u32 - (self.side + 0.5 - height) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = SolidGrid::SIDE;

    #[test]
    fn marks_across_words() {
        let mut words = [0u64; 4];
        mark(&mut words, 3, 130);
        let set: Vec<usize> = (0..256).filter(|bit| words[bit / 64] >> (bit % 64) & 1 != 0).collect();
        assert_eq!(set, (3..130).collect::<Vec<_>>());
        let mut full = [0u64; 4];
        mark(&mut full, 0, 256);
        assert_eq!(full, [u64::MAX; 4]);
        mark(&mut words, 7, 7);
        assert_eq!(words.iter().map(|word| word.count_ones()).sum::<u32>(), 127);
    }

    #[test]
    fn first_cell_above_counts_a_centre_on_the_plane() {
        for (height, cell) in [(0.0, 0), (0.49, 0), (0.5, 0), (0.51, 1), (255.5, 255), (255.51, 256), (256.0, 256)] {
            let plane = Height { at_corner: height, step_x: 0.0, step_y: 0.0, low: 0.0, high: 256.0, side: 256.0 };
            assert_eq!(plane.first_cell_above(0.0, 0.0), cell, "height {height}");
        }
    }

    /// A fan of any shape around a corner covers a column at that corner exactly once.
    #[test]
    fn a_fan_covers_its_centre_once() {
        let middle = [100.5, 80.5, 7.0];
        let rim =
            [(9.0, 1.0), (3.0, 7.5), (0.0, 6.0), (-4.0, 4.0), (-9.0, 0.0), (-2.0, -5.0), (0.0, -8.0), (5.0, -5.0)]
                .map(|(x, y)| [middle[0] + x, middle[1] + y, middle[2]]);
        let fan = (0..rim.len()).map(|i| [middle, rim[i], rim[(i + 1) % rim.len()]].map(in_ticks));
        let columns = Columns::<SIDE>::of(fan);
        let crossings: Vec<Crossing> = columns.column(100 * 256 + 80).collect();
        assert_eq!(crossings, [Crossing { cell: 7, step: -1 }]);
        assert!((0..SIDE * SIDE).all(|column| columns.column(column).count() <= 1));
    }
}
