//! The rasteriser's inner loops, written once over [`Lanes`].
#![expect(unsafe_code, reason = "gathers without bounds checks: the hot path of every view")]

use crate::geom::{Affine, Facing, Lanes, RenderMesh, each_of, simd_kernel};

/// Vertices in image coordinates [px] and inverse depth [1/m].
#[derive(Default)]
pub(super) struct Projected {
    u: Vec<f32>,
    v: Vec<f32>,
    w: Vec<f32>,
    /// First column and row whose pixel centre is not left of, above the vertex, clamped to the image: two signed 16-bit
    /// numbers, the column in the lower half.
    packed: Vec<u32>,
}

/// One point in image coordinates.
#[derive(Clone, Copy)]
pub(super) struct Fragment {
    pub(super) u: f32,
    pub(super) v: f32,
    pub(super) w: f32,
}

impl Projected {
    pub(super) fn resize(&mut self, vertices: usize) {
        for values in [&mut self.u, &mut self.v, &mut self.w] {
            values.resize(vertices, 0.0);
        }
        self.packed.resize(vertices, 0);
    }

    pub(super) fn push(&mut self, point: Fragment, low: [f32; 2], high: [f32; 2]) -> u32 {
        let column = point.u.min(high[0]).max(low[0]).ceil() as i32;
        let row = point.v.min(high[1]).max(low[1]).ceil() as i32;
        self.u.push(point.u);
        self.v.push(point.v);
        self.w.push(point.w);
        self.packed.push((row << 16 | column & 0xffff) as u32);
        self.u.len() as u32 - 1
    }

    /// Column and row of a vertex, as packed.
    pub(super) fn pixel(&self, vertex: u32) -> [i32; 2] {
        unpack(self.packed[vertex as usize])
    }

    fn point(&self, vertex: u32) -> Fragment {
        let vertex = vertex as usize;
        Fragment { u: self.u[vertex], v: self.v[vertex], w: self.w[vertex] }
    }
}

fn unpack(packed: u32) -> [i32; 2] {
    [i32::from(packed as i16), (packed as i32) >> 16]
}

/// Classes of triangles that are drawn sixteen at a time: at most 1, 3 and 7 pixels in each direction.
pub(super) const SMALL_CLASSES: usize = 3;

/// The class of the others, drawn one by one.
const LARGE: usize = SMALL_CLASSES;

/// Bits that a size of each class does not have, in both halves.
const BEYOND: [u32; SMALL_CLASSES + 1] = [0xfffe_fffe, 0xfffc_fffc, 0xfff8_fff8, 0];

/// Triangles whose box holds a pixel centre, by size.
#[derive(Default)]
pub(super) struct Survivors([Survivor; SMALL_CLASSES + 1]);

/// Three vertices, first pixel, columns and rows (packed like vertices) of each.
#[derive(Default)]
struct Survivor {
    lists: [Vec<u32>; 5],
    count: usize,
}

/// The z-buffer over a box of the image.
#[derive(Default)]
pub(super) struct Target {
    /// First column and row of the box [px].
    left: i32,
    top: i32,
    pub(super) width: usize,
    height: usize,
    /// Inverse depth [1/m], 0 = nothing yet; sixteen more at the end, so that whole vectors may reach past the last row.
    depth: Vec<f32>,
}

impl Target {
    /// Clears the buffer for a box: first column, first row, past-the-end column, past-the-end row.
    pub(super) fn reset(&mut self, [left, top, right, bottom]: [i32; 4]) {
        let (width, height) = ((right - left).max(0) as usize, (bottom - top).max(0) as usize);
        self.left = left;
        self.top = top;
        (self.width, self.height) = if width * height > 0 { (width, height) } else { (0, 0) };
        self.depth.clear();
        self.depth.resize(width * height + 16, 0.0);
    }

    fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.depth.chunks_exact(self.width).take(self.height)
    }

    #[inline(always)]
    fn draw(&mut self, column: i32, row: i32, w: f32) {
        let index = (row - self.top) as usize * self.width + (column - self.left) as usize;
        let pixel = &mut self.depth[index];
        if w > *pixel {
            *pixel = w;
        }
    }
}

/// From positions relative to the middle of the mesh's box to image coordinates.
pub(super) struct Projection {
    /// Rows of the pose; the first two times the focal length.
    pub(super) rows: [[f32; 4]; 3],
    /// Added to image coordinates [px].
    pub(super) offset: [f32; 2],
    /// First column and row of the image [px].
    pub(super) low: [f32; 2],
    /// Past-the-end column and row of the image [px].
    pub(super) high: [f32; 2],
}

simd_kernel! {
    /// Projects every vertex; returns the box of the packed pixels.
    pub(super) fn project(positions: &[Vec<f32>; 3], projection: &Projection, out: &mut Projected) -> [f32; 4]
        = project_body;
}

#[inline(always)]
fn project_body<L: Lanes>(l: L, positions: &[Vec<f32>; 3], projection: &Projection, out: &mut Projected) -> [f32; 4] {
    let [to_x, to_y, to_z] = each_of!([0, 1, 2], row => Affine::new(l, projection.rows[row]));
    let [offset_u, offset_v] = each_of!([0, 1], axis => l.splat(projection.offset[axis]));
    let [low_u, low_v] = each_of!([0, 1], axis => l.splat(projection.low[axis]));
    let [high_u, high_v] = each_of!([0, 1], axis => l.splat(projection.high[axis]));
    let (zero, one) = (l.splat(0.0), l.splat(1.0));
    // Bounds start empty: lower at the image's far end, upper at its near end.
    let (mut min_u, mut min_v, mut max_u, mut max_v) = (high_u, high_v, low_u, low_v);
    let [x, y, z] = positions.each_ref().map(|axis| axis.as_chunks::<16>().0);
    let (u, v) = (out.u.as_chunks_mut::<16>().0, out.v.as_chunks_mut::<16>().0);
    let (w, packed) = (out.w.as_chunks_mut::<16>().0, out.packed.as_chunks_mut::<16>().0);
    let vertices = x.iter().zip(y).zip(z);
    for (((((x, y), z), u_out), v_out), (w_out, packed_out)) in vertices.zip(u).zip(v).zip(w.iter_mut().zip(packed)) {
        // Pinhole projection: w = 1 / z, image coordinates x w and y w plus the offset.
        let (x, y, z) = (l.load(x), l.load(y), l.load(z));
        let (x, y, z) = (to_x.at(l, x, y, z), to_y.at(l, x, y, z), to_z.at(l, x, y, z));
        let w = l.div(one, z);
        let u = l.add(l.mul(x, w), offset_u);
        let v = l.add(l.mul(y, w), offset_v);
        // Ceiling of the clamped coordinate: truncation, plus one where that rounded down.
        let [column, row] = each_of!([(u, low_u, high_u), (v, low_v, high_v)], (value, low, high) => {
            let value = l.max(l.min(value, high), low);
            let whole = l.to_float(l.truncate(value));
            l.add(whole, l.select(l.lt(whole, value), one, zero))
        });
        (min_u, max_u) = (l.min(min_u, column), l.max(max_u, column));
        (min_v, max_v) = (l.min(min_v, row), l.max(max_v, row));
        l.store(u, u_out);
        l.store(v, v_out);
        l.store(w, w_out);
        // Column in the lower half, row in the upper half of one word.
        let low_half = l.and_i(l.truncate(column), l.splat_i(0xffff));
        l.store_i(l.or_i(l.shl_i::<16>(l.truncate(row)), low_half), packed_out);
    }
    // Reduce the sixteen lanes of each bound.
    let mut lanes = [[0.0; 16]; 4];
    for (value, lanes) in [min_u, min_v, max_u, max_v].into_iter().zip(&mut lanes) {
        l.store(value, lanes);
    }
    let [min_u, min_v, max_u, max_v] = lanes;
    let (min, max) =
        (|a: [f32; 16]| a.into_iter().fold(a[0], f32::min), |a: [f32; 16]| a.into_iter().fold(a[0], f32::max));
    [min(min_u), min(min_v), max(max_u), max(max_v)]
}

simd_kernel! {
    /// Lists the triangles of some clusters whose box holds a pixel centre: first pixel <= centre < last pixel in both
    /// directions. Each vertex brings one number, so a triangle costs three gathers.
    pub(super) fn cull(
        corners: &[Vec<u32>; 3],
        normals: &[u32],
        clusters: &[Facing],
        projected: &Projected,
        out: &mut Survivors,
    ) = cull_body;
}

#[inline(always)]
fn cull_body<L: Lanes>(
    l: L,
    corners: &[Vec<u32>; 3],
    normals: &[u32],
    clusters: &[Facing],
    projected: &Projected,
    out: &mut Survivors,
) {
    // Each list holds all triangles and one vector that a store may spill over.
    let room = clusters.len() * RenderMesh::CLUSTER + 16;
    for class in &mut out.0 {
        class.count = 0;
        for list in &mut class.lists {
            if list.len() < room {
                list.resize(room, 0);
            }
        }
    }
    let (zero, low_half, high_half) = (l.splat_i(0), l.splat_i(0xffff), l.splat_i(0xffff_0000_u32 as i32));
    for Facing { cluster, ray, away } in clusters {
        let first = *cluster as usize * RenderMesh::CLUSTER;
        let run = corners.each_ref().map(|corner| corner[first..first + RenderMesh::CLUSTER].as_chunks::<16>().0);
        let normals = normals[first..first + RenderMesh::CLUSTER].as_chunks::<16>().0;
        let [ray_x, ray_y, ray_z] = each_of!([0, 1, 2], axis => l.splat(ray[axis]));
        let away = l.splat(*away);
        for (((a, b), c), normal) in run[0].iter().zip(run[1]).zip(run[2]).zip(normals) {
            // Signed bytes of the normal, by shifts.
            let normal = l.load_i(normal);
            let x = l.to_float(l.sar_i::<24>(l.shl_i::<24>(normal)));
            let y = l.to_float(l.sar_i::<24>(l.shl_i::<16>(normal)));
            let z = l.to_float(l.sar_i::<24>(l.shl_i::<8>(normal)));
            // Back-face test: the product of normal and viewing ray against the cluster's limit.
            let along = l.add(l.add(l.mul(x, ray_x), l.mul(y, ray_y)), l.mul(z, ray_z));
            let faces_away = l.bits(l.lt(away, along));
            if faces_away == 0xffff {
                continue;
            }
            let [a, b, c] = each_of!([a, b, c], corner => l.load_i(corner));
            // SAFETY: a mesh's corners are indices of its vertices, and every vertex has been projected.
            let [pa, pb, pc] = each_of!([a, b, c], corner => unsafe { l.gather_i(&projected.packed, corner) });
            // Pixel box from packed 16-bit pairs: lower corner and span in both directions at once.
            let min = l.min_i16(l.min_i16(pa, pb), pc);
            let span = l.sub_i16(l.max_i16(l.max_i16(pa, pb), pc), min);
            // Empty boxes hold no pixel centre.
            let none = l.either(l.eq_i(l.and_i(span, low_half), zero), l.eq_i(l.and_i(span, high_half), zero));
            let mut left = l.bits(l.not(none)) & !faces_away;
            // Smallest class that both sizes fit takes the triangle.
            for (Survivor { lists, count }, beyond) in out.0.iter_mut().zip(BEYOND) {
                if left == 0 {
                    break;
                }
                let chosen = left & l.bits(l.eq_i(l.and_i(span, l.splat_i(beyond as i32)), zero));
                if chosen != 0 {
                    each_of!([(a, 0), (b, 1), (c, 2), (min, 3), (span, 4)], (value, list) => {
                        l.compress(chosen, value, chunk_at(&mut lists[list], *count))
                    });
                    *count += chosen.count_ones() as usize;
                    left &= !chosen;
                }
            }
        }
    }
}

#[inline(always)]
fn chunk_at(list: &mut [u32], start: usize) -> &mut [u32; 16] {
    (&mut list[start..start + 16]).try_into().expect("sixteen")
}

simd_kernel! {
    /// Draws the triangles of a small class, sixteen triangles at a time.
    pub(super) fn fill_small(
        survivors: &mut Survivors,
        class: usize,
        projected: &Projected,
        two_sided: bool,
        target: &mut Target,
    ) = fill_small_body;
}

/// Bound on the variation of depth over a triangle of each class, in shares of its area [1/px^2], for single precision.
/// With coordinates of at most m px edge functions are off by up to m^2 2^-23 px^2: depth then stays within 2e-7 of
/// itself.
const STEEP: [f32; SMALL_CLASSES] = [1.0, 1.0 / 9.0, 1.0 / 49.0];

#[inline(always)]
fn fill_small_body<L: Lanes>(
    l: L,
    survivors: &mut Survivors,
    class: usize,
    projected: &Projected,
    two_sided: bool,
    target: &mut Target,
) {
    let Survivor { lists, count } = &mut survivors.0[class];
    let (count, max) = (*count, 2 << class);
    // Fill the last sixteen up with triangles of no pixel.
    for list in lists.iter_mut() {
        list[count..].iter_mut().take(16).for_each(|entry| *entry = 0);
    }
    let zero = l.splat(0.0);
    for start in (0..count).step_by(16) {
        let [a, b, c, min, span] = each_of!([0, 1, 2, 3, 4], list => {
            l.load_i(lists[list][start..start + 16].try_into().expect("sixteen"))
        });
        // SAFETY: a survivor's corners are indices of projected vertices; fillers name vertex 0.
        let [[au, av, aw], [bu, bv, bw], [cu, cv, cw]] = each_of!([a, b, c], corner => unsafe {
            [l.gather(&projected.u, corner), l.gather(&projected.v, corner), l.gather(&projected.w, corner)]
        });
        // Box unpacked: first pixel, and counts of columns and rows.
        let (column, row) = (l.sar_i::<16>(l.shl_i::<16>(min)), l.sar_i::<16>(min));
        let (columns, rows) = (l.and_i(span, l.splat_i(0xffff)), l.shr_i::<16>(span));
        // Inverse depth is linear in the image: its change along both edges, and the limit on steepness.
        let (to_b, to_c) = (l.sub(bw, aw), l.sub(cw, aw));
        let (varies, flattest) = (l.add(l.abs(to_b), l.abs(to_c)), l.mul(aw, l.splat(STEEP[class])));
        for dy in 0..max - 1 {
            let in_row = l.gt_i(rows, l.splat_i(dy));
            if l.bits(in_row) == 0 {
                break;
            }
            let y = l.to_float(l.add_i(row, l.splat_i(dy)));
            let [ay, by, cy] = each_of!([av, bv, cv], v => l.sub(v, y));
            for dx in 0..max - 1 {
                let active = l.both(in_row, l.gt_i(columns, l.splat_i(dx)));
                if l.bits(active) == 0 {
                    break;
                }
                let x = l.to_float(l.add_i(column, l.splat_i(dx)));
                let [ax, bx, cx] = each_of!([au, bu, cu], u => l.sub(u, x));
                // Edge functions (Pineda 1988) relative to the pixel centre. Their sum is twice the triangle's area.
                let [mut ea, mut eb, mut ec] = each_of!(
                    [(bx, by, cx, cy), (cx, cy, ax, ay), (ax, ay, bx, by)],
                    (px, py, qx, qy) => l.sub(l.mul(px, qy), l.mul(py, qx))
                );
                let mut area = l.add(l.add(ea, eb), ec);
                // Back faces count too: a negative area flips all signs.
                if two_sided {
                    let faces_away = l.lt(area, zero);
                    [ea, eb, ec, area] = each_of!([ea, eb, ec, area], e => l.select(faces_away, l.sub(zero, e), e));
                }
                let inside = l.both(l.both(l.ge(ea, zero), l.ge(eb, zero)), l.both(l.ge(ec, zero), l.lt(zero, area)));
                let hits = l.bits(l.both(active, inside));
                if hits == 0 {
                    continue;
                }
                // Thin triangles, too steep for single precision, are computed below in double.
                let thin = l.bits(l.lt(l.mul(area, flattest), varies)) & hits;
                // Barycentric interpolation of the inverse depth.
                let slope = l.add(l.mul(eb, to_b), l.mul(ec, to_c));
                let w = l.add(aw, l.div(slope, area));
                let mut lanes = [0.0; 16];
                l.store(w, &mut lanes);
                // Depth test, pixel by pixel.
                let mut left = hits & !thin;
                while left != 0 {
                    let lane = left.trailing_zeros() as usize;
                    let [column, row] = unpack(lists[3][start + lane]);
                    target.draw(column + dx, row + dy, lanes[lane]);
                    left &= left - 1;
                }
                let mut left = thin;
                while left != 0 {
                    let lane = start + left.trailing_zeros() as usize;
                    let corners = [0, 1, 2].map(|corner| projected.point(lists[corner][lane]));
                    let [column, row] = unpack(lists[3][lane]);
                    target.draw(column + dx, row + dy, thin_depth(&corners, column + dx, row + dy));
                    left &= left - 1;
                }
            }
        }
    }
}

/// Inverse depth at a pixel centre in or next to a thin triangle, in double precision; at a centre that is outside by
/// rounding, that of the nearest point of the edge it is outside of.
#[inline(never)]
fn thin_depth(corners: &[Fragment; 3], column: i32, row: i32) -> f32 {
    // Corners relative to the pixel centre, which becomes the origin.
    let points = corners.map(|corner| {
        [f64::from(corner.u) - f64::from(column), f64::from(corner.v) - f64::from(row), f64::from(corner.w)]
    });
    // Edge functions: twice the areas opposite the corners.
    let edges: [f64; 3] = std::array::from_fn(|corner| {
        let (p, q) = (points[(corner + 1) % 3], points[(corner + 2) % 3]);
        p[0] * q[1] - p[1] * q[0]
    });
    let area = edges[0] + edges[1] + edges[2];
    // Inside, in either winding: barycentric interpolation of the inverse depth.
    if area != 0.0 && edges.iter().all(|edge| edge * area >= 0.0) {
        let slope = edges[1] * (points[1][2] - points[0][2]) + edges[2] * (points[2][2] - points[0][2]);
        return (points[0][2] + slope / area) as f32;
    }
    // Outside or without area: the nearest point of the three edges.
    let mut best = (f64::INFINITY, points[0][2]);
    for corner in 0..3 {
        let (p, q) = (points[corner], points[(corner + 1) % 3]);
        let d = [q[0] - p[0], q[1] - p[1]];
        let length = d[0] * d[0] + d[1] * d[1];
        // Projection of the origin onto the edge, clamped to its ends.
        let t = if length > 0.0 { (-(p[0] * d[0] + p[1] * d[1]) / length).clamp(0.0, 1.0) } else { 0.0 };
        let (x, y) = (p[0] + t * d[0], p[1] + t * d[1]);
        let distance = x * x + y * y;
        if distance < best.0 {
            best = (distance, p[2] + t * (q[2] - p[2]));
        }
    }
    best.1 as f32
}

simd_kernel! {
    /// Draws the other triangles row by row, sixteen columns at a time.
    pub(super) fn fill_large(survivors: &Survivors, projected: &Projected, two_sided: bool, target: &mut Target)
        = fill_large_body;
}

#[inline(always)]
fn fill_large_body<L: Lanes>(l: L, survivors: &Survivors, projected: &Projected, two_sided: bool, target: &mut Target) {
    let zero = l.splat(0.0);
    let lane_numbers = l.load_i(&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    let steps = l.to_float(lane_numbers);
    let Survivor { lists, count } = &survivors.0[LARGE];
    let [a, b, c, first, size] = lists.each_ref().map(|list| &list[..*count]);
    for ((((a, b), c), first), size) in a.iter().zip(b).zip(c).zip(first).zip(size) {
        let corners = [a, b, c].map(|vertex| projected.point(*vertex));
        // Plane of inverse depth over the image, then the pixel box and the step per column.
        let Some((plane, sign)) = Plane::of(&corners, two_sided) else { continue };
        let [left, top] = unpack(*first);
        let [columns, rows] = unpack(*size);
        let [au, bu, cu] = each_of!([0, 1, 2], corner => l.splat(corners[corner].u));
        let sign = l.splat(sign);
        let (slope, low, high) = (l.splat(plane.step[0] as f32), l.splat(plane.low as f32), l.splat(plane.high as f32));
        for row in top..top + rows {
            let [ay, by, cy] = each_of!([0, 1, 2], corner => l.splat(corners[corner].v - row as f32));
            for first in (left..left + columns).step_by(16) {
                let x = l.add(l.splat(first as f32), steps);
                let [ax, bx, cx] = each_of!([au, bu, cu], u => l.sub(u, x));
                // Edge functions of sixteen columns, positive inside in either winding.
                let [ea, eb, ec] = each_of!(
                    [(bx, by, cx, cy), (cx, cy, ax, ay), (ax, ay, bx, by)],
                    (px, py, qx, qy) => l.mul(sign, l.sub(l.mul(px, qy), l.mul(py, qx)))
                );
                let inside = l.both(l.both(l.ge(ea, zero), l.ge(eb, zero)), l.ge(ec, zero));
                // Columns past the box's end do not count.
                let room = left + columns - first;
                let inside = l.both(inside, l.gt_i(l.splat_i(room), lane_numbers));
                if l.bits(inside) == 0 {
                    continue;
                }
                // Steep planes: depth per pixel in double precision.
                if plane.steep {
                    let mut hits = l.bits(inside);
                    while hits != 0 {
                        let column = first + hits.trailing_zeros() as i32;
                        target.draw(column, row, thin_depth(&corners, column, row));
                        hits &= hits - 1;
                    }
                    continue;
                }
                // From the row's first pixel in single precision: the step is small compared with the depth itself.
                let w = l.add(l.splat(plane.at(first, row)), l.mul(steps, slope));
                let w = l.max(l.min(w, high), low);
                // Depth test: the larger inverse depth is nearer.
                let index = (row - target.top) as usize * target.width + (first - target.left) as usize;
                let pixels: &mut [f32; 16] = (&mut target.depth[index..index + 16]).try_into().expect("sixteen");
                let old = l.load(pixels);
                l.store(l.select(inside, l.max(w, old), old), pixels);
            }
        }
    }
}

/// Inverse depth over the image: linear, in double precision.
struct Plane {
    base: f64,
    step: [f64; 2],
    low: f64,
    high: f64,
    /// So steep that a pixel outside by rounding, or a step in single precision, could be off.
    steep: bool,
}

impl Plane {
    /// The plane through three corners and the sign of their area; `None` when the triangle shows no front.
    #[inline(always)]
    fn of(corners: &[Fragment; 3], two_sided: bool) -> Option<(Self, f32)> {
        let [a, b, c] = corners.map(|corner| [corner.u, corner.v, corner.w].map(f64::from));
        let (p, q) = ([b[0] - a[0], b[1] - a[1], b[2] - a[2]], [c[0] - a[0], c[1] - a[1], c[2] - a[2]]);
        let area = p[0] * q[1] - p[1] * q[0];
        if area == 0.0 || (area < 0.0 && !two_sided) {
            return None;
        }
        let step = [(p[2] * q[1] - q[2] * p[1]) / area, (q[2] * p[0] - p[2] * q[0]) / area];
        let size = p[0].abs().max(p[1].abs()).max(q[0].abs()).max(q[1].abs());
        let plane = Self {
            base: a[2] - step[0] * a[0] - step[1] * a[1],
            step,
            low: a[2].min(b[2]).min(c[2]),
            high: a[2].max(b[2]).max(c[2]),
            // A pixel may be outside by 1e-7 of the size: with this bound that moves depth by less than 1e-7 of itself.
            steep: (step[0].abs() + step[1].abs()) * size > 0.5 * a[2].min(b[2]).min(c[2]),
        };
        Some((plane, if area < 0.0 { -1.0 } else { 1.0 }))
    }

    #[inline(always)]
    fn at(&self, column: i32, row: i32) -> f32 {
        (self.base + (self.step[0] * f64::from(column) + self.step[1] * f64::from(row))) as f32
    }
}

simd_kernel! {
    /// The largest inverse depth of each column, and the first and last row that hold anything.
    pub(super) fn column_maxima(target: &Target, maxima: &mut [f32], top: &mut usize, bottom: &mut usize)
        = column_maxima_body;
}

#[inline(always)]
fn column_maxima_body<L: Lanes>(_: L, target: &Target, maxima: &mut [f32], top: &mut usize, bottom: &mut usize) {
    for (row, line) in target.rows().enumerate() {
        let mut any = 0;
        for (max, w) in maxima.iter_mut().zip(line) {
            *max = if *w > *max { *w } else { *max };
            any |= w.to_bits();
        }
        if any != 0 {
            *top = (*top).min(row);
            *bottom = row;
        }
    }
}

simd_kernel! {
    /// Inverse depth to depth [m] over a box of the buffer; 0 becomes NaN.
    pub(super) fn metres(target: &Target, left: usize, top: usize, width: usize, out: &mut [f32]) = metres_body;
}

#[inline(always)]
fn metres_body<L: Lanes>(_: L, target: &Target, left: usize, top: usize, width: usize, out: &mut [f32]) {
    for (out, line) in out.chunks_exact_mut(width).zip(target.rows().skip(top)) {
        for (out, w) in out.iter_mut().zip(&line[left..left + width]) {
            *out = if *w > 0.0 { 1.0 / *w } else { f32::NAN };
        }
    }
}
