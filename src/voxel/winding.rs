//! Solids of surfaces with holes, by the generalised winding number (Jacobson, Kavan and Sorkine-Hornung 2013).
//!
//! The winding number w of an open surface is that of the closed surface which caps over its holes complete, a whole
//! number n that crossings give exactly, less the winding number c of the caps. Far from the holes |c| < 1/2, and there
//! |w| >= 1/2 says the same as n != 0. So the crossings decide nearly everywhere, and only near the holes c has to be
//! evaluated (the same identity makes the one-shot method of Martens and Bessmeltsev 2025). Any caps do: w does not
//! depend on them.

use nalgebra::Vector3;

use super::{
    caps::{Caps, Local},
    columns::{Columns, TICKS},
    rim::rim_loops,
    surface::mark_surface,
};
use crate::geom::SolidGrid;

const SIDE: usize = SolidGrid::SIDE;

/// Error of the expansion that [`Caps::winding`] uses, at most.
const EXPANSION_ERROR: f64 = 0.005;

/// Marks every cell whose centre has a generalised winding number of at least 1/2, either way round. Corners in ticks.
pub(super) fn fill_by_winding(vertices: &[[f64; 3]], triangles: &[[u32; 3]], grid: &mut SolidGrid) {
    let corners = || triangles.iter().map(|triangle| triangle.map(|vertex| vertices[vertex as usize]));
    let mut polygons = rim_loops(vertices, triangles);
    if polygons.is_empty() {
        Columns::<SIDE>::of(corners()).fill(grid);
        return;
    }
    polygons.iter_mut().flatten().flatten().for_each(|ticks| *ticks /= TICKS);
    let caps = Caps::new(&polygons);
    let cap_corners = || caps.triangles().map(|corners| corners.map(|corner| corner.map(|cells| cells * TICKS)));
    let columns = Columns::of(corners().chain(cap_corners()));
    columns.fill(grid);
    let mut surface = SolidGrid::new(grid.origin, 1.0);
    mark_surface(corners(), &mut surface);
    let mut cap_cells = SolidGrid::new(grid.origin, 1.0);
    mark_surface(cap_corners(), &mut cap_cells);
    let locals = (0..=SIDE.ilog2()).map(|_| Local::default()).collect();
    let mut refinement =
        Refinement { caps: &caps, columns: &columns, surface: &surface, cap_cells: &cap_cells, locals, grid };
    refinement.block([0; 3], SIDE, &caps.everywhere());
}

struct Refinement<'a> {
    caps: &'a Caps,
    /// Crossings of the surface and the caps.
    columns: &'a Columns<SIDE>,
    /// Cells that the surface meets.
    surface: &'a SolidGrid,
    /// Cells that the caps meet.
    cap_cells: &'a SolidGrid,
    /// Memory for one block of each size.
    locals: Vec<Local>,
    grid: &'a mut SolidGrid,
}

impl Refinement<'_> {
    /// Decides the cells of a cubic block: at once where that is safe, else in eight parts.
    fn block(&mut self, corner: [usize; 3], size: usize, outer: &Local) {
        let middle = corner.map(|index| index + size / 2);
        let point = eye(middle);
        if size == 1 {
            let w = f64::from(self.columns.winding(middle)) - self.caps.winding(outer, &point);
            self.set(corner, 1, w.abs() >= 0.5);
            return;
        }
        let mut local = std::mem::take(&mut self.locals[size.ilog2() as usize]);
        let reach = (size / 2) as f64 * 3f64.sqrt();
        self.caps.narrow(outer, point, reach, &mut local);
        if !self.decide(corner, size, &local, &point, reach) {
            let half = size / 2;
            for part in 0..8 {
                self.block(std::array::from_fn(|axis| corner[axis] + (part >> axis & 1) * half), half, &local);
            }
        }
        self.locals[size.ilog2() as usize] = local;
    }

    /// Decides a whole block where that is safe.
    fn decide(&mut self, corner: [usize; 3], size: usize, local: &Local, point: &Vector3<f64>, reach: f64) -> bool {
        let capped = any(self.cap_cells, corner, size);
        if capped && any(self.surface, corner, size) {
            return false;
        }
        let c = self.caps.winding(local, point);
        let w = f64::from(self.columns.winding(corner.map(|index| index + size / 2))) - c;
        // Without caps inside, c has no jump: its nearest whole number m is the same everywhere, and |n - c| >= 1/2 is
        // n != m. Without surface inside, w has no jump.
        let m = c.round();
        let margin = if capped { (w.abs() - 0.5).abs() } else { 0.5 - (c - m).abs() } - EXPANSION_ERROR;
        if margin <= 0.0 || !self.caps.is_calm(local, point, reach, margin) {
            return false;
        }
        if capped {
            self.set(corner, size, w.abs() >= 0.5);
        } else if m != 0.0 {
            self.refill(corner, size, m as i32);
        }
        true
    }

    /// Sets or clears a block.
    fn set(&mut self, corner: [usize; 3], size: usize, solid: bool) {
        for (word, mask) in words_of(corner, size) {
            if solid {
                self.grid.words[word] |= mask;
            } else {
                self.grid.words[word] &= !mask;
            }
        }
    }

    /// Sets the cells of a block where the whole winding number is not `outside`.
    fn refill(&mut self, corner: [usize; 3], size: usize, outside: i32) {
        for x in corner[0]..corner[0] + size {
            for y in corner[1]..corner[1] + size {
                for z in corner[2]..corner[2] + size {
                    let solid = self.columns.winding([x, y, z]) != outside;
                    self.set([x, y, z], 1, solid);
                }
            }
        }
    }
}

/// Centre of a cell, moved a little as the crossings' tie rules move it, so that both agree on the side of a cap that
/// passes through the centre.
fn eye(cell: [usize; 3]) -> Vector3<f64> {
    let nudge = [1.0 / 4_194_304.0, 1.0 / 67_108_864.0, 1.0 / 524_288.0];
    Vector3::from_fn(|axis, _| cell[axis] as f64 + 0.5 + nudge[axis])
}

/// The words of a block with the bits that belong to it; `corner` is a multiple of `size`, a power of two.
fn words_of(corner: [usize; 3], size: usize) -> impl Iterator<Item = (usize, u64)> {
    let mask = if size >= 64 { u64::MAX } else { ((1 << size) - 1) << (corner[2] % 64) };
    let (first, count) = (corner[2] / 64, size.div_ceil(64));
    (corner[0]..corner[0] + size).flat_map(move |x| {
        (corner[1]..corner[1] + size)
            .flat_map(move |y| (first..first + count).map(move |word| ((x * SIDE + y) * (SIDE / 64) + word, mask)))
    })
}

fn any(grid: &SolidGrid, corner: [usize; 3], size: usize) -> bool {
    words_of(corner, size).any(|(word, mask)| grid.words[word] & mask != 0)
}
