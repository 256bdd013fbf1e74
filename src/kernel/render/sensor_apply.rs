//! The sensor model at work on one depth crop.

use super::{
    SensorModel,
    sensor_field::{Noise, WindowSums},
    sensor_kernels::{self as kernels, BLOCK, BlockRange, Call, RayRow, SlantRow, same_surface},
};
use crate::{
    geom::{DepthCrop, Intrinsics, SimdLevel},
    seed::Stream,
};

/// Memory of [`SensorModel::apply_with`]; keep one per thread.
///
/// Images of the grown crop; depth and disparities have a border of one pixel without return, so that every pixel has
/// four neighbours.
pub struct SensorScratch {
    level: SimdLevel,
    /// Pixels with a return under the matching window.
    returns: WindowSums,
    /// Pixels with a neighbour on another surface or beyond a step of more than half a jump.
    uneven: WindowSums,
    /// Depth [m]; 0 = no return.
    depth: Vec<f32>,
    /// Disparity in pixels of the image, 0 = no return; in the end without shadows and thin parts, as the matcher finds it.
    matched: Vec<f32>,
    /// A row of it before the shadows.
    unshaded: Vec<f32>,
    slants: Slants,
    rays: Rays,
    ranges: BlockRange,
    axial: Noise,
    lateral: [Noise; 2],
    grazing: Noise,
    /// Spread of the disparity of each pixel of a row, in the device's pixels.
    spread: Vec<f32>,
    /// Source of each pixel, if requested.
    sources: Option<Vec<u32>>,
}

impl SensorScratch {
    /// Source of a pixel whose disparity lies between those of two surfaces, and so is of neither.
    pub const BETWEEN: u32 = u32::MAX;

    /// Memory for a model at this level of vector instructions, or at the best one that the machine has.
    pub fn new(level: SimdLevel) -> Self {
        let level = level.usable();
        Self {
            level,
            returns: WindowSums::new(level),
            uneven: WindowSums::new(level),
            depth: Vec::new(),
            matched: Vec::new(),
            unshaded: Vec::new(),
            slants: Slants::default(),
            rays: Rays::default(),
            ranges: BlockRange::default(),
            axial: Noise::new(level),
            lateral: [Noise::new(level), Noise::new(level)],
            grazing: Noise::new(level),
            spread: Vec::new(),
            sources: None,
        }
    }

    /// Memory that remembers from which pixel of the perfect image each pixel has its disparity.
    pub fn with_sources(level: SimdLevel) -> Self {
        Self { sources: Some(Vec::new()), ..Self::new(level) }
    }

    /// For each pixel of the last crop, the pixel of it whose surface it measured, or [`Self::BETWEEN`]; empty unless
    /// the memory is [`Self::with_sources`]. Undefined for pixels without return.
    pub fn sources(&self) -> &[u32] {
        self.sources.as_deref().unwrap_or_default()
    }
}

/// Effect of the surface at each pixel on its measurement, of the last few rows.
#[derive(Default)]
struct Slants {
    width: usize,
    /// Rows that are held, each at its number modulo this.
    rows: usize,
    /// Angle between the line of sight and the surface's normal [rad].
    angle: Vec<f32>,
    /// Standard deviation of the disparity before quantisation, in the device's pixels.
    spread: Vec<f32>,
    /// Not 0 next to a jump.
    at_jump: Vec<f32>,
}

impl Slants {
    /// Memory for `rows` rows of a call.
    fn start(&mut self, call: &Call, rows: usize) {
        (self.width, self.rows) = (call.width, rows);
        for image in [&mut self.angle, &mut self.spread, &mut self.at_jump] {
            image.resize(call.width * rows, 0.0);
        }
    }

    /// Where row `y` lies.
    fn row(&self, y: usize) -> std::ops::Range<usize> {
        let first = (y % self.rows) * self.width;
        first..first + self.width
    }

    /// Fills row `y` from the depths and matched disparities, and marks its uneven pixels.
    fn measure_row(
        &mut self,
        level: SimdLevel,
        call: &Call,
        rays: &Rays,
        [depth, matched]: [&[f32]; 2],
        y: usize,
        is_uneven: &mut [i32],
    ) {
        let rays = RayRow { u: &rays.u, ray_x: &rays.ray_x, v: y as f32 + 0.5 - rays.centre_row };
        let row = self.row(y);
        let [angle, spread, at_jump] = [&mut self.angle, &mut self.spread, &mut self.at_jump];
        let out = SlantRow {
            angle: &mut angle[row.clone()],
            spread: &mut spread[row.clone()],
            at_jump: &mut at_jump[row],
            is_uneven,
        };
        kernels::measure_slants(level, call, &rays, call.cross(depth, y), call.cross(matched, y), out);
    }
}

/// Columns of the crop from the principal point [px], and the same over the focal length.
#[derive(Default)]
struct Rays {
    u: Vec<f32>,
    ray_x: Vec<f32>,
    /// Row of the principal point in the crop [px].
    centre_row: f32,
}

impl SensorModel {
    /// Converts a perfect depth crop to the sensor's output, with memory allocated for the call.
    pub fn apply(&self, camera: &Intrinsics, crop: &mut DepthCrop, stream: &mut Stream) {
        self.apply_with(&mut SensorScratch::new(SimdLevel::detect()), camera, crop, stream);
    }

    /// Converts a perfect depth crop to the sensor's output. Class `exact`: a function of its arguments alone.
    ///
    /// The crop grows by three times `lateral_sigma_px` on each side, inside the image, because edges move in both directions.
    /// Where nothing is behind the object there is nothing to match: its shadow and mixed pixels fall on its own
    /// farther parts only, and its outline just moves (see `docs/sensors.md`).
    pub fn apply_with(
        &self,
        scratch: &mut SensorScratch,
        camera: &Intrinsics,
        crop: &mut DepthCrop,
        stream: &mut Stream,
    ) {
        if crop.depth.is_empty() {
            return;
        }
        grow(scratch, camera, crop, self.lateral_reach() as u32);
        let call = self.prepare(scratch, camera, crop);
        self.drop_shadows(&call, scratch);
        self.drop_thin(&call, scratch);
        let SensorScratch { axial, lateral: [across, down], grazing, .. } = scratch;
        for noise in [axial, across, down, grazing] {
            noise.start(call.width, call.height, self.window_px as usize, stream);
        }
        self.measure(&call, scratch, &mut crop.depth, stream);
    }

    /// The farthest that lateral noise goes [px].
    fn lateral_reach(&self) -> usize {
        libm::ceil(3.0 * self.lateral_sigma_px) as usize
    }

    /// Fills the disparities of the grown crop and the positions of its pixels.
    fn prepare(&self, scratch: &mut SensorScratch, camera: &Intrinsics, crop: &DepthCrop) -> Call {
        let image = (camera.fx * self.baseline_m.abs()) as f32;
        scratch.matched.resize(scratch.depth.len(), 0.0);
        kernels::disparities(scratch.level, image, &scratch.depth, &mut scratch.matched);
        let device = (self.focal_px * self.baseline_m.abs()) as f32;
        let call = Call {
            width: crop.width as usize,
            height: crop.height as usize,
            stride: crop.width as usize + 2,
            focal: [camera.fx as f32, camera.fy as f32],
            device,
            device_per_image: (self.focal_px / camera.fx) as f32,
            jump: self.jump_px as f32,
            disparity_sigma: self.disparity_sigma_px as f32,
            angle_sigma: self.angle_sigma_m as f32 * device,
            grazing_angle: (self.grazing_angle_deg as f32).to_radians(),
            grazing_spread: (self.grazing_spread_deg as f32).to_radians(),
            step: self.disparity_step_px as f32,
            depth_step: self.depth_step_m as f32,
            range: [self.min_range_m as f32, self.max_range_m as f32],
        };
        let centre = [(camera.cx - f64::from(crop.left)) as f32, (camera.cy - f64::from(crop.top)) as f32];
        let Rays { u, ray_x, centre_row } = &mut scratch.rays;
        u.clear();
        u.extend((0..call.width).map(|x| x as f32 + 0.5 - centre[0]));
        ray_x.clear();
        ray_x.extend(u.iter().map(|u| u / call.focal[0]));
        *centre_row = centre[1];
        call
    }

    /// Removes the pixels that the projector or second camera does not see: a nearer part of the image lies on the
    /// same line from there. Between two depths the shadow is as wide as their disparities differ.
    fn drop_shadows(&self, call: &Call, scratch: &mut SensorScratch) {
        if self.shadow == 0.0 || self.baseline_m == 0.0 {
            return;
        }
        let SensorScratch { level, matched, unshaded, ranges, .. } = scratch;
        for matched in matched.chunks_exact_mut(call.stride) {
            unshaded.clear();
            unshaded.extend_from_slice(matched);
            // Seen from the left, a row is walked from its other end.
            let is_left = self.baseline_m < 0.0;
            if is_left {
                unshaded.reverse();
            }
            kernels::block_ranges(*level, unshaded, ranges);
            let last = call.stride - 1;
            shade_row(unshaded, ranges, call.jump, |x| matched[if is_left { last - x } else { x }] = 0.0);
        }
    }

    /// Removes the pixels whose matching window sees too little.
    fn drop_thin(&self, call: &Call, scratch: &mut SensorScratch) {
        let SensorScratch { level, returns, matched, .. } = scratch;
        let window = self.window_px as usize;
        // The least whole count that is not below the share.
        let min = libm::ceil(self.min_support * (window * window) as f64) as i32;
        if min <= 1 {
            return;
        }
        returns.start(call.width, window);
        for y in 0..call.height {
            // Rows are marked before the window's middle reaches them.
            let counts = returns.row(y, |row, marks| match call.row_under(row, window) {
                Some(y) => {
                    kernels::mark_returns(*level, &matched[call.row(y)], &mut marks[window / 2..][..call.width]);
                }
                None => marks.fill(0),
            });
            kernels::drop_below(*level, min, counts, &mut matched[call.row(y)]);
        }
    }

    /// Writes the returned depths [m] to `out`, NaN = no return.
    fn measure(&self, call: &Call, scratch: &mut SensorScratch, out: &mut [f32], stream: &mut Stream) {
        let SensorScratch {
            level, uneven, depth, matched, slants, rays, axial, lateral, grazing, spread, sources, ..
        } = scratch;
        if let Some(sources) = sources {
            sources.clear();
            sources.extend(0..out.len() as u32);
        }
        let (sigma, reach) = (self.lateral_sigma_px as f32, self.lateral_reach());
        let window = 2 * reach + 1;
        slants.start(call, window);
        uneven.start(call.width, window);
        for y in 0..call.height {
            // The sums are counts of uneven pixels within reach. Where the count is zero, any two pixels differ by less
            // than a jump per step between them, and so are one surface: each measures itself, wherever its lateral
            // noise points.
            let uneven = uneven.row(y, |row, marks| match call.row_under(row, window) {
                Some(y) => {
                    let (seen, marks) = ([&depth[..], &matched[..]], &mut marks[reach..][..call.width]);
                    slants.measure_row(*level, call, rays, seen, y, marks);
                }
                None => marks.fill(0),
            });
            let (row, own) = (y * call.width..(y + 1) * call.width, slants.row(y));
            let (out, matched_row, angle) = (&mut out[row.clone()], &matched[call.row(y)], &slants.angle[own.clone()]);
            let grazing = grazing.row(y);
            kernels::find_own(*level, call, matched_row, angle, grazing, out);
            spread.clear();
            spread.extend_from_slice(&slants.spread[own]);
            // Most rows of most images have no outline near, and draw no lateral noise.
            let has_edge = uneven.iter().any(|uneven| *uneven > 0);
            let [across, down] = lateral.each_mut().map(|noise| if has_edge { noise.row(y) } else { &[] });
            for (x, _) in uneven.iter().enumerate().filter(|(_, uneven)| **uneven > 0) {
                let shift = [across[x], down[x]].map(|noise| lateral_shift(noise, sigma, reach));
                let source = source_of(call, matched, [x, y], shift);
                let (at, slant) = (call.at(source[0], source[1]), slants.row(source[1]).start + source[0]);
                let mut seen = kernels::seen_at(call, matched[at], slants.angle[slant], grazing[x]);
                // Pixels next to a jump mix or lose their match.
                let of_surface = seen;
                if seen > 0.0 && slants.at_jump[slant] > 0.0 {
                    seen = self.beside_jump(call, matched, at, stream);
                }
                if let Some(sources) = sources {
                    let is_between = seen > 0.0 && seen != of_surface;
                    let source = (source[1] * call.width + source[0]) as u32;
                    sources[row.start + x] = if is_between { SensorScratch::BETWEEN } else { source };
                }
                out[x] = seen * call.device_per_image;
                spread[x] = slants.spread[slant];
            }
            kernels::measure(*level, call, axial.row(y), spread, out);
        }
    }

    /// Disparity in pixels of the image, with the effect of a jump next to pixel `at`; 0 when it is lost.
    fn beside_jump(&self, call: &Call, matched: &[f32], at: usize, stream: &mut Stream) -> f32 {
        let own = matched[at];
        let mut other = own;
        for neighbour in [at - 1, at + 1, at - call.stride, at + call.stride] {
            let disparity = matched[neighbour];
            if disparity > 0.0 && (disparity - own).abs() > (other - own).abs() {
                other = disparity;
            }
        }
        let draw = stream.unit();
        if draw < self.edge_dropout {
            0.0
        } else if draw < self.edge_dropout + self.edge_mixed {
            own + (other - own) * stream.unit() as f32
        } else {
            own
        }
    }
}

/// Lateral noise in whole pixels, at most `reach`. Rounds to nearest without a call: casts cut towards zero, and the sum is
/// positive.
fn lateral_shift(noise: f32, sigma: f32, reach: usize) -> isize {
    let limit = reach as f32;
    ((noise * sigma).clamp(-limit, limit) + (limit + 0.5)) as isize - reach as isize
}

/// The pixel whose surface a pixel measures: a shifted neighbour if that is on another surface, else itself. A shift
/// along one surface adds no error, since the axial noise already contains it: lateral noise only moves edges.
fn source_of(call: &Call, matched: &[f32], [x, y]: [usize; 2], [dx, dy]: [isize; 2]) -> [usize; 2] {
    let (from_x, from_y) = (x.wrapping_add_signed(dx), y.wrapping_add_signed(dy));
    if from_x < call.width && from_y < call.height {
        let jump = call.jump * (dx.abs() + dy.abs()) as f32;
        if !same_surface(matched[call.at(x, y)], matched[call.at(from_x, from_y)], jump) {
            return [from_x, from_y];
        }
    }
    [x, y]
}

/// Walks a row whose second viewpoint lies towards growing x and calls `lose` for every pixel hidden from there.
fn shade_row(row: &[f32], ranges: &BlockRange, jump: f32, mut lose: impl FnMut(usize)) {
    let last = row.len() - 1;
    let nearest = ranges.max.iter().fold(0.0f32, |nearest, d| nearest.max(*d));
    // Farthest distance to the right of pixel x, of disparity `own`, at which an occluder can be.
    let end = |x: usize, own: f32| last.min(x + (nearest - own + 1.0) as usize);
    for (block, &farthest) in ranges.min.iter().enumerate() {
        let pixels = block * BLOCK..((block + 1) * BLOCK).min(row.len());
        // No return, or nothing in reach sufficiently nearer: no shadow on these pixels.
        let is_nearer = |block: &f32| *block - farthest > jump;
        if nearest - farthest <= jump || !ranges.max[block..=end(pixels.end, farthest) / BLOCK].iter().any(is_nearer) {
            continue;
        }
        for x in pixels {
            let own = row[x];
            if own == 0.0 || nearest - own <= jump {
                continue;
            }
            let end = end(x, own);
            let hidden = ((x + 1) / BLOCK..=end / BLOCK).any(|block| {
                let (first, past) = ((block * BLOCK).max(x + 1), ((block + 1) * BLOCK).min(end + 1));
                ranges.max[block] - own > jump && (first..past).any(|j| is_hidden_by(row, jump, x, j))
            });
            if hidden {
                lose(x);
            }
        }
    }
}

/// Whether the second viewpoint, towards growing x, sees pixel `j` and not pixel `x` of a row of disparities.
#[inline(always)]
fn is_hidden_by(row: &[f32], jump: f32, x: usize, j: usize) -> bool {
    let (own, other) = (row[x], row[j]);
    if other - own <= jump {
        return false;
    }
    // Columns in the second view: the occluder hides the pixel when both fall on the same one.
    let (column, first) = (x as f32 - own, j as f32 - other);
    if (first - column).abs() <= 0.5 {
        return true;
    }
    // Between two pixels of one surface the line of sight is closed too.
    let next = row.get(j + 1).copied().unwrap_or(0.0);
    let second = (j + 1) as f32 - next;
    next > 0.0 && (next - other).abs() <= jump && first.min(second) <= column && column <= first.max(second)
}

/// Widens the crop by `margin` pixels on each side, inside the image, and copies its depth to the scratch with 0 for
/// no return.
fn grow(scratch: &mut SensorScratch, camera: &Intrinsics, crop: &mut DepthCrop, margin: u32) {
    let (left, top) = (crop.left.saturating_sub(margin), crop.top.saturating_sub(margin));
    let right = (crop.left + crop.width + margin).min(camera.width).max(crop.left + crop.width);
    let bottom = (crop.top + crop.height + margin).min(camera.height).max(crop.top + crop.height);
    let (width, height) = ((right - left) as usize, (bottom - top) as usize);
    // With the border of one pixel.
    let stride = width + 2;
    scratch.depth.resize(stride * (height + 2), 0.0);
    let (crop_width, above, before) =
        (crop.width as usize, (crop.top - top) as usize + 1, (crop.left - left) as usize + 1);
    for (y, row) in scratch.depth.chunks_exact_mut(stride).enumerate() {
        let inside = (above..above + crop.height as usize).contains(&y);
        let own = if inside { before..before + crop_width } else { 0..0 };
        row[..own.start].fill(0.0);
        row[own.end..].fill(0.0);
        if inside {
            kernels::copy_returns(scratch.level, &crop.depth[(y - above) * crop_width..][..crop_width], &mut row[own]);
        }
    }
    *crop = DepthCrop { left, top, width: right - left, height: bottom - top, depth: std::mem::take(&mut crop.depth) };
    // Every pixel is written later.
    crop.depth.resize(width * height, f32::NAN);
}
