//! Which cells of a view's grid the surface meets.
//!
//! A closed cell box, widened by a tolerance, against every triangle. Most triangles of a scan are in one cell or in
//! two neighbours along one axis, which their vertices mark; only the others need an exact test.
#![expect(unsafe_code, reason = "gathers and stores without checks: the hot path of every view")]

use super::{
    cells::Cells,
    overlap::{list_cells, mark_open, test_cells},
    work::{Work, chunk_at, tail_mask},
};
use crate::geom::{Affine, CameraCv, GridPlacement, Lanes, Object, Pose, RenderMesh, SimdLevel, each_of, simd_kernel};

/// Largest distance of depth points from the surface, as a share of their distance from the camera: the rounding of a
/// rasteriser in single precision, with a margin of about three. Cells are widened by this much, so that a depth point
/// never falls into a cell that is not marked as surface.
pub(super) const DEPTH_ROUNDING: f64 = 1e-6;

/// Vertices in grid coordinates and the work lists; used again for every view.
#[derive(Default)]
pub(super) struct Surface {
    /// Grid coordinates plus one (the border) of every vertex [cells].
    grid: [Vec<f32>; 3],
    /// Lowest and highest coordinate.
    bounds: [[f32; 3]; 2],
    /// Cell of every vertex in `Cells`: x, y, z a byte each; the highest byte is [`NEAR_WALL`] when a wall is within the
    /// tolerance.
    packed: Vec<u32>,
    /// Index of that cell in `Cells`.
    indices: Vec<u32>,
    /// Triangles that need an exact test.
    work: Work,
    /// Triangles that span more than three cells along an axis: indices in `work`.
    wide: Vec<u32>,
    /// Cells of one wide triangle that are not marked yet: x, y, z in `Cells`, a byte each.
    open: Vec<u32>,
}

const NEAR_WALL: i32 = 2 << 24;

/// From positions relative to the middle of the mesh's box to grid coordinates plus one.
struct ToGrid {
    rows: [[f32; 4]; 3],
    tolerance: f32,
}

impl ToGrid {
    fn new(mesh: &RenderMesh, camera_from_object: &Pose<CameraCv, Object>, placement: &GridPlacement) -> Self {
        let (rows, anchor) = (mesh.rows(camera_from_object), placement.anchor());
        let farthest = rows[2][3].abs() + mesh.radius();
        let n = f64::from(placement.resolution);
        // Grid coordinates are rounded a few times in single precision.
        let tolerance = DEPTH_ROUNDING * farthest / placement.cell_size + 5e-7 * n;
        let rows = std::array::from_fn(|axis| {
            let [a, b, c, d] = rows[axis];
            let offset = (d - placement.centre[axis]) / placement.cell_size + anchor[axis] + 1.0;
            [a / placement.cell_size, b / placement.cell_size, c / placement.cell_size, offset]
                .map(|value| value as f32)
        });
        Self { rows, tolerance: tolerance as f32 }
    }
}

impl Surface {
    /// Marks every cell whose box, widened by the tolerance, meets a triangle.
    pub(super) fn mark(
        &mut self,
        level: SimdLevel,
        mesh: &RenderMesh,
        camera_from_object: &Pose<CameraCv, Object>,
        placement: &GridPlacement,
        cells: &mut Cells,
    ) {
        let vertices = mesh.positions[0].len();
        for axis in &mut self.grid {
            axis.resize(vertices, 0.0);
        }
        self.packed.resize(vertices, 0);
        self.indices.resize(vertices, 0);
        let to_grid = ToGrid::new(mesh, camera_from_object, placement);
        locate_vertices(level, &mesh.positions, &to_grid, cells.side(), self);
        for index in &self.indices {
            // SAFETY: indices come from coordinates clamped to the cells and their border.
            unsafe { *cells.bytes.get_unchecked_mut(*index as usize) = 1 };
        }
        list_work(level, &mesh.corners, self);
        drop_settled(level, cells, self);
        test_cells(level, to_grid.tolerance, &self.grid, &mut self.work, &mut self.wide, cells);
        for entry in &self.wide {
            let corners = self.work.corners.each_ref().map(|corner| {
                let vertex = corner[*entry as usize] as usize;
                self.grid.each_ref().map(|axis| axis[vertex])
            });
            if let Some(test) = list_cells(&corners, to_grid.tolerance, cells, &mut self.open) {
                mark_open(level, &test.separators(), &mut self.open, cells);
            }
        }
    }

    /// Whether the mesh ends inside a grid of `n` cells: before x = 0, before y = 0, before z = 0, after the last z.
    pub(super) fn ends_inside(&self, n: usize) -> [bool; 4] {
        let [low, high] = self.bounds;
        [low[0] >= 1.0, low[1] >= 1.0, low[2] >= 1.0, high[2] < n as f32 + 1.0]
    }

    /// The grid coordinates of the vertices, without the border's one: for winding along columns.
    pub(super) fn corner(&self, vertex: u32) -> [f64; 3] {
        self.grid.each_ref().map(|axis| f64::from(axis[vertex as usize]) - 1.0)
    }
}

simd_kernel! {
    /// Every vertex to the grid.
    fn locate_vertices(positions: &[Vec<f32>; 3], to_grid: &ToGrid, side: usize, out: &mut Surface) = locate_vertices_body;
}

#[inline(always)]
fn locate_vertices_body<L: Lanes>(l: L, positions: &[Vec<f32>; 3], to_grid: &ToGrid, side: usize, out: &mut Surface) {
    let [to_x, to_y, to_z] = each_of!([0, 1, 2], row => Affine::new(l, to_grid.rows[row]));
    let (zero, one) = (l.splat(0.0), l.splat(1.0));
    let last = l.splat((side - 1) as f32);
    let (low_wall, high_wall) = (l.splat(to_grid.tolerance), l.splat(1.0 - to_grid.tolerance));
    let side = l.splat_i(side as i32);
    let [x, y, z] = positions.each_ref().map(|axis| axis.as_chunks::<16>().0);
    let [gx, gy, gz] = out.grid.each_mut().map(|axis| axis.as_chunks_mut::<16>().0);
    let (packed, indices) = (out.packed.as_chunks_mut::<16>().0, out.indices.as_chunks_mut::<16>().0);
    let vertices = x.iter().zip(y).zip(z);
    let (mut lowest, mut highest) = ([l.splat(f32::INFINITY); 3], [l.splat(f32::NEG_INFINITY); 3]);
    let outputs = gx.iter_mut().zip(gy).zip(gz).zip(packed.iter_mut().zip(indices));
    for (((x, y), z), (((gx, gy), gz), (packed, index))) in vertices.zip(outputs) {
        let (x, y, z) = (l.load(x), l.load(y), l.load(z));
        // Affine map to grid coordinates.
        let g = each_of!([&to_x, &to_y, &to_z], row => row.at(l, x, y, z));
        let mut near = l.lt(one, zero);
        let cell = each_of!([g[0], g[1], g[2]], g => {
            // Clamped to the border, so truncation is floor.
            let clamped = l.max(l.min(g, last), zero);
            let cell = l.truncate(clamped);
            let share = l.sub(clamped, l.to_float(cell));
            near = l.either(near, l.either(l.lt(share, low_wall), l.lt(high_wall, share)));
            cell
        });
        l.store(g[0], gx);
        l.store(g[1], gy);
        l.store(g[2], gz);
        // Bounds over all vertices, lane by lane.
        lowest = each_of!([0, 1, 2], axis => l.min(g[axis], lowest[axis]));
        highest = each_of!([0, 1, 2], axis => l.max(g[axis], highest[axis]));
        // Cell as three bytes and the wall mark, then its index in C order.
        let wall = l.select(near, l.splat(NEAR_WALL as f32), zero);
        let cell_bytes = l.or_i(l.or_i(cell[0], l.shl_i::<8>(cell[1])), l.shl_i::<16>(cell[2]));
        l.store_i(l.or_i(cell_bytes, l.truncate(wall)), packed);
        l.store_i(l.add_i(l.mul_i(l.add_i(l.mul_i(cell[0], side), cell[1]), side), cell[2]), index);
    }
    // Reduce the lanes to one box.
    let mut lanes = [0.0; 16];
    for axis in 0..3 {
        l.store(lowest[axis], &mut lanes);
        out.bounds[0][axis] = lanes.iter().copied().fold(f32::INFINITY, f32::min);
        l.store(highest[axis], &mut lanes);
        out.bounds[1][axis] = lanes.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    }
}

simd_kernel! {
    /// Lists the triangles whose vertices do not mark all that they meet: those that span two axes or three cells, and
    /// those with a vertex near a wall.
    fn list_work(corners: &[Vec<u32>; 3], out: &mut Surface) = list_work_body;
}

#[inline(always)]
fn list_work_body<L: Lanes>(l: L, corners: &[Vec<u32>; 3], out: &mut Surface) {
    let room = corners[0].len() + 16;
    for list in &mut out.work.corners {
        if list.len() < room {
            list.resize(room, 0);
        }
    }
    let mut count = 0;
    let (zero, one) = (l.splat_i(0), l.splat_i(1));
    let [a, b, c] = corners.each_ref().map(|corner| corner.as_chunks::<16>().0);
    for ((a, b), c) in a.iter().zip(b).zip(c) {
        let [a, b, c] = each_of!([a, b, c], corner => l.load_i(corner));
        // SAFETY: a mesh's corners are indices of its vertices, and every vertex has been placed.
        let [pa, pb, pc] = each_of!([a, b, c], corner => unsafe { l.gather_i(&out.packed, corner) });
        // Extent of the three cells, byte by byte: largest minus smallest.
        let max = l.max_u8(l.max_u8(pa, pb), pc);
        let span = l.sub_u8(max, l.min_u8(l.min_u8(pa, pb), pc));
        // Bytes x, y, z of the span, and the wall of any vertex.
        let cells = l.splat_i(0x00ff_ffff);
        let span = l.or_i(l.and_i(span, cells), l.and_i(max, l.splat_i(0xff00_0000_u32 as i32)));
        // At most one bit set, and no axis beyond one: a single cell or two neighbours along one axis, off the walls.
        let single = l.eq_i(l.and_i(span, l.sub_i(span, one)), zero);
        let short = l.eq_i(l.and_i(span, l.splat_i(0xfffe_fefe_u32 as i32)), zero);
        let work = l.bits(l.not(l.both(single, short)));
        if work == 0 {
            continue;
        }
        // Compact the triangles that need the exact test.
        each_of!([(a, 0), (b, 1), (c, 2)], (value, list) => {
            l.compress(work, value, chunk_at(&mut out.work.corners[list], count))
        });
        count += work.count_ones() as usize;
    }
    out.work.finish(count);
}

simd_kernel! {
    /// Drops the triangles of the work list whose box holds marked cells only.
    fn drop_settled(cells: &Cells, out: &mut Surface) = drop_settled_body;
}

#[inline(always)]
fn drop_settled_body<L: Lanes>(l: L, cells: &Cells, out: &mut Surface) {
    let side = l.splat_i(cells.side() as i32);
    let (zero, byte) = (l.splat_i(0), l.splat_i(0xff));
    let count = out.work.count;
    let mut kept = 0;
    for start in (0..count).step_by(16) {
        let [a, b, c] = each_of!([0, 1, 2], corner => l.load_i(chunk_at(&mut out.work.corners[corner], start)));
        // SAFETY: the work list holds indices of vertices; its end is filled up with vertex 0.
        let [pa, pb, pc] = each_of!([a, b, c], corner => unsafe { l.gather_i(&out.packed, corner) });
        // Box of the three cells: extent, smallest corner and wall mark.
        let max = l.max_u8(l.max_u8(pa, pb), pc);
        let min = l.min_u8(l.min_u8(pa, pb), pc);
        let span = l.or_i(l.and_i(l.sub_u8(max, min), l.splat_i(0x00ff_ffff)), l.and_i(max, l.splat_i(NEAR_WALL)));
        // At most two cells along x and y, four along z, and no vertex near a wall.
        let narrow = l.eq_i(l.and_i(span, l.splat_i(0xfffc_fefe_u32 as i32)), zero);
        // Index of the box's first cell in C order.
        let (x, y, z) = (l.and_i(min, byte), l.and_i(l.shr_i::<8>(min), byte), l.and_i(l.shr_i::<16>(min), byte));
        let index = l.add_i(l.mul_i(l.add_i(l.mul_i(x, side), y), side), z);
        // Offsets of the box's four rows along z.
        let step_y = l.mul_i(l.and_i(l.shr_i::<8>(span), l.splat_i(1)), side);
        let step_x = l.mul_i(l.mul_i(l.and_i(span, l.splat_i(1)), side), side);
        let other = l.add_i(index, step_x);
        // SAFETY: both ends of the box are cells or border; four bytes from the last one lie in the slack.
        let rows = unsafe {
            each_of!(
                [index, l.add_i(index, step_y), other, l.add_i(other, step_y)],
                start => l.gather_bytes(&cells.bytes, start)
            )
        };
        let marked = l.and_i(l.and_i(rows[0], rows[1]), l.and_i(rows[2], rows[3]));
        // 0x01 for each cell of the box along z.
        let missing = l.sub_i(l.splat_i(24), l.shl_i::<3>(l.and_i(l.shr_i::<16>(span), l.splat_i(3))));
        let asked = l.shr_each(l.splat_i(0x0101_0101), missing);
        // Every cell of the box is marked: nothing left to add.
        let settled = l.both(narrow, l.eq_i(l.and_i(marked, asked), asked));
        let keep = l.bits(l.not(settled)) & tail_mask(count - start);
        // Compact the others in front of the list.
        each_of!([(a, 0), (b, 1), (c, 2)], (value, list) => l.compress(keep, value, chunk_at(&mut out.work.corners[list], kept)));
        kept += keep.count_ones() as usize;
    }
    out.work.finish(kept);
}
