//! Which cells of a view's grid the surface meets.
//!
//! A closed cell box, widened by a tolerance, against every triangle. Most triangles of a scan lie in one cell or in two
//! neighbours along one axis, which their vertices mark; only the others ask for an exact test.
#![expect(unsafe_code, reason = "gathers and stores without checks: the hot path of every view")]

use super::cells::Cells;
use crate::geom::{Affine, CameraCv, GridPlacement, Lanes, Object, Pose, RenderMesh, SimdLevel, each_of, kernel};

/// Where depth points may lie beside the surface, as a share of their distance from the camera: the rounding of a
/// rasteriser in single precision, with a margin of about three. Cells are widened by this much, so that a depth point
/// never falls into a cell that the surface is not said to meet.
pub(super) const DEPTH_ROUNDING: f64 = 1e-6;

/// Vertices in grid coordinates and the work lists; used again for every view.
#[derive(Default)]
pub(super) struct Surface {
    /// Grid coordinates plus one (the border) of every vertex [cells].
    grid: [Vec<f32>; 3],
    /// Cell of every vertex in `Cells`: x, y, z a byte each; the highest byte is [`NEAR_WALL`] when a wall is within the
    /// tolerance.
    packed: Vec<u32>,
    /// Place of that cell in `Cells`.
    places: Vec<u32>,
    /// Triangles that ask for an exact test.
    work: [Vec<u32>; 3],
    work_count: usize,
    /// Those of them that span more than three cells along an axis: places in `work`.
    wide: Vec<u32>,
    /// Cells of one of them that are not marked yet: x, y, z in `Cells`, a byte each.
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
        self.places.resize(vertices, 0);
        let to_grid = ToGrid::new(mesh, camera_from_object, placement);
        place_vertices(level, &mesh.positions, &to_grid, cells.side(), self);
        for place in &self.places {
            // SAFETY: places come from indices clamped to the cells and their border.
            unsafe { *cells.bytes.get_unchecked_mut(*place as usize) = 1 };
        }
        list_work(level, &mesh.corners, self);
        drop_settled(level, cells, self);
        test_cells(level, to_grid.tolerance, cells, self);
        for entry in 0..self.wide.len() {
            if let Some(test) = self.list_cells(self.wide[entry] as usize, to_grid.tolerance, cells) {
                mark_open(level, &test.separators(), &mut self.open, cells);
            }
        }
    }

    /// The grid coordinates of the vertices, without the border's one: for winding along columns.
    pub(super) fn corner(&self, vertex: u32) -> [f64; 3] {
        self.grid.each_ref().map(|axis| f64::from(axis[vertex as usize]) - 1.0)
    }

    /// Lists the cells of a triangle's box near its plane that are still empty; the exact test for them, where there are any.
    fn list_cells(&mut self, entry: usize, tolerance: f32, cells: &Cells) -> Option<BoxTest> {
        let side = cells.side();
        let corners = self.work.each_ref().map(|corner| {
            let vertex = corner[entry] as usize;
            self.grid.each_ref().map(|axis| axis[vertex])
        });
        let last = (side - 2) as f32;
        let (mut low, mut high) = ([0; 3], [0; 3]);
        for axis in 0..3 {
            let [a, b, c] = corners.map(|corner| corner[axis]);
            let (min, max) = (a.min(b).min(c) - tolerance, a.max(b).max(c) + tolerance);
            if max < 1.0 || min >= last + 1.0 {
                return None;
            }
            low[axis] = min.max(1.0) as usize;
            high[axis] = max.min(last) as usize;
        }
        let test = BoxTest::new(&corners.map(|corner| corner.map(f64::from)), 0.5 + f64::from(tolerance));
        let axis = test.steepest();
        let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
        let strides = [side * side, side, 1];
        self.open.clear();
        for j in low[second]..=high[second] {
            for k in low[third]..=high[third] {
                let (from, to) = test.range(axis, j as f64 + 0.5, k as f64 + 0.5);
                let from = (from.max(0.0) as usize).max(low[axis]);
                let to = (to.max(0.0) as usize).min(high[axis]);
                for i in from..=to {
                    let place = i * strides[axis] + j * strides[second] + k * strides[third];
                    if cells.bytes[place] == 0 {
                        self.open.push((i << (8 * axis) | j << (8 * second) | k << (8 * third)) as u32);
                    }
                }
            }
        }
        (!self.open.is_empty()).then_some(test)
    }
}

/// Overlap of a triangle with cubes of one size (Akenine-Moeller 2001, "Fast 3D triangle-box overlap testing"): thirteen
/// axes, on each of which the two must not be apart. In double precision: thin triangles have no normal in single.
struct BoxTest {
    corners: [[f64; 3]; 3],
    normal: [f64; 3],
    half: f64,
    /// Reach of the box along the normal.
    reach: f64,
}

impl BoxTest {
    fn new(corners: &[[f64; 3]; 3], half: f64) -> Self {
        let [a, b, c] = corners;
        let (p, q): ([f64; 3], [f64; 3]) =
            (std::array::from_fn(|axis| b[axis] - a[axis]), std::array::from_fn(|axis| c[axis] - a[axis]));
        let normal = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
        let reach = half * (normal[0].abs() + normal[1].abs() + normal[2].abs());
        Self { corners: *corners, normal, half, reach }
    }

    /// The axis that the normal follows most.
    fn steepest(&self) -> usize {
        let [x, y, z] = self.normal.map(f64::abs);
        if x >= y && x >= z {
            0
        } else if y >= z {
            1
        } else {
            2
        }
    }

    /// First and last coordinate along `axis` whose cells the triangle's plane may meet, at the middle of the other two
    /// axes; a superset by half a cell. Everything for a triangle without area.
    fn range(&self, axis: usize, second: f64, third: f64) -> (f64, f64) {
        let normal = self.normal[axis];
        if normal.abs() < 1e-12 {
            return (f64::NEG_INFINITY, f64::INFINITY);
        }
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = &self.corners[0];
        let across = self.normal[j] * (second - corner[j]) + self.normal[k] * (third - corner[k]);
        let middle = corner[axis] - across / normal;
        let reach = self.reach / normal.abs() + 0.5;
        (middle - reach, middle + reach)
    }

    /// The thirteen axes: a cell meets the triangle when no axis tells them apart.
    fn separators(&self) -> [Separation; 13] {
        let mut all = [Separation::default(); 13];
        let [a, b, c] = self.corners;
        let mut places = all.iter_mut();
        let mut put = |axis: [f64; 3], reach: f64| {
            let along = [a, b, c].map(|p| axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2]);
            let (low, high) = (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]));
            let middle = (low + high) / 2.0;
            *places.next().expect("thirteen") = Separation { axis, middle, reach: high - middle + reach };
        };
        put(self.normal, self.reach);
        for axis in 0..3 {
            put(std::array::from_fn(|other| f64::from(u8::from(other == axis))), self.half);
        }
        for (p, q) in [(&a, &b), (&b, &c), (&c, &a)] {
            let edge: [f64; 3] = std::array::from_fn(|axis| q[axis] - p[axis]);
            for axis in 0..3 {
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                let mut cross = [0.0; 3];
                (cross[j], cross[k]) = (-edge[k], edge[j]);
                put(cross, self.half * (edge[j].abs() + edge[k].abs()));
            }
        }
        all
    }
}

/// An axis, and how far from `middle` along it a cell's centre may lie and still meet the triangle.
#[derive(Clone, Copy, Default)]
struct Separation {
    axis: [f64; 3],
    middle: f64,
    reach: f64,
}

kernel! {
    /// Marks those of the listed cells that no axis tells from the triangle.
    fn mark_open(separators: &[Separation; 13], open: &mut Vec<u32>, cells: &mut Cells) = mark_open_body;
}

#[inline(always)]
fn mark_open_body<L: Lanes>(_: L, separators: &[Separation; 13], open: &mut Vec<u32>, cells: &mut Cells) {
    let side = cells.side() as u32;
    let count = open.len();
    open.resize(count.next_multiple_of(16), open[0]);
    for open in open.as_chunks::<16>().0 {
        let (mut x, mut y, mut z, mut apart) = ([0.0; 16], [0.0; 16], [0.0; 16], [f64::NEG_INFINITY; 16]);
        for lane in 0..16 {
            x[lane] = f64::from(open[lane] & 0xff) + 0.5;
            y[lane] = f64::from(open[lane] >> 8 & 0xff) + 0.5;
            z[lane] = f64::from(open[lane] >> 16) + 0.5;
        }
        for Separation { axis, middle, reach } in separators {
            for lane in 0..16 {
                let along = axis[0] * x[lane] + axis[1] * y[lane] + axis[2] * z[lane];
                let gap = (along - middle).abs() - reach;
                apart[lane] = if gap > apart[lane] { gap } else { apart[lane] };
            }
        }
        for lane in 0..16 {
            if apart[lane] <= 0.0 {
                let place = ((open[lane] & 0xff) * side + (open[lane] >> 8 & 0xff)) * side + (open[lane] >> 16);
                cells.bytes[place as usize] = 1;
            }
        }
    }
}

kernel! {
    /// Every vertex to the grid.
    fn place_vertices(positions: &[Vec<f32>; 3], to_grid: &ToGrid, side: usize, out: &mut Surface) = place_vertices_body;
}

#[inline(always)]
fn place_vertices_body<L: Lanes>(l: L, positions: &[Vec<f32>; 3], to_grid: &ToGrid, side: usize, out: &mut Surface) {
    let [to_x, to_y, to_z] = each_of!([0, 1, 2], row => Affine::new(l, to_grid.rows[row]));
    let (zero, one) = (l.splat(0.0), l.splat(1.0));
    let last = l.splat((side - 1) as f32);
    let (low_wall, high_wall) = (l.splat(to_grid.tolerance), l.splat(1.0 - to_grid.tolerance));
    let side = l.splat_i(side as i32);
    let [x, y, z] = positions.each_ref().map(|axis| axis.as_chunks::<16>().0);
    let [gx, gy, gz] = out.grid.each_mut().map(|axis| axis.as_chunks_mut::<16>().0);
    let (packed, places) = (out.packed.as_chunks_mut::<16>().0, out.places.as_chunks_mut::<16>().0);
    let vertices = x.iter().zip(y).zip(z);
    let outputs = gx.iter_mut().zip(gy).zip(gz).zip(packed.iter_mut().zip(places));
    for (((x, y), z), (((gx, gy), gz), (packed, place))) in vertices.zip(outputs) {
        let (x, y, z) = (l.load(x), l.load(y), l.load(z));
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
        let wall = l.select(near, l.splat(NEAR_WALL as f32), zero);
        let cell_bytes = l.or_i(l.or_i(cell[0], l.shl_i::<8>(cell[1])), l.shl_i::<16>(cell[2]));
        l.store_i(l.or_i(cell_bytes, l.truncate(wall)), packed);
        l.store_i(l.add_i(l.mul_i(l.add_i(l.mul_i(cell[0], side), cell[1]), side), cell[2]), place);
    }
}

kernel! {
    /// Lists the triangles whose vertices do not mark all that they meet: those that span two axes or three cells, and
    /// those with a vertex near a wall.
    fn list_work(corners: &[Vec<u32>; 3], out: &mut Surface) = list_work_body;
}

#[inline(always)]
fn list_work_body<L: Lanes>(l: L, corners: &[Vec<u32>; 3], out: &mut Surface) {
    let room = corners[0].len() + 16;
    for list in &mut out.work {
        if list.len() < room {
            list.resize(room, 0);
        }
    }
    let mut count = 0;
    let (zero, one) = (l.splat_i(0), l.splat_i(1));
    let [a, b, c] = corners.each_ref().map(|corner| corner.as_chunks::<16>().0);
    for ((a, b), c) in a.iter().zip(b).zip(c) {
        let [a, b, c] = each_of!([a, b, c], corner => l.load_i(corner));
        // SAFETY: a mesh's corners are places of its vertices, and every vertex has been placed.
        let [pa, pb, pc] = each_of!([a, b, c], corner => unsafe { l.gather_i(&out.packed, corner) });
        let max = l.max_u8(l.max_u8(pa, pb), pc);
        let span = l.sub_u8(max, l.min_u8(l.min_u8(pa, pb), pc));
        // Bytes x, y, z of the span, and the wall of any vertex.
        let cells = l.splat_i(0x00ff_ffff);
        let span = l.or_i(l.and_i(span, cells), l.and_i(max, l.splat_i(0xff00_0000_u32 as i32)));
        let single = l.eq_i(l.and_i(span, l.sub_i(span, one)), zero);
        let short = l.eq_i(l.and_i(span, l.splat_i(0xfffe_fefe_u32 as i32)), zero);
        let work = l.bits(l.not(l.both(single, short)));
        if work == 0 {
            continue;
        }
        each_of!([(a, 0), (b, 1), (c, 2)], (value, list) => {
            l.compress(work, value, chunk_at(&mut out.work[list], count))
        });
        count += work.count_ones() as usize;
    }
    out.work_count = count;
}

#[inline(always)]
fn chunk_at(list: &mut [u32], start: usize) -> &mut [u32; 16] {
    (&mut list[start..start + 16]).try_into().expect("sixteen")
}

kernel! {
    /// Drops the triangles of the work list whose box holds marked cells only.
    fn drop_settled(cells: &Cells, out: &mut Surface) = drop_settled_body;
}

#[inline(always)]
fn drop_settled_body<L: Lanes>(l: L, cells: &Cells, out: &mut Surface) {
    let side = l.splat_i(cells.side() as i32);
    let (zero, byte) = (l.splat_i(0), l.splat_i(0xff));
    let count = out.work_count;
    let mut kept = 0;
    for start in (0..count).step_by(16) {
        let [a, b, c] = each_of!([0, 1, 2], corner => l.load_i(chunk_at(&mut out.work[corner], start)));
        // SAFETY: the work list holds places of vertices; its end is filled up with what stood there, or with 0.
        let [pa, pb, pc] = each_of!([a, b, c], corner => unsafe { l.gather_i(&out.packed, corner) });
        let max = l.max_u8(l.max_u8(pa, pb), pc);
        let min = l.min_u8(l.min_u8(pa, pb), pc);
        let span = l.or_i(l.and_i(l.sub_u8(max, min), l.splat_i(0x00ff_ffff)), l.and_i(max, l.splat_i(NEAR_WALL)));
        // At most two cells along x and y, four along z, and no vertex near a wall.
        let narrow = l.eq_i(l.and_i(span, l.splat_i(0xfffc_fefe_u32 as i32)), zero);
        let (x, y, z) = (l.and_i(min, byte), l.and_i(l.shr_i::<8>(min), byte), l.and_i(l.shr_i::<16>(min), byte));
        let place = l.add_i(l.mul_i(l.add_i(l.mul_i(x, side), y), side), z);
        let step_y = l.mul_i(l.and_i(l.shr_i::<8>(span), l.splat_i(1)), side);
        let step_x = l.mul_i(l.mul_i(l.and_i(span, l.splat_i(1)), side), side);
        let other = l.add_i(place, step_x);
        // SAFETY: both ends of the box are cells or border; four bytes from the last one lie in the slack.
        let rows = each_of!(
            [place, l.add_i(place, step_y), other, l.add_i(other, step_y)],
            place => unsafe { l.gather_bytes(&cells.bytes, place) }
        );
        let marked = l.and_i(l.and_i(rows[0], rows[1]), l.and_i(rows[2], rows[3]));
        // 0x01 for each cell of the box along z.
        let missing = l.sub_i(l.splat_i(24), l.shl_i::<3>(l.and_i(l.shr_i::<16>(span), l.splat_i(3))));
        let asked = l.shr_each(l.splat_i(0x0101_0101), missing);
        let settled = l.both(narrow, l.eq_i(l.and_i(marked, asked), asked));
        let keep = l.bits(l.not(settled)) & tail_mask(count - start);
        each_of!([(a, 0), (b, 1), (c, 2)], (value, list) => l.compress(keep, value, chunk_at(&mut out.work[list], kept)));
        kept += keep.count_ones() as usize;
    }
    out.work_count = kept;
}

/// Bits of the lanes that hold one of the `left` entries still to come.
fn tail_mask(left: usize) -> u32 {
    if left < 16 { (1 << left) - 1 } else { 0xffff }
}

kernel! {
    /// Tests the cells of each triangle's box that are not marked yet, sixteen triangles at a time, against the thirteen
    /// axes of [`BoxTest`]; lists the triangles that span more than three cells along an axis instead.
    fn test_cells(tolerance: f32, cells: &mut Cells, out: &mut Surface) = test_cells_body;
}

/// Below this share of its longest side cubed a triangle's normal is too uncertain in single precision to separate
/// anything by; so thin a triangle is as good as its edges.
const THIN: f32 = 2e-3;

/// One axis that may separate: how the projection moves with the cell, and between what.
struct Separator<L: Lanes> {
    step: [L::F; 3],
    low: L::F,
    high: L::F,
}

impl<L: Lanes> Separator<L> {
    /// The cross product of an edge with box axis `axis`; `p` is a corner on the edge, `r` the third corner.
    #[inline(always)]
    fn of_edge(l: L, axis: usize, p: [L::F; 3], q: [L::F; 3], r: [L::F; 3], half: L::F) -> Self {
        let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
        let zero = l.splat(0.0);
        let (along_j, along_k) = (l.sub(q[j], p[j]), l.sub(q[k], p[k]));
        let of_p = l.sub(l.mul(p[k], along_j), l.mul(p[j], along_k));
        let of_r = l.sub(l.mul(r[k], along_j), l.mul(r[j], along_k));
        let reach = l.mul(half, l.add(l.abs(along_j), l.abs(along_k)));
        let mut step = [zero; 3];
        step[k] = along_j;
        step[j] = l.sub(zero, along_k);
        Self { step, low: l.sub(l.min(of_p, of_r), reach), high: l.add(l.max(of_p, of_r), reach) }
    }
}

#[inline(always)]
fn test_cells_body<L: Lanes>(l: L, tolerance: f32, cells: &mut Cells, out: &mut Surface) {
    out.wide.clear();
    let side = cells.side();
    let strides = [(side * side) as i32, side as i32];
    let (zero, last, slack) = (l.splat(0.0), l.splat((side - 1) as f32), l.splat(tolerance));
    let half = l.splat(0.5 + tolerance);
    let (two_i, zero_i, side_i) = (l.splat_i(2), l.splat_i(0), l.splat_i(side as i32));
    let count = out.work_count;
    for start in (0..count).step_by(16) {
        let lanes = tail_mask(count - start);
        let index = each_of!([0, 1, 2], corner => l.load_i(chunk_at(&mut out.work[corner], start)));
        // SAFETY: the work list holds places of vertices; its end is filled up with what stood there, or with 0.
        let [a, b, c] = each_of!([index[0], index[1], index[2]], corner => unsafe {
            [l.gather(&out.grid[0], corner), l.gather(&out.grid[1], corner), l.gather(&out.grid[2], corner)]
        });
        let (low, high) = (
            each_of!([0, 1, 2], axis => {
                let min = l.sub(l.min(l.min(a[axis], b[axis]), c[axis]), slack);
                l.truncate(l.max(l.min(min, last), zero))
            }),
            each_of!([0, 1, 2], axis => {
                let max = l.add(l.max(l.max(a[axis], b[axis]), c[axis]), slack);
                l.truncate(l.max(l.min(max, last), zero))
            }),
        );
        let span = each_of!([0, 1, 2], axis => l.sub_i(high[axis], low[axis]));
        let wide = l.either(l.either(l.gt_i(span[0], two_i), l.gt_i(span[1], two_i)), l.gt_i(span[2], two_i));
        let mut wide = l.bits(wide) & lanes;
        let lanes = lanes & !wide;
        while wide != 0 {
            out.wide.push(start as u32 + wide.trailing_zeros());
            wide &= wide - 1;
        }
        let place = l.add_i(l.mul_i(l.add_i(l.mul_i(low[0], side_i), low[1]), side_i), low[2]);
        // From here on relative to the middle of the first cell.
        let middle = each_of!([0, 1, 2], axis => l.add(l.to_float(low[axis]), l.splat(0.5)));
        let [a, b, c] = each_of!([a, b, c], corner => each_of!([0, 1, 2], axis => l.sub(corner[axis], middle[axis])));
        let (p, q) = (
            each_of!([0, 1, 2], axis => l.sub(b[axis], a[axis])),
            each_of!([0, 1, 2], axis => l.sub(c[axis], a[axis])),
        );
        let normal = each_of!([(1, 2), (2, 0), (0, 1)], (j, k) => l.sub(l.mul(p[j], q[k]), l.mul(p[k], q[j])));
        let size = l.add(l.add(l.abs(normal[0]), l.abs(normal[1])), l.abs(normal[2]));
        let reach = l.mul(half, size);
        let along = l.add(l.add(l.mul(normal[0], a[0]), l.mul(normal[1], a[1])), l.mul(normal[2], a[2]));
        let longest = each_of!([0, 1, 2], axis => l.max(l.abs(p[axis]), l.abs(q[axis])));
        let longest = l.max(l.max(longest[0], longest[1]), longest[2]);
        let thin = l.lt(size, l.mul(l.splat(THIN), l.mul(longest, l.mul(longest, longest))));
        let plane_step = normal[2];
        let plane = Separator { step: normal, low: l.sub(along, reach), high: l.add(along, reach) };
        let [[e0, e1, e2], [e3, e4, e5], [e6, e7, e8]] = each_of!([(a, b, c), (b, c, a), (c, a, b)], (p, q, r) => {
            each_of!([0, 1, 2], axis => Separator::of_edge(l, axis, p, q, r, half))
        });
        let separators = [plane, e0, e1, e2, e3, e4, e5, e6, e7, e8];
        // How far the first axes have moved each projection.
        let (mut after_x, mut after_y) = ([zero; 10], [zero; 10]);
        for x in 0..3 {
            let in_x = l.gt_i(span[0], l.splat_i(x - 1));
            if l.bits(in_x) & lanes == 0 {
                break;
            }
            for separator in 0..10 {
                after_x[separator] = l.mul(l.splat(x as f32), separators[separator].step[0]);
            }
            for y in 0..3 {
                let in_y = l.both(in_x, l.gt_i(span[1], l.splat_i(y - 1)));
                if l.bits(in_y) & lanes == 0 {
                    break;
                }
                for separator in 0..10 {
                    let step = l.mul(l.splat(y as f32), separators[separator].step[1]);
                    after_y[separator] = l.add(after_x[separator], step);
                }
                let row = l.add_i(place, l.splat_i(x * strides[0] + y * strides[1]));
                // SAFETY: a row past the box lies in the bytes or in their slack, which holds two planes and two rows.
                let marked = unsafe { l.gather_bytes(&cells.bytes, row) };
                for z in 0..3 {
                    let own = l.and_i(marked, l.splat_i(1 << (8 * z)));
                    let in_z = l.both(in_y, l.gt_i(span[2], l.splat_i(z - 1)));
                    let open = l.both(in_z, l.eq_i(own, zero_i));
                    if l.bits(open) & lanes == 0 {
                        continue;
                    }
                    let z_step = l.splat(z as f32);
                    let at = l.add(after_y[0], l.mul(z_step, plane_step));
                    let near_plane = l.both(l.ge(at, separators[0].low), l.ge(separators[0].high, at));
                    let mut meets = l.both(open, l.either(thin, near_plane));
                    if l.bits(meets) & lanes == 0 {
                        continue;
                    }
                    for separator in 1..10 {
                        let Separator { step, low, high } = &separators[separator];
                        let at = l.add(after_y[separator], l.mul(z_step, step[2]));
                        meets = l.both(meets, l.both(l.ge(at, *low), l.ge(*high, at)));
                    }
                    let mut hits = l.bits(meets) & lanes;
                    if hits == 0 {
                        continue;
                    }
                    let mut places = [0; 16];
                    l.store_i(row, &mut places);
                    while hits != 0 {
                        cells.bytes[places[hits.trailing_zeros() as usize] as usize + z as usize] = 1;
                        hits &= hits - 1;
                    }
                }
            }
        }
    }
}
