//! Which cells of a view's grid the surface meets.
//!
//! A closed cell box, widened by a tolerance, against every triangle. Most triangles of a scan lie in one cell or in two
//! neighbours along one axis, which their vertices mark; only the others ask for an exact test.
#![expect(unsafe_code, reason = "gathers and stores without checks: the hot path of every view")]

use super::cells::Cells;
use crate::geom::{CameraCv, GridPlacement, Lanes, Object, Pose, RenderMesh, SimdLevel, kernel};

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
        for entry in 0..self.work_count {
            self.mark_triangle(entry, to_grid.tolerance, cells);
        }
    }

    /// The grid coordinates of the vertices, without the border's one: for winding along columns.
    pub(super) fn corner(&self, vertex: u32) -> [f64; 3] {
        self.grid.each_ref().map(|axis| f64::from(axis[vertex as usize]) - 1.0)
    }

    /// Every cell of the triangle's box that is still empty gets the exact test.
    fn mark_triangle(&self, entry: usize, tolerance: f32, cells: &mut Cells) {
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
                return;
            }
            low[axis] = min.max(1.0) as usize;
            high[axis] = max.min(last) as usize;
        }
        let test = BoxTest::new(&corners.map(|corner| corner.map(f64::from)), 0.5 + f64::from(tolerance));
        let axis = test.steepest();
        let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
        let strides = [side * side, side, 1];
        for j in low[second]..=high[second] {
            for k in low[third]..=high[third] {
                let (from, to) = test.range(axis, j as f64 + 0.5, k as f64 + 0.5);
                let from = (from.max(0.0) as usize).max(low[axis]);
                let to = (to.max(0.0) as usize).min(high[axis]);
                for i in from..=to {
                    let place = i * strides[axis] + j * strides[second] + k * strides[third];
                    if cells.bytes[place] == 0 {
                        let mut centre = [0.0; 3];
                        (centre[axis], centre[second], centre[third]) =
                            (i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
                        cells.bytes[place] = u8::from(test.meets(centre));
                    }
                }
            }
        }
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

    fn meets(&self, centre: [f64; 3]) -> bool {
        let [a, b, c] =
            self.corners.map(|corner| -> [f64; 3] { std::array::from_fn(|axis| corner[axis] - centre[axis]) });
        for axis in 0..3 {
            let (min, max) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
            if min > self.half || max < -self.half {
                return false;
            }
        }
        let along = self.normal[0] * a[0] + self.normal[1] * a[1] + self.normal[2] * a[2];
        if along.abs() > self.reach {
            return false;
        }
        // Edge directions crossed with the box axes.
        for (p, q, r) in [(&a, &b, &c), (&b, &c, &a), (&c, &a, &b)] {
            let edge: [f64; 3] = std::array::from_fn(|axis| q[axis] - p[axis]);
            for axis in 0..3 {
                let (j, k) = ((axis + 1) % 3, (axis + 2) % 3);
                let along_p = p[k] * edge[j] - p[j] * edge[k];
                let along_r = r[k] * edge[j] - r[j] * edge[k];
                let reach = self.half * (edge[j].abs() + edge[k].abs());
                if along_p.min(along_r) > reach || along_p.max(along_r) < -reach {
                    return false;
                }
            }
        }
        true
    }
}

kernel! {
    /// Every vertex to the grid.
    fn place_vertices(positions: &[Vec<f32>; 3], to_grid: &ToGrid, side: usize, out: &mut Surface) = place_vertices_body;
}

#[inline(always)]
fn place_vertices_body<L: Lanes>(l: L, positions: &[Vec<f32>; 3], to_grid: &ToGrid, side: usize, out: &mut Surface) {
    let rows = to_grid.rows.map(|row| row.map(|value| l.splat(value)));
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
        let g = rows.map(|[a, b, c, d]| l.add(l.add(l.add(l.mul(a, x), l.mul(b, y)), l.mul(c, z)), d));
        let mut near = l.lt(one, zero);
        let cell = g.map(|g| {
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
        let [a, b, c] = [a, b, c].map(|corner| l.load_i(corner));
        // SAFETY: a mesh's corners are places of its vertices, and every vertex has been placed.
        let [pa, pb, pc] = [a, b, c].map(|corner| unsafe { l.gather_i(&out.packed, corner) });
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
        for (value, list) in [a, b, c].into_iter().zip(&mut out.work) {
            l.compress(work, value, (&mut list[count..count + 16]).try_into().expect("sixteen"));
        }
        count += work.count_ones() as usize;
    }
    out.work_count = count;
}
