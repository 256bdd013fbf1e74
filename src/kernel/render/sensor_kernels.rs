//! Inner loops of the sensor model, over a row of pixels at a time. No branch and equal slices, so that the compiler takes
//! as many pixels at a time as the level's registers hold; each pixel's own operations, and so its bits, stay the same.

use super::sensor::MAX_ANGLE;
use crate::geom::simd_kernel;

/// Numbers of one call of the model, in f32 for the loops.
pub(super) struct Call {
    /// Size of the grown crop [px].
    pub(super) width: usize,
    pub(super) height: usize,
    /// Row length of the images with a border.
    pub(super) stride: usize,
    /// Focal lengths of the job's camera [px].
    pub(super) focal: [f32; 2],
    /// Disparity of the device [px] times depth [m].
    pub(super) device: f32,
    /// Device's pixels per pixel of the image.
    pub(super) device_per_image: f32,
    /// Step of disparity [px of the image] from which on neighbouring pixels are two surfaces.
    pub(super) jump: f32,
    /// Spread of the disparity of a surface seen head-on, and its growth with the angle, in the device's pixels.
    pub(super) disparity_sigma: f32,
    pub(super) angle_sigma: f32,
    /// Angle at which half of the pixels are lost, and its standard deviation [rad].
    pub(super) grazing_angle: f32,
    pub(super) grazing_spread: f32,
    /// Quantisation step of the disparity, in the device's pixels; 0 = none.
    pub(super) step: f32,
    /// Rounding of the returned depth [m]; 0 = none.
    pub(super) depth_step: f32,
    /// Depths that are returned [m].
    pub(super) range: [f32; 2],
}

impl Call {
    /// Index of a pixel in the images with a border.
    pub(super) fn at(&self, x: usize, y: usize) -> usize {
        (y + 1) * self.stride + x + 1
    }

    /// Indices of a row in the images with a border.
    pub(super) fn row(&self, y: usize) -> std::ops::Range<usize> {
        let first = self.at(0, y);
        first..first + self.width
    }

    /// Row of the image that row `row` of the grid padded for this window holds; none above and below the image.
    pub(super) fn row_under(&self, row: usize, window: usize) -> Option<usize> {
        row.checked_sub(window / 2).filter(|y| *y < self.height)
    }

    /// A row of an image with a border and its four neighbours: the row itself, then shifted left, right, up and down.
    pub(super) fn cross<'a>(&self, image: &'a [f32], y: usize) -> [&'a [f32]; 5] {
        let first = self.at(0, y);
        let starts = [first, first - 1, first + 1, first - self.stride, first + self.stride];
        starts.map(|start| &image[start..][..self.width])
    }
}

/// Whether two pixels see one surface: both see something and their disparities differ by at most `jump`; or neither does.
#[inline(always)]
pub(super) fn same_surface(a: f32, b: f32, jump: f32) -> bool {
    ((a > 0.0) == (b > 0.0)) & ((a - b).abs() <= jump)
}

/// Effect of the surface at each pixel of a row on its measurement.
pub(super) struct SlantRow<'a> {
    /// Angle between the line of sight and the surface's normal [rad].
    pub(super) angle: &'a mut [f32],
    /// Standard deviation of the disparity before quantisation, in the device's pixels.
    pub(super) spread: &'a mut [f32],
    /// Not 0 next to a jump.
    pub(super) at_jump: &'a mut [f32],
    /// 1 where a neighbour is another surface or a step of more than half a jump, else 0.
    pub(super) is_uneven: &'a mut [i32],
}

/// Position of a row's pixels, from the principal point.
pub(super) struct RayRow<'a> {
    /// Columns [px], and the same over the focal length.
    pub(super) u: &'a [f32],
    pub(super) ray_x: &'a [f32],
    /// Row [px].
    pub(super) v: f32,
}

simd_kernel! {
    /// Fills the slants of a row from the depth [m] and the matched disparities of it and its neighbours ([`Call::cross`]).
    pub(super) fn measure_slants(call: &Call, rays: &RayRow, depth: [&[f32]; 5], matched: [&[f32]; 5], out: SlantRow) = slants_body;
}

#[inline(always)]
fn slants_body<L>(_: L, call: &Call, rays: &RayRow, depth: [&[f32]; 5], matched: [&[f32]; 5], out: SlantRow) {
    let width = call.width;
    let [z, z_left, z_right, z_up, z_down] = depth.map(|row| &row[..width]);
    let [d, d_left, d_right, d_up, d_down] = matched.map(|row| &row[..width]);
    let (u, ray_x, v) = (&rays.u[..width], &rays.ray_x[..width], rays.v);
    let SlantRow { angle, spread, at_jump, is_uneven } = out;
    let (angle, spread) = (&mut angle[..width], &mut spread[..width]);
    let (at_jump, is_uneven) = (&mut at_jump[..width], &mut is_uneven[..width]);
    let (jump, half_jump, [focal_x, focal_y]) = (call.jump, 0.5 * call.jump, call.focal);
    let ray_y = v / focal_y;
    // The published figure holds the quantisation, whose variance is step^2 / 12.
    let quantisation = call.step * call.step / 12.0;
    for x in 0..width {
        // Depth slope from neighbours on the same surface: central where both are, one-sided where one is, else 0.
        let side = |other: f32| if same_surface(d[x], other, jump) { 1.0f32 } else { 0.0 };
        let slope = |before: f32, with_before: f32, after: f32, with_after: f32| {
            let rise = with_before * (z[x] - before) + with_after * (after - z[x]);
            rise * (1.0 - 0.5 * with_before * with_after)
        };
        let along_x = slope(z_left[x], side(d_left[x]), z_right[x], side(d_right[x]));
        let along_y = slope(z_up[x], side(d_up[x]), z_down[x], side(d_down[x]));
        // Incidence angle: point = depth * ray; the cross product of its derivatives along u and v, times the focal lengths.
        let normal = [focal_x * along_x, focal_y * along_y, z[x] + u[x] * along_x + v * along_y];
        let square = |v: [f32; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        let cosine = z[x] / (square(normal) * square([ray_x[x], ray_y, 1.0])).sqrt();
        let incidence = arc_cosine(if cosine < 1.0 { cosine } else { 1.0 });
        // Held below 90 degrees, where the noise model diverges.
        let held = if incidence < MAX_ANGLE as f32 { incidence } else { MAX_ANGLE as f32 };
        // Angle term of Nguyen, Izadi and Lovell 2012, theta^2 / (pi/2 - theta)^2 / sqrt(z), as disparity.
        let steep = held / (std::f32::consts::FRAC_PI_2 - held);
        let sigma = call.disparity_sigma + call.angle_sigma * steep * steep / (z[x] * z[x] * z[x].sqrt());
        let variance = sigma * sigma - quantisation;
        angle[x] = incidence;
        spread[x] = (if variance > 0.0 { variance } else { 0.0 }).sqrt();
        // Count of neighbours across a disparity jump.
        let is_jump = |other: f32| if (other > 0.0) & ((other - d[x]).abs() > jump) { 1.0f32 } else { 0.0 };
        at_jump[x] = is_jump(d_left[x]) + is_jump(d_right[x]) + is_jump(d_up[x]) + is_jump(d_down[x]);
        let is_even = |other: f32| same_surface(d[x], other, half_jump);
        let is_flat = is_even(d_left[x]) & is_even(d_right[x]) & is_even(d_up[x]) & is_even(d_down[x]);
        is_uneven[x] = i32::from(!is_flat);
    }
}

/// Abramowitz and Stegun 4.4.45, good to 7e-5 rad for 0 <= x <= 1; adds and products only, so the same bits everywhere.
#[inline(always)]
fn arc_cosine(x: f32) -> f32 {
    (1.0 - x).sqrt() * (1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - x * 0.018_729_3)))
}

simd_kernel! {
    /// Writes the disparity that the pixels of a row find where each measures its own surface, in the device's pixels, 0 = none.
    pub(super) fn find_own(call: &Call, matched: &[f32], angle: &[f32], grazing: &[f32], out: &mut [f32]) = own_body;
}

#[inline(always)]
fn own_body<L>(_: L, call: &Call, matched: &[f32], angle: &[f32], grazing: &[f32], out: &mut [f32]) {
    for (((out, matched), angle), grazing) in out.iter_mut().zip(matched).zip(angle).zip(grazing) {
        *out = seen_at(call, *matched, *angle, *grazing) * call.device_per_image;
    }
}

/// Disparity of a pixel after the loss at grazing incidence, whose limit is random.
#[inline(always)]
pub(super) fn seen_at(call: &Call, matched: f32, angle: f32, grazing: f32) -> f32 {
    if (matched > 0.0) & (angle > call.grazing_angle + call.grazing_spread * grazing) { 0.0 } else { matched }
}

simd_kernel! {
    /// Converts disparities without noise, in the device's pixels, to returned depths [m], NaN = no return.
    pub(super) fn measure(call: &Call, axial: &[f32], spread: &[f32], out: &mut [f32]) = measure_body;
}

#[inline(always)]
fn measure_body<L>(_: L, call: &Call, axial: &[f32], spread: &[f32], out: &mut [f32]) {
    let [min, max] = call.range;
    for ((value, noise), spread) in out.iter_mut().zip(axial).zip(spread) {
        let found = *value > 0.0;
        let mut disparity = *value + noise * spread;
        if call.step > 0.0 {
            disparity = nearest_multiple(disparity, call.step);
        }
        let mut depth = call.device / disparity;
        if call.depth_step > 0.0 {
            depth = nearest_multiple(depth, call.depth_step);
        }
        // A disparity of 0 or less is infinitely far or behind: out of range as well.
        *value = if found & (depth >= min) & (depth <= max) { depth } else { f32::NAN };
    }
}

/// The multiple of `step` next to `value`, for values from 0 to 2^22 steps: above 2^23 an f32 holds whole numbers only.
#[inline(always)]
fn nearest_multiple(value: f32, step: f32) -> f32 {
    const WHOLE: f32 = 8_388_608.0;
    ((value / step + WHOLE) - WHOLE) * step
}

simd_kernel! {
    /// Copies depths; 0 for no return, which is NaN in the input.
    pub(super) fn copy_returns(depth: &[f32], out: &mut [f32]) = copy_body;
}

#[inline(always)]
fn copy_body<L>(_: L, depth: &[f32], out: &mut [f32]) {
    for (out, depth) in out.iter_mut().zip(depth) {
        *out = if depth.is_nan() { 0.0 } else { *depth };
    }
}

simd_kernel! {
    /// 1 where a disparity is found, else 0.
    pub(super) fn mark_returns(disparity: &[f32], out: &mut [i32]) = mark_body;
}

#[inline(always)]
fn mark_body<L>(_: L, disparity: &[f32], out: &mut [i32]) {
    for (out, disparity) in out.iter_mut().zip(disparity) {
        *out = i32::from(*disparity > 0.0);
    }
}

simd_kernel! {
    /// Removes the disparities whose count is below `min`.
    pub(super) fn drop_below(min: i32, counts: &[i32], disparity: &mut [f32]) = drop_body;
}

#[inline(always)]
fn drop_body<L>(_: L, min: i32, counts: &[i32], disparity: &mut [f32]) {
    for (disparity, count) in disparity.iter_mut().zip(counts) {
        *disparity = if *count < min { 0.0 } else { *disparity };
    }
}

simd_kernel! {
    /// Disparities [px] of depths [m]: `focal` over depth; 0 where the depth is 0.
    pub(super) fn disparities(focal: f32, depth: &[f32], out: &mut [f32]) = disparities_body;
}

#[inline(always)]
fn disparities_body<L>(_: L, focal: f32, depth: &[f32], out: &mut [f32]) {
    for (out, depth) in out.iter_mut().zip(depth) {
        *out = if *depth > 0.0 { focal / *depth } else { 0.0 };
    }
}

/// Pixels whose largest disparity is known together.
pub(super) const BLOCK: usize = 16;

/// Smallest and largest disparity of each [`BLOCK`] pixels of a row.
#[derive(Default)]
pub(super) struct BlockRange {
    /// Infinite where no pixel has a return.
    pub(super) min: Vec<f32>,
    /// 0 where no pixel has a return.
    pub(super) max: Vec<f32>,
}

simd_kernel! {
    /// Fills the ranges of a row of disparities, 0 = no return; the last block may be shorter.
    pub(super) fn block_ranges(row: &[f32], out: &mut BlockRange) = ranges_body;
}

#[inline(always)]
fn ranges_body<L>(_: L, row: &[f32], out: &mut BlockRange) {
    out.min.clear();
    out.max.clear();
    let (blocks, rest) = row.as_chunks::<BLOCK>();
    let mut last = [0.0; BLOCK];
    last[..rest.len()].copy_from_slice(rest);
    for block in blocks.iter().chain((!rest.is_empty()).then_some(&last)) {
        let mut max = *block;
        let mut min = block.map(|value| if value > 0.0 { value } else { f32::INFINITY });
        for half in [8, 4, 2, 1] {
            for lane in 0..half {
                max[lane] = if max[lane + half] > max[lane] { max[lane + half] } else { max[lane] };
                min[lane] = if min[lane + half] < min[lane] { min[lane + half] } else { min[lane] };
            }
        }
        out.min.push(min[0]);
        out.max.push(max[0]);
    }
}

simd_kernel! {
    /// Adds a row to another.
    pub(super) fn add(sums: &mut [i32], values: &[i32]) = add_body;
}

#[inline(always)]
fn add_body<L>(_: L, sums: &mut [i32], values: &[i32]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += value;
    }
}

simd_kernel! {
    /// Subtracts a row from another.
    pub(super) fn subtract(sums: &mut [i32], values: &[i32]) = subtract_body;
}

#[inline(always)]
fn subtract_body<L>(_: L, sums: &mut [i32], values: &[i32]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum -= value;
    }
}

simd_kernel! {
    /// Sums of every `window` values side by side.
    pub(super) fn window_sums(values: &[i32], window: usize, out: &mut [i32]) = window_body;
}

#[inline(always)]
fn window_body<L>(_: L, values: &[i32], window: usize, out: &mut [i32]) {
    let (blocks, rest) = out.as_chunks_mut::<BLOCK>();
    for (number, block) in blocks.iter_mut().enumerate() {
        let mut sums = [0; BLOCK];
        for shifted in values[number * BLOCK..].windows(BLOCK).take(window) {
            for (sum, value) in sums.iter_mut().zip(shifted) {
                *sum += value;
            }
        }
        *block = sums;
    }
    let done = blocks.len() * BLOCK;
    for (x, sum) in rest.iter_mut().enumerate() {
        *sum = values[done + x..][..window].iter().sum();
    }
}

simd_kernel! {
    /// The odd number from -65535 to 65535 that each two random bytes encode.
    pub(super) fn draws(values: &mut [i32], bytes: &[u8]) = draws_body;
}

#[inline(always)]
fn draws_body<L>(_: L, values: &mut [i32], bytes: &[u8]) {
    for (value, pair) in values.iter_mut().zip(bytes.as_chunks::<2>().0) {
        *value = 2 * i32::from(u16::from_le_bytes(*pair)) - 0xffff;
    }
}

simd_kernel! {
    /// Whole numbers times a factor.
    pub(super) fn scale(values: &[i32], factor: f32, out: &mut [f32]) = scale_body;
}

#[inline(always)]
fn scale_body<L>(_: L, values: &[i32], factor: f32, out: &mut [f32]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out = *value as f32 * factor;
    }
}
