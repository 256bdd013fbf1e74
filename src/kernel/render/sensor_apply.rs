//! The sensor model at work on one depth crop.

use super::{SensorModel, sensor::MAX_ANGLE, sensor_field::BoxSum};
use crate::{
    geom::{DepthCrop, Intrinsics},
    seed::Stream,
};

/// Memory of [`SensorModel::apply_with`]; keep one per thread.
///
/// Images of the grown crop; depth and disparities have a border of one pixel without return, so that every pixel has
/// four neighbours.
#[derive(Default)]
pub struct SensorScratch {
    boxes: BoxSum,
    /// Depth [m]; 0 = no return.
    depth: Vec<f32>,
    /// Disparity in pixels of the image; 0 = no return.
    disparity: Vec<f32>,
    /// Disparity that the matcher can find: `disparity` without shadows and thin parts.
    matched: Vec<f32>,
    slants: Slants,
    axial: Vec<f32>,
    lateral: [Vec<f32>; 2],
    grazing: Vec<f32>,
    /// Spread of the disparity of each returned pixel, in the device's pixels.
    spread: Vec<f32>,
    /// Source of each pixel, where somebody asked for it.
    sources: Option<Vec<u32>>,
}

impl SensorScratch {
    /// Source of a pixel whose disparity lies between those of two surfaces, and so is of neither.
    pub const BETWEEN: u32 = u32::MAX;

    /// Memory that remembers from which pixel of the perfect image each pixel has its disparity.
    pub fn with_sources() -> Self {
        Self { sources: Some(Vec::new()), ..Self::default() }
    }

    /// For each pixel of the last crop the pixel of it whose surface it measured, or [`Self::BETWEEN`]; empty unless the memory
    /// is [`Self::with_sources`]. Says nothing of pixels without return.
    pub fn sources(&self) -> &[u32] {
        self.sources.as_deref().unwrap_or_default()
    }
}

/// Effect of the surface at each pixel on its measurement; images without a border.
#[derive(Default)]
struct Slants {
    /// Angle between the line of sight and the surface's normal [rad].
    angle: Vec<f32>,
    /// Standard deviation of the disparity before quantisation, in the device's pixels.
    spread: Vec<f32>,
    /// Not 0 beside a jump.
    at_jump: Vec<f32>,
}

/// Numbers of one call, in f32 as the kernel wants them.
struct Call {
    width: usize,
    height: usize,
    /// Row length of the images with a border.
    stride: usize,
    /// Principal point in the grown crop [px].
    centre: [f32; 2],
    /// Focal lengths of the job's camera [px].
    focal: [f32; 2],
    /// Disparity of the device [px] times depth [m].
    device: f32,
    /// Device's pixels per pixel of the image.
    device_per_image: f32,
    jump: f32,
}

impl SensorModel {
    /// Converts a perfect depth crop to what the sensor returns, with memory of its own for the call.
    pub fn apply(&self, camera: &Intrinsics, crop: &mut DepthCrop, stream: &mut Stream) {
        self.apply_with(&mut SensorScratch::default(), camera, crop, stream);
    }

    /// Converts a perfect depth crop to what the sensor returns. Class `exact`: a function of its arguments alone.
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
        grow(scratch, camera, crop, libm::ceil(3.0 * self.lateral_sigma_px) as u32);
        let call = self.prepare(scratch, camera, crop);
        self.drop_shadows(&call, &scratch.disparity, &mut scratch.matched);
        self.drop_thin(&call, &mut scratch.boxes, &mut scratch.matched);
        self.measure_slants(&call, &scratch.depth, &scratch.matched, &mut scratch.slants);
        let (width, height, window) = (call.width, call.height, self.window_px as usize);
        let SensorScratch { boxes, axial, lateral: [across, down], grazing, .. } = scratch;
        for field in [axial, across, down, grazing] {
            boxes.noise(field, width, height, window, stream);
        }
        self.choose_sources(&call, scratch, &mut crop.depth, stream);
        self.measure(&call, &scratch.axial, &scratch.spread, &mut crop.depth);
    }

    /// Fills the disparity image of the grown crop.
    fn prepare(&self, scratch: &mut SensorScratch, camera: &Intrinsics, crop: &DepthCrop) -> Call {
        let image = (camera.fx * self.baseline_m.abs()) as f32;
        scratch.disparity.clear();
        scratch.disparity.extend(scratch.depth.iter().map(|depth| if *depth > 0.0 { image / depth } else { 0.0 }));
        scratch.matched.clone_from(&scratch.disparity);
        Call {
            width: crop.width as usize,
            height: crop.height as usize,
            stride: crop.width as usize + 2,
            centre: [(camera.cx - f64::from(crop.left)) as f32, (camera.cy - f64::from(crop.top)) as f32],
            focal: [camera.fx as f32, camera.fy as f32],
            device: (self.focal_px * self.baseline_m.abs()) as f32,
            device_per_image: (self.focal_px / camera.fx) as f32,
            jump: self.jump_px as f32,
        }
    }

    /// Removes the pixels that the projector or second camera does not see: a nearer part of the image lies on the
    /// same line from there. Between two depths the shadow is as wide as their disparities differ.
    fn drop_shadows(&self, call: &Call, disparity: &[f32], matched: &mut [f32]) {
        if self.shadow == 0.0 || self.baseline_m == 0.0 {
            return;
        }
        let last = call.stride - 1;
        for (row, matched) in disparity.chunks_exact(call.stride).zip(matched.chunks_exact_mut(call.stride)) {
            let nearest = row.iter().fold(0.0f32, |nearest, d| nearest.max(*d));
            if self.baseline_m > 0.0 {
                shade_row(|x| row[x], last, nearest, call.jump, |x| matched[x] = 0.0);
            } else {
                shade_row(|x| row[last - x], last, nearest, call.jump, |x| matched[last - x] = 0.0);
            }
        }
    }

    /// Removes the pixels whose matching window sees too little.
    fn drop_thin(&self, call: &Call, boxes: &mut BoxSum, matched: &mut [f32]) {
        let window = self.window_px as usize;
        let min = self.min_support * (window * window) as f64;
        if min <= 1.0 {
            return;
        }
        let (padded, stride) = boxes.padded(call.width, call.height, window);
        for y in 0..call.height {
            let line = &mut padded[(y + window / 2) * stride + window / 2..][..call.width];
            for (seen, disparity) in line.iter_mut().zip(&matched[call.row(y)]) {
                *seen = i32::from(*disparity > 0.0);
            }
        }
        boxes.sums(call.width, call.height, window, |y, sums| {
            for (disparity, sum) in matched[call.row(y)].iter_mut().zip(sums) {
                if f64::from(*sum) < min {
                    *disparity = 0.0;
                }
            }
        });
    }

    /// Fills the slants of all pixels. No branch and equal slices, so that the compiler takes several pixels at a time.
    fn measure_slants(&self, call: &Call, depth: &[f32], matched: &[f32], slants: &mut Slants) {
        let width = call.width;
        for image in [&mut slants.angle, &mut slants.spread, &mut slants.at_jump] {
            image.clear();
            image.resize(width * call.height, 0.0);
        }
        let (disparity_sigma, step) = (self.disparity_sigma_px as f32, self.disparity_step_px as f32);
        let angle_sigma = self.angle_sigma_m as f32 * call.device;
        // The published figure holds the quantisation, whose variance is step^2 / 12.
        let quantisation = step * step / 12.0;
        for y in 0..call.height {
            let first = call.at(0, y);
            // The pixel and its four neighbours, as slices of one row each.
            let starts = [first, first - 1, first + 1, first - call.stride, first + call.stride];
            let [z, z_left, z_right, z_up, z_down] = starts.map(|start| &depth[start..][..width]);
            let [d, d_left, d_right, d_up, d_down] = starts.map(|start| &matched[start..][..width]);
            let angles = &mut slants.angle[y * width..][..width];
            let spreads = &mut slants.spread[y * width..][..width];
            let jumps = &mut slants.at_jump[y * width..][..width];
            let v = y as f32 + 0.5 - call.centre[1];
            for x in 0..width {
                let u = x as f32 + 0.5 - call.centre[0];
                // Depth slope from neighbours on the same surface: central where both are, one-sided where one is, else 0.
                let side = |other: f32| if same_surface(d[x], other, call.jump) { 1.0f32 } else { 0.0 };
                let slope = |before: f32, with_before: f32, after: f32, with_after: f32| {
                    let rise = with_before * (z[x] - before) + with_after * (after - z[x]);
                    rise * (1.0 - 0.5 * with_before * with_after)
                };
                let along_x = slope(z_left[x], side(d_left[x]), z_right[x], side(d_right[x]));
                let along_y = slope(z_up[x], side(d_up[x]), z_down[x], side(d_down[x]));
                // Incidence angle from the normal, held below 90 degrees, where the noise model diverges.
                let angle = call.incidence(z[x], [u, v], [along_x, along_y]);
                let held = if angle < MAX_ANGLE as f32 { angle } else { MAX_ANGLE as f32 };
                // Angle term of Nguyen, Izadi and Lovell 2012, theta^2 / (pi/2 - theta)^2 / sqrt(z), as disparity.
                let steep = held / (std::f32::consts::FRAC_PI_2 - held);
                let sigma = disparity_sigma + angle_sigma * steep * steep / (z[x] * z[x] * z[x].sqrt());
                let variance = sigma * sigma - quantisation;
                angles[x] = angle;
                spreads[x] = (if variance > 0.0 { variance } else { 0.0 }).sqrt();
                // Count of neighbours across a disparity jump.
                let jump = |other: f32| if (other > 0.0) & ((other - d[x]).abs() > call.jump) { 1.0f32 } else { 0.0 };
                jumps[x] = jump(d_left[x]) + jump(d_right[x]) + jump(d_up[x]) + jump(d_down[x]);
            }
        }
    }

    /// Writes to `out` the disparity that every pixel finds, in pixels of the device and without noise, 0 = none.
    fn choose_sources(&self, call: &Call, scratch: &mut SensorScratch, out: &mut [f32], stream: &mut Stream) {
        let SensorScratch { matched, slants, lateral: [across, down], grazing, spread, sources, .. } = scratch;
        if let Some(sources) = sources {
            sources.clear();
            sources.resize(out.len(), 0);
        }
        let lateral = self.lateral_sigma_px as f32;
        let reach = libm::ceil(3.0 * self.lateral_sigma_px) as f32;
        // Rounds to nearest without a call: casts cut towards zero, and the sum is positive.
        let shift = |noise: f32| ((noise * lateral).clamp(-reach, reach) + (reach + 0.5)) as i32 - reach as i32;
        let grazing_angle = (self.grazing_angle_deg as f32).to_radians();
        let grazing_spread = (self.grazing_spread_deg as f32).to_radians();
        spread.clear();
        spread.resize(out.len(), 0.0);
        for y in 0..call.height {
            for x in 0..call.width {
                let i = y * call.width + x;
                // Lateral noise: a shifted neighbour is the source where it lies on another surface.
                let (dx, dy) = (shift(across[i]), shift(down[i]));
                let (mut source_x, mut source_y) = (x, y);
                let (from_x, from_y) = (x.wrapping_add_signed(dx as isize), y.wrapping_add_signed(dy as isize));
                if from_x < call.width && from_y < call.height {
                    // A shift along one surface is no error of its own: the axial noise holds it. It only moves edges.
                    let jump = call.jump * (dx.abs() + dy.abs()) as f32;
                    if !same_surface(matched[call.at(x, y)], matched[call.at(from_x, from_y)], jump) {
                        (source_x, source_y) = (from_x, from_y);
                    }
                }
                let at = call.at(source_x, source_y);
                let source = source_y * call.width + source_x;
                // Dropout at grazing incidence, with a random limit.
                let mut seen = matched[at];
                if seen > 0.0 && slants.angle[source] > grazing_angle + grazing_spread * grazing[i] {
                    seen = 0.0;
                }
                // Pixels beside a jump mix or lose their match.
                let of_surface = seen;
                if seen > 0.0 && slants.at_jump[source] > 0.0 {
                    seen = self.beside_jump(call, matched, at, stream);
                }
                if let Some(sources) = sources {
                    let is_between = seen > 0.0 && seen != of_surface;
                    sources[i] = if is_between { SensorScratch::BETWEEN } else { source as u32 };
                }
                // Disparity in pixels of the device, and the noise of the source.
                out[i] = seen * call.device_per_image;
                spread[i] = slants.spread[source];
            }
        }
    }

    /// Disparity in pixels of the image after what a jump beside pixel `at` does to it; 0 when it is lost.
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

    /// Converts disparities without noise to returned depths [m], NaN = no return.
    fn measure(&self, call: &Call, axial: &[f32], spread: &[f32], out: &mut [f32]) {
        let (step, depth_step) = (self.disparity_step_px as f32, self.depth_step_m as f32);
        let (min, max) = (self.min_range_m as f32, self.max_range_m as f32);
        for ((value, noise), spread) in out.iter_mut().zip(axial).zip(spread) {
            let found = *value > 0.0;
            let mut disparity = *value + noise * spread;
            if step > 0.0 {
                disparity = nearest_multiple(disparity, step);
            }
            let mut depth = call.device / disparity;
            if depth_step > 0.0 {
                depth = nearest_multiple(depth, depth_step);
            }
            // A disparity of 0 or less is infinitely far or behind: out of range as well.
            *value = if found & (depth >= min) & (depth <= max) { depth } else { f32::NAN };
        }
    }
}

impl Call {
    /// Index of a pixel in the images with a border.
    fn at(&self, x: usize, y: usize) -> usize {
        (y + 1) * self.stride + x + 1
    }

    /// Indices of a row in the images with a border.
    fn row(&self, y: usize) -> std::ops::Range<usize> {
        let first = self.at(0, y);
        first..first + self.width
    }

    /// Angle between the line of sight through (u, v), from the principal point [px], and the normal of a surface of
    /// this depth [m] and these slopes [m/px], in radians.
    fn incidence(&self, depth: f32, [u, v]: [f32; 2], [along_x, along_y]: [f32; 2]) -> f32 {
        // Point = depth * ray; the cross product of its derivatives along u and v, times the focal lengths.
        let normal = [self.focal[0] * along_x, self.focal[1] * along_y, depth + u * along_x + v * along_y];
        let ray = [u / self.focal[0], v / self.focal[1], 1.0];
        let square = |v: [f32; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        let cosine = depth / (square(normal) * square(ray)).sqrt();
        arc_cosine(if cosine < 1.0 { cosine } else { 1.0 })
    }
}

/// Whether two pixels see one surface: both see something and their disparities differ by at most `jump`; or neither does.
fn same_surface(a: f32, b: f32, jump: f32) -> bool {
    ((a > 0.0) == (b > 0.0)) & ((a - b).abs() <= jump)
}

/// Abramowitz and Stegun 4.4.45, good to 7e-5 rad for 0 <= x <= 1; adds and products only, so the same bits everywhere.
fn arc_cosine(x: f32) -> f32 {
    (1.0 - x).sqrt() * (1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - x * 0.018_729_3)))
}

/// The multiple of `step` next to `value`, for values from 0 to 2^22 steps: above 2^23 an f32 holds whole numbers only.
fn nearest_multiple(value: f32, step: f32) -> f32 {
    const WHOLE: f32 = 8_388_608.0;
    ((value / step + WHOLE) - WHOLE) * step
}

/// Walks a row whose second viewpoint lies towards growing x and calls `lose` for every pixel hidden from there.
fn shade_row(at: impl Fn(usize) -> f32, last: usize, nearest: f32, jump: f32, mut lose: impl FnMut(usize)) {
    for x in 0..=last {
        let own = at(x);
        // No return, or nothing in the row sufficiently nearer: no shadow here.
        if own == 0.0 || nearest - own <= jump {
            continue;
        }
        // Column in the second view, and how far to the right an occluder can stand.
        let column = x as f32 - own;
        let end = last.min(x + (nearest - own + 1.0) as usize);
        let hidden = (x + 1..=end).any(|j| {
            let other = at(j);
            if other - own <= jump {
                return false;
            }
            // Occluder's column in the second view: hides the pixel when it falls on the same one.
            let first = j as f32 - other;
            if (first - column).abs() <= 0.5 {
                return true;
            }
            // Between two pixels of one surface the line of sight is closed too.
            let next = if j < last { at(j + 1) } else { 0.0 };
            let second = (j + 1) as f32 - next;
            next > 0.0 && (next - other).abs() <= jump && first.min(second) <= column && column <= first.max(second)
        });
        if hidden {
            lose(x);
        }
    }
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
    scratch.depth.clear();
    scratch.depth.resize(stride * (height + 2), 0.0);
    let first = ((crop.top - top) as usize + 1) * stride + (crop.left - left) as usize + 1;
    for (y, row) in crop.depth.chunks_exact(crop.width as usize).enumerate() {
        let target = &mut scratch.depth[first + y * stride..][..row.len()];
        for (target, depth) in target.iter_mut().zip(row) {
            *target = if depth.is_nan() { 0.0 } else { *depth };
        }
    }
    *crop = DepthCrop { left, top, width: right - left, height: bottom - top, depth: std::mem::take(&mut crop.depth) };
    crop.depth.clear();
    crop.depth.resize(width * height, f32::NAN);
}
