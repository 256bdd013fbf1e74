//! Solids of surfaces with holes, by the generalised winding number (Jacobson, Kavan and Sorkine-Hornung 2013).
//!
//! The winding number w of an open surface is that of the closed surface which caps over its holes complete, a whole
//! number n that crossings give exactly, less the winding number c of the caps. With m the whole number nearest to c,
//! |w| >= 1/2 is equivalent to n != m. Any caps work: w does not depend on them (the same identity makes the one-shot
//! method of Martens and Bessmeltsev 2025).
//!
//! Nearly everywhere m is 0, so that the crossings decide. Where it may not be is found in two steps: blocks in which c
//! provably stays near one whole number are decided whole; in the rest c is evaluated cell by cell, but only on from the
//! caps: by expansions, and where their error could change the verdict, triangle by triangle. Away from the caps c is
//! harmonic and dies off, so that by the maximum principle every region with m != 0 reaches a cap.

use nalgebra::{Point3, Vector3};

use super::{
    caps::{Caps, Local, distance_to_segment},
    columns::{Columns, Ticks, in_cells, in_ticks},
    rim::RimCaps,
    surface::mark_surface,
};
use crate::geom::SolidGrid;

const SIDE: usize = SolidGrid::SIDE;

/// Blocks of this size or larger are decided whole where that is safe.
const COARSE: usize = 8;

/// Below this size the lists of the enclosing block do.
const FINE: usize = 4;

/// Error bound assumed for the expansions of [`Caps::winding`]: twice the largest error seen, 0.006, on scans with a
/// tenth of their faces reversed.
const EXPANSION_ERROR: f64 = 0.012;

/// Marks every cell whose centre has a generalised winding number of at least 1/2, in either winding.
pub(super) fn fill_by_winding(vertices: &[Ticks], triangles: &[[u32; 3]], grid: &mut SolidGrid) {
    let corners = || triangles.iter().map(|triangle| triangle.map(|vertex| vertices[vertex as usize]));
    let rim_caps = RimCaps::of(vertices, triangles);
    if rim_caps == RimCaps::default() {
        Columns::<SIDE>::of(corners()).fill(grid);
        return;
    }
    let pending = beside_caps(&rim_caps, grid.origin);
    let caps = Caps::new(&rim_caps.polygons());
    let cap_corners = || caps.triangles().map(|corners| corners.map(|corner| in_ticks(corner.into())));
    let columns = Columns::of(corners().chain(cap_corners()));
    columns.fill(grid);
    let mut surface = SolidGrid::new(grid.origin, 1.0);
    mark_surface(corners(), &mut surface);
    let mut cap_cells = SolidGrid::new(grid.origin, 1.0);
    mark_surface(cap_corners(), &mut cap_cells);
    let cells = || SolidGrid::new(grid.origin, 1.0);
    let (open, seen) = (cells(), cells());
    let locals = (0..=SIDE.ilog2()).map(|_| Local::default()).collect();
    Refinement { caps: &caps, columns: &columns, surface, cap_cells, open, pending, seen, locals, grid }.run();
}

struct Refinement<'a> {
    caps: &'a Caps,
    /// Crossings of the surface and the caps.
    columns: &'a Columns<SIDE>,
    /// Cells that the surface meets.
    surface: SolidGrid,
    /// Cells that the caps meet.
    cap_cells: SolidGrid,
    /// Cells that no block has decided.
    open: SolidGrid,
    /// Cells to be evaluated where they are open.
    pending: SolidGrid,
    /// Cells that have been evaluated.
    seen: SolidGrid,
    /// Memory for one block of each size.
    locals: Vec<Local>,
    grid: &'a mut SolidGrid,
}

impl Refinement<'_> {
    fn run(mut self) {
        let everywhere = self.caps.everywhere();
        self.decide_blocks([0; 3], SIDE, &everywhere);
        loop {
            let mut any = 0;
            for ((pending, open), seen) in self.pending.words.iter_mut().zip(&self.open.words).zip(&self.seen.words) {
                *pending &= open & !seen;
                any |= *pending;
            }
            if any == 0 {
                return;
            }
            self.evaluate([0; 3], SIDE, &everywhere);
        }
    }

    /// Decides blocks whole where that is safe, and leaves the others open.
    fn decide_blocks(&mut self, corner: [usize; 3], size: usize, outer: &Local) {
        let capped = any(&self.cap_cells, corner, size);
        let is_mixed = capped && any(&self.surface, corner, size);
        if is_mixed && size == COARSE {
            set(&mut self.open, corner, size, true);
            return;
        }
        let mut local = std::mem::take(&mut self.locals[size.ilog2() as usize]);
        let point = eye(corner.map(|index| index + size / 2));
        let reach = (size / 2) as f64 * 3f64.sqrt();
        self.caps.narrow(outer, point, reach, &mut local);
        if is_mixed || !self.decide(corner, size, capped, &local, &point, reach) {
            if size == COARSE {
                set(&mut self.open, corner, size, true);
            } else {
                eighths(corner, size).for_each(|part| self.decide_blocks(part, size / 2, &local));
            }
        }
        self.locals[size.ilog2() as usize] = local;
    }

    /// Decides a block that the surface and caps do not both meet, where that is safe.
    fn decide(
        &mut self,
        corner: [usize; 3],
        size: usize,
        capped: bool,
        local: &Local,
        point: &Vector3<f64>,
        reach: f64,
    ) -> bool {
        let c = self.caps.winding(local, point);
        let w = f64::from(self.columns.winding(corner.map(|index| index + size / 2))) - c;
        // Without caps inside, c has no jump, so that m is the same everywhere. Without surface inside, w has no jump.
        let m = c.round();
        let margin = if capped { (w.abs() - 0.5).abs() } else { 0.5 - (c - m).abs() } - EXPANSION_ERROR;
        if margin <= 0.0 || !self.caps.is_calm(local, point, reach, margin) {
            return false;
        }
        if capped {
            set(self.grid, corner, size, w.abs() >= 0.5);
        } else if m != 0.0 {
            self.refill(corner, size, m as i32);
        }
        if capped || m != 0.0 {
            // A region with m != 0 may continue outside.
            shell(corner, size).for_each(|cell| set(&mut self.pending, cell, 1, true));
        }
        true
    }

    /// Sets the cells of a block where the whole winding number is not `outside`.
    fn refill(&mut self, corner: [usize; 3], size: usize, outside: i32) {
        for cell in cells_of(corner, size) {
            set(self.grid, cell, 1, self.columns.winding(cell) != outside);
        }
    }

    /// Decides the pending cells of a block one by one.
    fn evaluate(&mut self, corner: [usize; 3], size: usize, outer: &Local) {
        if !any(&self.pending, corner, size) {
            return;
        }
        let mut local = std::mem::take(&mut self.locals[size.ilog2() as usize]);
        let point = eye(corner.map(|index| index + size / 2));
        self.caps.narrow(outer, point, (size / 2) as f64 * 3f64.sqrt(), &mut local);
        if size == FINE {
            // Cells that become pending in this block are decided with it, so that the lists are used once.
            while self.evaluate_cells(corner, &local) {}
        } else {
            eighths(corner, size).for_each(|part| self.evaluate(part, size / 2, &local));
        }
        self.locals[size.ilog2() as usize] = local;
    }

    /// Decides the pending cells of a smallest block; returns whether there were any.
    fn evaluate_cells(&mut self, corner: [usize; 3], local: &Local) -> bool {
        let mut found = false;
        for cell in cells_of(corner, FINE) {
            let [x, y, z] = cell;
            if !self.pending.get(x, y, z) || !self.open.get(x, y, z) || self.seen.get(x, y, z) {
                continue;
            }
            found = true;
            set(&mut self.seen, cell, 1, true);
            let point = eye(cell);
            let mut c = self.caps.winding(local, &point);
            if 0.5 - (c - c.round()).abs() < EXPANSION_ERROR {
                c = self.caps.exact_winding(&point);
            }
            let m = c.round() as i32;
            set(self.grid, cell, 1, self.columns.winding(cell) != m);
            if m != 0 {
                // The region continues next to it.
                shell(cell, 1).for_each(|cell| set(&mut self.pending, cell, 1, true));
            }
        }
        found
    }
}

/// Cells next to caps, where regions begin in which the caps' winding number is not nearly 0: all cells that touch one that a
/// cap over a hole meets, and those next to whose centre a crack runs.
fn beside_caps(caps: &RimCaps, origin: Point3<f64>) -> SolidGrid {
    let holes = Caps::new(&caps.holes);
    let mut met = SolidGrid::new(origin, 1.0);
    mark_surface(holes.triangles().map(|corners| corners.map(|corner| in_ticks(corner.into()))), &mut met);
    let mut cells = dilated(&met);
    for strip in &caps.strips {
        let corners: Vec<Vector3<f64>> = strip.iter().map(|corner| in_cells(*corner).into()).collect();
        mark_beside(&corners, &mut cells);
    }
    cells
}

/// Marks the cells whose centre is so near to a strip that it changes their winding number by more than a hundredth.
///
/// A strip of width w and any length covers w / (4 d) of the view from a distance d, as an integral of 1 / d^2 along
/// it.
fn mark_beside(strip: &[Vector3<f64>], cells: &mut SolidGrid) {
    /// Widths of a strip within which it matters.
    const NEAR: f64 = 25.0;
    let (from, to) = (strip[0], strip[1]);
    let width = strip[2..].iter().map(|corner| distance_to_segment(corner, &from, &to)).fold(0.0, f64::max);
    let reach = (NEAR * width).min(1.5) + width;
    // Piece by piece, so that the boxes around the pieces hold few cells.
    let pieces = (to - from).norm().ceil().max(1.0);
    for piece in 0..pieces as usize {
        let ends = [piece, piece + 1].map(|end| from + (to - from) * (end as f64 / pieces));
        let low = ends[0].inf(&ends[1]).add_scalar(-reach - 0.5);
        let high = ends[0].sup(&ends[1]).add_scalar(reach - 0.5);
        let range =
            |axis: usize| (low[axis].ceil().max(0.0) as usize)..=(high[axis].floor().min(SIDE as f64 - 1.0) as usize);
        for (x, y) in range(0).flat_map(|x| range(1).map(move |y| (x, y))) {
            for z in range(2).filter(|z| distance_to_segment(&eye([x, y, *z]), &from, &to) <= reach) {
                set(cells, [x, y, z], 1, true);
            }
        }
    }
}

/// The cells of a block.
fn cells_of(corner: [usize; 3], size: usize) -> impl Iterator<Item = [usize; 3]> {
    let offsets = (0..size.pow(3)).map(move |i| [i / size / size, i / size % size, i % size]);
    offsets.map(move |offset| std::array::from_fn(|axis| corner[axis] + offset[axis]))
}

/// The eight halves of a block.
fn eighths(corner: [usize; 3], size: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..8).map(move |part| std::array::from_fn(|axis| corner[axis] + (part >> axis & 1) * (size / 2)))
}

/// The cells around a block, those at its edges and corners too.
fn shell(corner: [usize; 3], size: usize) -> impl Iterator<Item = [usize; 3]> {
    let from = corner.map(|index| index.saturating_sub(1));
    let to = corner.map(|index| (index + size + 1).min(SIDE));
    let inside = move |cell: &[usize; 3]| (0..3).all(|axis| (corner[axis]..corner[axis] + size).contains(&cell[axis]));
    (from[0]..to[0])
        .flat_map(move |x| (from[1]..to[1]).flat_map(move |y| (from[2]..to[2]).map(move |z| [x, y, z])))
        .filter(move |cell| !inside(cell))
}

/// The marked cells and all cells that touch one.
fn dilated(grid: &SolidGrid) -> SolidGrid {
    const WORDS: usize = SIDE / 64;
    let mut along_z = grid.clone();
    for (column, marked) in along_z.words.chunks_exact_mut(WORDS).zip(grid.words.chunks_exact(WORDS)) {
        for (index, word) in column.iter_mut().enumerate() {
            let below = if index > 0 { marked[index - 1] >> 63 } else { 0 };
            let above = if index + 1 < WORDS { marked[index + 1] << 63 } else { 0 };
            *word |= marked[index] << 1 | marked[index] >> 1 | below | above;
        }
    }
    let mut dilated = along_z.clone();
    for x in 0..SIDE {
        for y in 0..SIDE {
            for (near_x, near_y) in (x.saturating_sub(1)..(x + 2).min(SIDE))
                .flat_map(|near_x| (y.saturating_sub(1)..(y + 2).min(SIDE)).map(move |near_y| (near_x, near_y)))
            {
                for word in 0..WORDS {
                    dilated.words[(x * SIDE + y) * WORDS + word] |=
                        along_z.words[(near_x * SIDE + near_y) * WORDS + word];
                }
            }
        }
    }
    dilated
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

/// Sets or clears a block.
fn set(grid: &mut SolidGrid, corner: [usize; 3], size: usize, marked: bool) {
    for (word, mask) in words_of(corner, size) {
        if marked {
            grid.words[word] |= mask;
        } else {
            grid.words[word] &= !mask;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::{
        geom::TriMesh,
        voxel::{InsideTest, solid_occupancy},
    };

    /// A cube of 256 cells without its lower and upper face, from quadrangles.
    fn tube() -> TriMesh {
        let vertices = (0..8).map(|corner| [0, 1, 2].map(|axis| f32::from((corner >> axis & 1) as u8))).collect();
        let quads = [[0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        TriMesh { vertices, triangles: quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect() }
    }

    /// A bumpy ball without the faces for which `keep` is false.
    fn ball(keep: impl Fn(usize) -> bool) -> TriMesh {
        let (rings, around) = (20, 40);
        let mut mesh = TriMesh::default();
        for ring in 0..=rings {
            for step in 0..around {
                let (polar, azimuth) = (PI * ring as f64 / rings as f64, 2.0 * PI * step as f64 / around as f64);
                let radius = 1.0 + 0.2 * (3.0 * azimuth).sin() * polar.sin();
                let point = [polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos()];
                mesh.vertices.push(point.map(|value| (value * radius) as f32));
            }
        }
        let at = |ring: usize, step: usize| (ring * around + step % around) as u32;
        let squares = (0..rings).flat_map(|ring| (0..around).map(move |step| (ring, step)));
        mesh.triangles = squares
            .flat_map(|(ring, step)| {
                let [a, b, c, d] = [at(ring, step), at(ring + 1, step), at(ring + 1, step + 1), at(ring, step + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        let mut face = 0;
        mesh.triangles.retain(|_| {
            face += 1;
            keep(face)
        });
        mesh
    }

    /// The generalised winding number straight from its definition, by the solid angles of all triangles (here by the
    /// excess of their angles, Girard's theorem).
    fn winding_number(mesh: &TriMesh, point: &Vector3<f64>) -> f64 {
        let total: f64 = (0..mesh.triangles.len())
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle).map(|corner| (corner.coords - point).normalize());
                let normals = [b.cross(&c), c.cross(&a), a.cross(&b)];
                let angle = |i: usize| PI - normals[i].angle(&normals[(i + 1) % 3]);
                let excess = angle(0) + angle(1) + angle(2) - PI;
                // At the poles two corners coincide.
                if normals.iter().any(|normal| normal.norm() < 1e-9) {
                    0.0
                } else {
                    excess * a.dot(&normals[0]).signum()
                }
            })
            .sum();
        total / (4.0 * PI)
    }

    #[test]
    fn a_flat_hole_is_closed_flat() {
        let mut box_without_lid = tube();
        box_without_lid.triangles.extend([[0, 2, 3], [0, 3, 1]]);
        let grid = solid_occupancy(&box_without_lid, InsideTest::WindingNumber, false);
        assert_eq!(grid.count(), 256 * 256 * 256);
    }

    /// On the axis of a square tube of length 1 the ends cover 4 atan(1 / (2 d sqrt(4 d^2 + 2))) at distance d each.
    #[test]
    fn an_open_tube_is_solid_where_its_ends_cover_less_than_half() {
        let cover = |d: f64| 4.0 * (1.0 / (2.0 * d * (4.0 * d * d + 2.0).sqrt())).atan() / (4.0 * PI);
        let grid = solid_occupancy(&tube(), InsideTest::WindingNumber, false);
        for z in 0..256 {
            let depth = (z as f64 + 0.5) / 256.0;
            let winding = 1.0 - cover(depth) - cover(1.0 - depth);
            if (winding - 0.5).abs() > 0.01 {
                assert_eq!(grid.get(128, 128, z), winding > 0.5, "cell {z}: {winding}");
            }
        }
    }

    #[test]
    fn agrees_with_the_definition_cell_by_cell() {
        type Keep = fn(usize) -> bool;
        let holes: [(&str, Keep); 4] = [
            ("single faces", |face| face % 11 != 0),
            ("every third face", |face| face % 3 != 0),
            ("a large hole", |face| face > 500),
            ("a band", |face| !(600..1000).contains(&face)),
        ];
        for (name, keep) in holes {
            let mesh = ball(keep);
            let grid = solid_occupancy(&mesh, InsideTest::WindingNumber, false);
            let (mut inside, mut clear) = (0, 0);
            for cell in (0..1500usize).map(|i| [i * 97 % 251, i * 61 % 241, i * 43 % 239]) {
                let winding = winding_number(&mesh, &grid.centre(cell[0], cell[1], cell[2]).coords);
                if (winding.abs() - 0.5).abs() > 0.01 {
                    clear += 1;
                    inside += i32::from(winding.abs() > 0.5);
                    assert_eq!(grid.get(cell[0], cell[1], cell[2]), winding.abs() > 0.5, "{name}, {cell:?}: {winding}");
                }
            }
            assert!(clear > 1400 && inside > 300, "{name}: {clear} clear, {inside} inside");
        }
    }

    #[test]
    fn closed_soup_and_closed_mesh_are_the_same_solid() {
        let mesh = ball(|_| true);
        let mut soup = TriMesh::default();
        for triangle in &mesh.triangles {
            let first = soup.vertices.len() as u32;
            soup.vertices.extend(triangle.map(|vertex| mesh.vertices[vertex as usize]));
            soup.triangles.push([first, first + 1, first + 2]);
        }
        let closed = solid_occupancy(&mesh, InsideTest::Crossings, false);
        assert!(closed.count() > 4_000_000);
        assert_eq!(closed, solid_occupancy(&mesh, InsideTest::WindingNumber, false));
        assert_eq!(closed, solid_occupancy(&soup, InsideTest::WindingNumber, false));
    }
}
