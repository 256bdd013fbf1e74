//! Triangles against cells: which boxes, widened by a tolerance, a triangle meets.
//!
//! Akenine-Moeller 2001, "Fast 3D triangle-box overlap testing": a triangle and a cube are apart when one of thirteen axes
//! tells them apart: the triangle's normal, the box axes, and each edge crossed with each box axis.
#![expect(unsafe_code, reason = "gathers without checks: the hot path of every view")]

use super::{
    cells::Cells,
    complete::{Work, chunk_at, tail_mask},
};
use crate::geom::{Lanes, each_of, kernel};

/// Lists the cells of a triangle's box near its plane that are still empty; the exact test for them, where there are any.
pub(super) fn list_cells(
    corners: &[[f32; 3]; 3],
    tolerance: f32,
    cells: &Cells,
    open: &mut Vec<u32>,
) -> Option<BoxTest> {
    let side = cells.side();
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
    open.clear();
    for j in low[second]..=high[second] {
        for k in low[third]..=high[third] {
            let (from, to) = test.range(axis, j as f64 + 0.5, k as f64 + 0.5);
            let from = (from.max(0.0) as usize).max(low[axis]);
            let to = (to.max(0.0) as usize).min(high[axis]);
            for i in from..=to {
                let place = i * strides[axis] + j * strides[second] + k * strides[third];
                if cells.bytes[place] == 0 {
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

    /// The thirteen axes: a cell meets the triangle when no axis tells them apart.
    pub(super) fn separators(&self) -> [Separation; 13] {
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
pub(super) struct Separation {
    axis: [f64; 3],
    middle: f64,
    reach: f64,
}

kernel! {
    /// Marks those of the listed cells that no axis tells from the triangle.
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
                let place = ((open[lane] & 0xff) * side + (open[lane] >> 8 & 0xff)) * side + (open[lane] >> 16);
                cells.bytes[place as usize] = 1;
            }
        }
    }
}

kernel! {
    /// Tests the cells of each triangle's box that are not marked yet, sixteen triangles at a time, against the thirteen
    /// axes of [`BoxTest`]; lists the triangles that span more than three cells along an axis instead.
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

/// Sixteen triangles ready to be tested, relative to the middle of the first cell of their boxes.
struct Batch<L: Lanes> {
    /// Cells of the box along each axis, less one.
    span: [L::I; 3],
    /// Place of the first cell.
    first: L::I,
    /// The plane's axis, then those of the edges.
    separators: [Separator<L>; 10],
    /// Too thin for a plane.
    thin: L::M,
}

impl<L: Lanes> Batch<L> {
    #[inline(always)]
    fn new(l: L, tolerance: f32, side: usize, [a, b, c]: [[L::F; 3]; 3]) -> Self {
        let (zero, last, slack) = (l.splat(0.0), l.splat((side - 1) as f32), l.splat(tolerance));
        let (half, side) = (l.splat(0.5 + tolerance), l.splat_i(side as i32));
        let low = each_of!([0, 1, 2], axis => {
            let min = l.sub(l.min(l.min(a[axis], b[axis]), c[axis]), slack);
            l.truncate(l.max(l.min(min, last), zero))
        });
        let high = each_of!([0, 1, 2], axis => {
            let max = l.add(l.max(l.max(a[axis], b[axis]), c[axis]), slack);
            l.truncate(l.max(l.min(max, last), zero))
        });
        let span = each_of!([0, 1, 2], axis => l.sub_i(high[axis], low[axis]));
        let first = l.add_i(l.mul_i(l.add_i(l.mul_i(low[0], side), low[1]), side), low[2]);
        let middle = each_of!([0, 1, 2], axis => l.add(l.to_float(low[axis]), l.splat(0.5)));
        let [a, b, c] = each_of!([a, b, c], corner => each_of!([0, 1, 2], axis => l.sub(corner[axis], middle[axis])));
        let p = each_of!([0, 1, 2], axis => l.sub(b[axis], a[axis]));
        let q = each_of!([0, 1, 2], axis => l.sub(c[axis], a[axis]));
        let normal = each_of!([(1, 2), (2, 0), (0, 1)], (j, k) => l.sub(l.mul(p[j], q[k]), l.mul(p[k], q[j])));
        let size = l.add(l.add(l.abs(normal[0]), l.abs(normal[1])), l.abs(normal[2]));
        let reach = l.mul(half, size);
        let along = l.add(l.add(l.mul(normal[0], a[0]), l.mul(normal[1], a[1])), l.mul(normal[2], a[2]));
        let longest = each_of!([0, 1, 2], axis => l.max(l.abs(p[axis]), l.abs(q[axis])));
        let longest = l.max(l.max(longest[0], longest[1]), longest[2]);
        let thin = l.lt(size, l.mul(l.splat(THIN), l.mul(longest, l.mul(longest, longest))));
        let plane = Separator { step: normal, low: l.sub(along, reach), high: l.add(along, reach) };
        let [[e0, e1, e2], [e3, e4, e5], [e6, e7, e8]] = each_of!([(a, b, c), (b, c, a), (c, a, b)], (p, q, r) => {
            each_of!([0, 1, 2], axis => Separator::of_edge(l, axis, p, q, r, half))
        });
        Self { span, first, separators: [plane, e0, e1, e2, e3, e4, e5, e6, e7, e8], thin }
    }
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
    let side = cells.side();
    let two = l.splat_i(2);
    for start in (0..work.count).step_by(16) {
        // SAFETY: the work list holds places of vertices; its end is filled up with vertex 0.
        let corners = each_of!([0, 1, 2], corner => unsafe {
            let vertex = l.load_i(chunk_at(&mut work.corners[corner], start));
            [l.gather(&grid[0], vertex), l.gather(&grid[1], vertex), l.gather(&grid[2], vertex)]
        });
        let batch = Batch::new(l, tolerance, side, corners);
        let [x, y, z] = each_of!([0, 1, 2], axis => l.gt_i(batch.span[axis], two));
        let lanes = tail_mask(work.count - start);
        let mut left = l.bits(l.either(l.either(x, y), z)) & lanes;
        let lanes = lanes & !left;
        while left != 0 {
            wide.push(start as u32 + left.trailing_zeros());
            left &= left - 1;
        }
        test_batch(l, &batch, lanes, cells);
    }
}

/// Tests the unmarked cells of sixteen triangles' boxes, of up to three cells a side.
#[inline(always)]
fn test_batch<L: Lanes>(l: L, batch: &Batch<L>, lanes: u32, cells: &mut Cells) {
    let side = cells.side() as i32;
    let Batch { span, first, separators, thin } = batch;
    let zero = l.splat(0.0);
    // How far the first axes have moved each projection.
    let (mut after_x, mut after_y) = ([zero; 10], [zero; 10]);
    for x in 0..3 {
        let in_x = l.gt_i(span[0], l.splat_i(x - 1));
        if l.bits(in_x) & lanes == 0 {
            break;
        }
        for (after, separator) in after_x.iter_mut().zip(separators) {
            *after = l.mul(l.splat(x as f32), separator.step[0]);
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
            let row = l.add_i(*first, l.splat_i((x * side + y) * side));
            // SAFETY: a row past the box lies in the bytes or in their slack, which holds two planes and two rows.
            let marked = unsafe { l.gather_bytes(&cells.bytes, row) };
            for z in 0..3 {
                let own = l.and_i(marked, l.splat_i(1 << (8 * z)));
                let in_z = l.both(in_y, l.gt_i(span[2], l.splat_i(z - 1)));
                let mut meets = l.both(in_z, l.eq_i(own, l.splat_i(0)));
                if l.bits(meets) & lanes == 0 {
                    continue;
                }
                for separator in 0..10 {
                    let Separator { step, low, high } = &separators[separator];
                    let at = l.add(after_y[separator], l.mul(l.splat(z as f32), step[2]));
                    let near = l.both(l.ge(at, *low), l.ge(*high, at));
                    meets = l.both(meets, if separator == 0 { l.either(*thin, near) } else { near });
                    if separator == 0 && l.bits(meets) & lanes == 0 {
                        break;
                    }
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
