//! Occupied cells as a body: rectangles around them, and their distances from cell to cell.

use nalgebra::Point3;

use super::{lattice::Lattice, solid::Solid, triangle::Triangle};
use kernel::geom::{OccupancyGrid, SimdLevel};

/// Side of the pieces into which the surface is cut [cells].
const PIECE: f64 = 2.0;

/// Cells of a box around the occupied ones, with one free layer on each side.
struct Cells {
    /// The grid's coordinates of the first cell; -1 where the free layer begins before the grid.
    first: [i64; 3],
    counts: [usize; 3],
    occupied: Vec<bool>,
}

/// The occupied cells as one body; `None` for an empty grid. The frame's origin is the corner of cell (0, 0, 0).
pub(super) fn solid_of_cells(grid: &OccupancyGrid, size: f64, level: SimdLevel) -> Option<Solid> {
    let cells = Cells::new(grid)?;
    let triangles = cells.triangles(size);
    let low = Point3::from(cells.first.map(|cell| (cell as f64 + 0.5) * size));
    let distances = cells.distances().into_iter().map(|distance| (distance * size) as f32).collect();
    let lattice = Lattice::of_distances(low, size, cells.counts, distances);
    Some(Solid::of_parts(triangles, lattice, cells.shells(size), PIECE * size, level))
}

/// The surface between occupied and free cells, for tests of other rooms of this one.
#[cfg(test)]
pub(super) fn triangles_of_cells(grid: &OccupancyGrid, size: f64) -> Vec<Triangle> {
    Cells::new(grid).map_or_else(Vec::new, |cells| cells.triangles(size))
}

impl Cells {
    fn new(grid: &OccupancyGrid) -> Option<Self> {
        let mut range: Option<([u32; 3], [u32; 3])> = None;
        for cell in grid.cells() {
            let (low, high) = range.get_or_insert((cell, cell));
            for axis in 0..3 {
                (low[axis], high[axis]) = (low[axis].min(cell[axis]), high[axis].max(cell[axis]));
            }
        }
        let (low, high) = range?;
        let mut cells = Self {
            first: low.map(|low| i64::from(low) - 1),
            counts: std::array::from_fn(|axis| (high[axis] - low[axis]) as usize + 3),
            occupied: Vec::new(),
        };
        cells.occupied = vec![false; cells.counts.iter().product()];
        for cell in grid.cells() {
            let index = cells.index(std::array::from_fn(|axis| (cell[axis] - low[axis]) as usize + 1));
            cells.occupied[index] = true;
        }
        Some(cells)
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.counts[1] + y) * self.counts[2] + z
    }

    fn cell(&self, index: usize) -> [usize; 3] {
        let [_, ny, nz] = self.counts;
        [index / (ny * nz), index / nz % ny, index % nz]
    }

    /// A lattice point of the cells' corners [m].
    fn corner(&self, cell: [usize; 3], size: f64) -> Point3<f64> {
        Point3::from(std::array::from_fn(|axis| (self.first[axis] + cell[axis] as i64) as f64 * size))
    }

    /// Two triangles per rectangle of faces between an occupied and a free cell.
    fn triangles(&self, size: f64) -> Vec<Triangle> {
        let mut all = Vec::new();
        for axis in 0..3 {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            for layer in 1..self.counts[axis] {
                for outward in [false, true] {
                    // Faces between the cell before the layer's lower side and that behind it.
                    let face = |a: usize, b: usize| {
                        let mut behind = [0; 3];
                        (behind[axis], behind[u], behind[v]) = (layer, a, b);
                        let mut before = behind;
                        before[axis] -= 1;
                        let sides = [before, behind].map(|cell| self.occupied[self.index(cell)]);
                        sides == [outward, !outward]
                    };
                    for [a, b, width, height] in rectangles([self.counts[u], self.counts[v]], face) {
                        let at = |a: usize, b: usize| {
                            let mut cell = [0; 3];
                            (cell[axis], cell[u], cell[v]) = (layer, a, b);
                            self.corner(cell, size)
                        };
                        let corners = [at(a, b), at(a + width, b), at(a + width, b + height), at(a, b + height)];
                        let [p, q, r, s] = corners;
                        all.extend(if outward { [[p, q, r], [p, r, s]] } else { [[p, r, q], [p, s, r]] });
                    }
                }
            }
        }
        all
    }

    /// Signed distance of each cell's centre to the surface between occupied and free cells [cells], negative inside.
    ///
    /// A cell's distance to a cube is separable, so that a pass over each axis is exact (Felzenszwalb and Huttenlocher,
    /// "Distance transforms of sampled functions", 2012).
    fn distances(&self) -> Vec<f64> {
        let [outside, inside] = [true, false].map(|target| {
            let start = |occupied: &bool| if *occupied == target { 0.0 } else { f64::INFINITY };
            let mut squared: Vec<f64> = self.occupied.iter().map(start).collect();
            let strides = [self.counts[1] * self.counts[2], self.counts[2], 1];
            for (axis, stride) in strides.into_iter().enumerate() {
                let count = self.counts[axis];
                let mut row = vec![0.0; count];
                for begin in (0..squared.len()).filter(|index| self.cell(*index)[axis] == 0) {
                    let at = |step: usize| begin + step * stride;
                    (0..count).for_each(|step| row[step] = squared[at(step)]);
                    for step in 0..count {
                        squared[at(step)] = nearest_of_row(&row, step);
                    }
                }
            }
            squared
        });
        outside.into_iter().zip(inside).map(|(outside, inside)| outside.sqrt() - inside.sqrt()).collect()
    }

    /// A corner of each group of occupied cells that hang together at faces, edges or corners.
    fn shells(&self, size: f64) -> Vec<Point3<f64>> {
        let (mut seen, mut found) = (vec![false; self.occupied.len()], Vec::new());
        for first in 0..self.occupied.len() {
            if !self.occupied[first] || seen[first] {
                continue;
            }
            found.push(self.corner(self.cell(first), size));
            let mut open = vec![first];
            seen[first] = true;
            while let Some(index) = open.pop() {
                // The free layer keeps neighbours within the box.
                let [x, y, z] = self.cell(index);
                let beside = (x - 1..=x + 1)
                    .flat_map(|x| (y - 1..=y + 1).flat_map(move |y| (z - 1..=z + 1).map(move |z| [x, y, z])));
                for other in beside.map(|cell| self.index(cell)) {
                    if self.occupied[other] && !std::mem::replace(&mut seen[other], true) {
                        open.push(other);
                    }
                }
            }
        }
        found
    }
}

/// Smallest sum of a row's value and the squared distance to that cell's cube.
fn nearest_of_row(row: &[f64], step: usize) -> f64 {
    let mut best = row[step];
    for offset in 1..row.len() {
        let gap = offset as f64 - 0.5;
        let squared = gap * gap;
        if squared >= best {
            break;
        }
        let before = step.checked_sub(offset).map(|other| row[other]);
        let after = row.get(step + offset).copied();
        best = before.into_iter().chain(after).map(|value| value + squared).fold(best, f64::min);
    }
    best
}

/// Rectangles (first, second, width, height) that cover what is true exactly once, row by row.
fn rectangles([rows, columns]: [usize; 2], wanted: impl Fn(usize, usize) -> bool) -> Vec<[usize; 4]> {
    let mut open: Vec<bool> = (0..rows * columns).map(|index| wanted(index / columns, index % columns)).collect();
    let mut found = Vec::new();
    for index in 0..open.len() {
        if !open[index] {
            continue;
        }
        let [row, column] = [index / columns, index % columns];
        let height = (column..columns).take_while(|other| open[row * columns + other]).count();
        let whole = |other: &usize| (column..column + height).all(|column| open[other * columns + column]);
        let width = (row..rows).take_while(whole).count();
        for other in row..row + width {
            open[other * columns + column..other * columns + column + height].fill(false);
        }
        found.push([row, column, width, height]);
    }
    found
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::collision::boxes::BoxTree;
    use kernel::seed::Stream;

    #[test]
    fn distances_and_rectangles_are_those_of_the_cells() {
        let mut draw = Stream::of_job(1, b"", "cells");
        for share in [0.01, 0.3, 0.9] {
            let mut grid = OccupancyGrid::new(9);
            (0..729u32).filter(|_| draw.unit() < share).for_each(|bit| grid.set([bit / 81, bit / 9 % 9, bit % 9]));
            let cells = Cells::new(&grid).expect("occupied cells");
            let size = 0.01;
            let triangles = cells.triangles(size);
            let boxes = BoxTree::new(&triangles, SimdLevel::detect());
            let area: f64 = triangles.iter().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum();
            let faces = cells.occupied.iter().enumerate().filter(|(_, occupied)| **occupied).map(|(index, _)| {
                let around = |axis: usize| {
                    let [mut before, mut after] = [cells.cell(index); 2];
                    (before[axis], after[axis]) = (before[axis] - 1, after[axis] + 1);
                    [before, after].into_iter().filter(|cell| !cells.occupied[cells.index(*cell)]).count()
                };
                (0..3).map(around).sum::<usize>()
            });
            assert!((area - faces.sum::<usize>() as f64 * size * size).abs() < 1e-9);
            // Outward normals: the volume by the divergence theorem.
            let volume: f64 = triangles.iter().map(|[a, b, c]| a.coords.dot(&b.coords.cross(&c.coords)) / 6.0).sum();
            assert!((volume - f64::from(grid.count()) * size.powi(3)).abs() < 1e-9, "{volume}");
            for (index, distance) in cells.distances().into_iter().enumerate() {
                let centre = cells.corner(cells.cell(index), size) + Vector3::repeat(0.5 * size);
                let exact = boxes.squared_distance_within(&centre, f64::INFINITY).sqrt();
                assert!((distance.abs() * size - exact).abs() < 1e-12, "{distance} {exact}");
                assert_eq!(distance < 0.0, cells.occupied[index]);
            }
        }
    }
}
