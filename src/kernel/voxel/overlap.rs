//! Triangles against cells: which boxes, widened by a tolerance, a triangle meets.
//!
//! Akenine-Moeller 2001, "Fast 3D triangle-box overlap testing": a triangle and a cube are apart when one of thirteen axes
//! separates them: the triangle's normal, the box axes, and each edge crossed with each box axis.
#![expect(unsafe_code, reason = "gathers without checks: the hot path of every view")]

use super::{
    cells::Cells,
    work::{Work, chunk_at, tail_mask},
};
use crate::geom::{Lanes, each_of, simd_kernel};

/// Lists the cells of a triangle's box near its plane that are still empty; the exact test for them, where there are any.
pub(super) fn list_cells(
    corners: &[[f32; 3]; 3],
    tolerance: f32,
    cells: &Cells,
    open: &mut Vec<u32>,
) -> Option<BoxTest> {
    let side = cells.side();
    let last = (side - 2) as f32;
    // Box of the triangle, widened by the tolerance and clipped to the grid's cells without the border.
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
    // Rows run along the normal's largest component, where the plane meets the fewest cells.
    let axis = test.steepest();
    let (second, third) = ((axis + 1) % 3, (axis + 2) % 3);
    let strides = [side * side, side, 1];
    open.clear();
    for j in low[second]..=high[second] {
        for k in low[third]..=high[third] {
            // Interval of the row near the triangle's plane.
            let (from, to) = test.range(axis, j as f64 + 0.5, k as f64 + 0.5);
            let from = (from.max(0.0) as usize).max(low[axis]);
            let to = (to.max(0.0) as usize).min(high[axis]);
            for i in from..=to {
                let index = i * strides[axis] + j * strides[second] + k * strides[third];
                // Cells not marked yet: x, y, z a byte each.
                if cells.bytes[index] == 0 {
                    open.push((i << (8 * axis) | j << (8 * second) | k << (8 * third)) as u32);
                }
            }
        }
    }
    (!open.is_empty()).then_some(test)
}

/// A triangle to be tested against cubes of one size. In double precision: thin triangles have no normal in single.
pub(super) struct BoxTest {
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

    /// The thirteen axes: a cell meets the triangle when no axis separates them.
    pub(super) fn separators(&self) -> [Separation; 13] {
        let mut all = [Separation::default(); 13];
        let [a, b, c] = self.corners;
        let mut slots = all.iter_mut();
        let mut put = |axis: [f64; 3], reach: f64| {
            let along = [a, b, c].map(|p| axis[0] * p[0] + axis[1] * p[1] + axis[2] * p[2]);
            let (low, high) = (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]));
            let middle = (low + high) / 2.0;
            *slots.next().expect("thirteen") = Separation { axis, middle, reach: high - middle + reach };
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
pub(super) struct Separation {
    axis: [f64; 3],
    middle: f64,
    reach: f64,
}

simd_kernel! {
    /// Marks those of the listed cells that no axis separates from the triangle.
    pub(super) fn mark_open(separators: &[Separation; 13], open: &mut Vec<u32>, cells: &mut Cells) = mark_open_body;
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
                let index = ((open[lane] & 0xff) * side + (open[lane] >> 8 & 0xff)) * side + (open[lane] >> 16);
                cells.bytes[index as usize] = 1;
            }
        }
    }
}

simd_kernel! {
    /// Tests the cells of each triangle's box that are not marked yet against the thirteen axes of [`BoxTest`]; lists the
    /// triangles that span more than three cells along an axis instead.
    ///
    /// The box and the plane are tested for sixteen triangles at a time, cell after cell of their boxes. Few lanes
    /// remain then, so their content is gathered, and the edges are tested for sixteen such pairs at a time.
    pub(super) fn test_cells(
        tolerance: f32,
        grid: &[Vec<f32>; 3],
        work: &mut Work,
        wide: &mut Vec<u32>,
        cells: &mut Cells,
    ) = test_cells_body;
}

/// Below this share of its longest side cubed a triangle's normal is too uncertain in single precision to separate
/// anything by; so thin a triangle is as good as its edges.
const THIN: f32 = 2e-3;

/// Cells that a triangle meets as far as its box and its plane decide.
struct Pairs {
    /// Indices in the work list.
    triangles: [u32; Self::ROOM],
    /// x, y, z in `Cells`, a byte each.
    cells: [u32; Self::ROOM],
    count: usize,
}

impl Pairs {
    /// Fifteen that wait, those of one batch, and a vector that a store may spill over.
    const ROOM: usize = 16 + 16 * 27 + 16;
}

#[inline(always)]
fn test_cells_body<L: Lanes>(
    l: L,
    tolerance: f32,
    grid: &[Vec<f32>; 3],
    work: &mut Work,
    wide: &mut Vec<u32>,
    cells: &mut Cells,
) {
    wide.clear();
    let mut pairs = Pairs { triangles: [0; Pairs::ROOM], cells: [0; Pairs::ROOM], count: 0 };
    for start in (0..work.count).step_by(16) {
        // SAFETY: the work list holds indices of vertices; its end is filled up with vertex 0.
        let corners = each_of!([0, 1, 2], corner => unsafe {
            let vertex = l.load_i(chunk_at(&mut work.corners[corner], start));
            [l.gather(&grid[0], vertex), l.gather(&grid[1], vertex), l.gather(&grid[2], vertex)]
        });
        // Boxes and planes of sixteen triangles. Boxes of more than three cells along an axis are listed apart.
        let batch = Batch::new(l, tolerance, cells.side(), corners);
        let two = l.splat_i(2);
        let [x, y, z] = each_of!([0, 1, 2], axis => l.gt_i(batch.span[axis], two));
        let lanes = tail_mask(work.count - start);
        let mut left = l.bits(l.either(l.either(x, y), z)) & lanes;
        let lanes = lanes & !left;
        while left != 0 {
            wide.push(start as u32 + left.trailing_zeros());
            left &= left - 1;
        }
        // Pairs that box and plane leave, tested in whole sixteens.
        list_pairs(l, &batch, start, lanes, cells, &mut pairs);
        let whole = pairs.count & !15;
        for first in (0..whole).step_by(16) {
            test_pairs(l, tolerance, grid, work, &pairs, first, 0xffff, cells);
        }
        // Remainder moves to the front and waits for the next batch.
        if whole > 0 {
            pairs.triangles.copy_within(whole..whole + 16, 0);
            pairs.cells.copy_within(whole..whole + 16, 0);
            pairs.count -= whole;
        }
    }
    // Last, partly filled sixteen.
    test_pairs(l, tolerance, grid, work, &pairs, 0, tail_mask(pairs.count), cells);
}

/// Sixteen triangles, their boxes and planes, relative to the middle of the first cell of their boxes.
struct Batch<L: Lanes> {
    /// First cell of the box: x, y, z in `Cells`, a byte each.
    first: L::I,
    /// Index of that cell.
    index: L::I,
    /// Cells of the box along each axis, less one.
    span: [L::I; 3],
    /// Change of the projection on the normal per cell, and the interval in which the plane is met.
    step: [L::F; 3],
    low: L::F,
    high: L::F,
    /// Too thin for a plane.
    thin: L::M,
}

impl<L: Lanes> Batch<L> {
    #[inline(always)]
    fn new(l: L, tolerance: f32, side: usize, [a, b, c]: [[L::F; 3]; 3]) -> Self {
        let (zero, last, slack) = (l.splat(0.0), l.splat((side - 1) as f32), l.splat(tolerance));
        let (half, side) = (l.splat(0.5 + tolerance), l.splat_i(side as i32));
        // First and last cell of the box, widened by the tolerance and clamped to the grid.
        let low = each_of!([0, 1, 2], axis => {
            let min = l.sub(l.min(l.min(a[axis], b[axis]), c[axis]), slack);
            l.truncate(l.max(l.min(min, last), zero))
        });
        let high = each_of!([0, 1, 2], axis => {
            let max = l.add(l.max(l.max(a[axis], b[axis]), c[axis]), slack);
            l.truncate(l.max(l.min(max, last), zero))
        });
        // Corners relative to the middle of the first cell: small numbers, less rounding.
        let middle = each_of!([0, 1, 2], axis => l.add(l.to_float(low[axis]), l.splat(0.5)));
        let [a, b, c] = each_of!([a, b, c], corner => each_of!([0, 1, 2], axis => l.sub(corner[axis], middle[axis])));
        // Edges at corner a and the normal: the projection's change per cell along each axis.
        let p = each_of!([0, 1, 2], axis => l.sub(b[axis], a[axis]));
        let q = each_of!([0, 1, 2], axis => l.sub(c[axis], a[axis]));
        let step = each_of!([(1, 2), (2, 0), (0, 1)], (j, k) => l.sub(l.mul(p[j], q[k]), l.mul(p[k], q[j])));
        // Half extent of the cell along the normal (Akenine-Moeller 2001, plane and box).
        let size = l.add(l.add(l.abs(step[0]), l.abs(step[1])), l.abs(step[2]));
        let reach = l.mul(half, size);
        let along = l.add(l.add(l.mul(step[0], a[0]), l.mul(step[1], a[1])), l.mul(step[2], a[2]));
        // Longest component of the two edges at a, the measure for thin triangles.
        let longest = each_of!([0, 1, 2], axis => l.max(l.abs(p[axis]), l.abs(q[axis])));
        let longest = l.max(l.max(longest[0], longest[1]), longest[2]);
        Self {
            first: l.or_i(l.or_i(low[0], l.shl_i::<8>(low[1])), l.shl_i::<16>(low[2])),
            index: l.add_i(l.mul_i(l.add_i(l.mul_i(low[0], side), low[1]), side), low[2]),
            span: each_of!([0, 1, 2], axis => l.sub_i(high[axis], low[axis])),
            step,
            low: l.sub(along, reach),
            high: l.add(along, reach),
            thin: l.lt(size, l.mul(l.splat(THIN), l.mul(longest, l.mul(longest, longest)))),
        }
    }
}

/// Lists the unmarked cells of sixteen triangles' boxes, of up to three cells per side, that the planes meet.
#[inline(always)]
fn list_pairs<L: Lanes>(l: L, batch: &Batch<L>, start: usize, lanes: u32, cells: &Cells, pairs: &mut Pairs) {
    let side = cells.side() as i32;
    let Batch { first, index, span, step, low, high, thin } = batch;
    let lane = l.load_i(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    // Work list entries of these lanes.
    let triangles = l.add_i(l.splat_i(start as i32), lane);
    for x in 0..3 {
        let in_x = l.gt_i(span[0], l.splat_i(x - 1));
        if l.bits(in_x) & lanes == 0 {
            break;
        }
        // Projection on the normal grows by constants from cell to cell.
        let at_x = l.mul(l.splat(x as f32), step[0]);
        for y in 0..3 {
            let in_y = l.both(in_x, l.gt_i(span[1], l.splat_i(y - 1)));
            if l.bits(in_y) & lanes == 0 {
                break;
            }
            let at_y = l.add(at_x, l.mul(l.splat(y as f32), step[1]));
            // Row along z: the marks of its cells come in one gather.
            let row = l.add_i(*index, l.splat_i((x * side + y) * side));
            // SAFETY: a row past the box lies in the bytes or in their slack, which holds two planes and two rows.
            let marked = unsafe { l.gather_bytes(&cells.bytes, row) };
            for z in 0..3 {
                // Cells of the box that are still unmarked and whose interval the plane meets.
                let own = l.and_i(marked, l.splat_i(1 << (8 * z)));
                let in_z = l.both(in_y, l.gt_i(span[2], l.splat_i(z - 1)));
                let open = l.both(in_z, l.eq_i(own, l.splat_i(0)));
                let at = l.add(at_y, l.mul(l.splat(z as f32), step[2]));
                let near = l.either(*thin, l.both(l.ge(at, *low), l.ge(*high, at)));
                let found = l.bits(l.both(open, near)) & lanes;
                if found != 0 {
                    // Compact triangle and cell of each pair.
                    let cell = l.add_i(*first, l.splat_i(x | y << 8 | z << 16));
                    l.compress(found, triangles, chunk_at(&mut pairs.triangles, pairs.count));
                    l.compress(found, cell, chunk_at(&mut pairs.cells, pairs.count));
                    pairs.count += found.count_ones() as usize;
                }
            }
        }
    }
}

/// Marks the cells of sixteen pairs, those of `lanes`, that no edge crossed with a box axis separates from their triangle.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a part of one kernel")]
fn test_pairs<L: Lanes>(
    l: L,
    tolerance: f32,
    grid: &[Vec<f32>; 3],
    work: &Work,
    pairs: &Pairs,
    start: usize,
    lanes: u32,
    cells: &mut Cells,
) {
    let half = l.splat(0.5 + tolerance);
    let (byte, middle) = (l.splat_i(0xff), l.splat(0.5));
    let cell = l.load_i(pairs.cells[start..][..16].try_into().expect("sixteen"));
    let cell = [l.and_i(cell, byte), l.and_i(l.shr_i::<8>(cell), byte), l.shr_i::<16>(cell)];
    let triangle = l.load_i(pairs.triangles[start..][..16].try_into().expect("sixteen"));
    // SAFETY: pairs name entries of the work list, which holds indices of vertices; those not set yet name the first one.
    let [a, b, c] = each_of!([0, 1, 2], corner => unsafe {
        let vertex = l.gather_i(&work.corners[corner], triangle);
        each_of!([0, 1, 2], axis => {
            l.sub(l.gather(&grid[axis], vertex), l.add(l.to_float(cell[axis]), middle))
        })
    });
    // Nine cross axes of Akenine-Moeller 2001: each edge with each box axis, corners relative to the cell.
    let mut meets = l.ge(half, l.splat(0.0));
    each_of!([(a, b, c), (b, c, a), (c, a, b)], (p, q, r) => {
        each_of!([(1, 2), (2, 0), (0, 1)], (j, k) => {
            meets = l.both(meets, edge_meets(l, [p[j], p[k]], [q[j], q[k]], [r[j], r[k]], half));
        });
    });
    // Mark the cells that no axis separates.
    let mut hits = l.bits(meets) & lanes;
    let side = l.splat_i(cells.side() as i32);
    let mut indices = [0; 16];
    l.store_i(l.add_i(l.mul_i(l.add_i(l.mul_i(cell[0], side), cell[1]), side), cell[2]), &mut indices);
    while hits != 0 {
        cells.bytes[indices[hits.trailing_zeros() as usize] as usize] = 1;
        hits &= hits - 1;
    }
}

/// Whether the cross product of edge `p` to `q` and a box axis fails to separate the triangle from a box around the origin;
/// `r` is the third corner, all of them without their coordinate along that axis.
#[inline(always)]
fn edge_meets<L: Lanes>(l: L, p: [L::F; 2], q: [L::F; 2], r: [L::F; 2], half: L::F) -> L::M {
    let (along_j, along_k) = (l.sub(q[0], p[0]), l.sub(q[1], p[1]));
    let of_p = l.sub(l.mul(p[1], along_j), l.mul(p[0], along_k));
    let of_r = l.sub(l.mul(r[1], along_j), l.mul(r[0], along_k));
    let reach = l.mul(half, l.add(l.abs(along_j), l.abs(along_k)));
    l.both(l.ge(reach, l.min(of_p, of_r)), l.ge(l.max(of_p, of_r), l.sub(l.splat(0.0), reach)))
}
