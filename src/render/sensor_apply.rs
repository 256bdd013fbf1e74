//! The sensor model at work on one depth crop.

use super::{SensorModel, sensor::MAX_ANGLE, sensor_field::BoxSum};
use crate::{
    geom::{DepthCrop, Intrinsics},
    seed::Stream,
};

/// Memory of [`SensorModel::apply_with`]; keep one a thread.
#[derive(Default)]
pub struct SensorScratch {
    boxes: BoxSum,
    /// Depth of the grown crop [m]; 0 = no return.
    depth: Vec<f32>,
    /// Disparity in pixels of the image; 0 = no return.
    disparity: Vec<f32>,
    /// What the matcher can find: `disparity` without shadows and thin parts.
    matched: Vec<f32>,
    axial: Vec<f32>,
    lateral: [Vec<f32>; 2],
    grazing: Vec<f32>,
}

/// Numbers of one call, in f32 as the kernel wants them.
struct Call {
    width: usize,
    height: usize,
    /// Principal point in the grown crop [px].
    centre: [f32; 2],
    /// Focal lengths of the job's camera [px].
    focal: [f32; 2],
    /// Disparity of the device [px] times depth [m].
    device: f32,
    /// Device's pixels a pixel of the image.
    device_per_image: f32,
    jump: f32,
}

impl SensorModel {
    /// Turns a perfect depth crop into what the sensor returns, with memory of its own for the call.
    pub fn apply(&self, camera: &Intrinsics, crop: &mut DepthCrop, stream: &mut Stream) {
        self.apply_with(&mut SensorScratch::default(), camera, crop, stream);
    }

    /// Turns a perfect depth crop into what the sensor returns. Class `exact`: a function of its arguments alone.
    ///
    /// The crop grows by three times `lateral_sigma_px` on each side, inside the image, because edges move both ways.
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
        let (width, height, window) = (call.width, call.height, self.window_px as usize);
        let SensorScratch { boxes, axial, lateral: [across, down], grazing, .. } = scratch;
        for field in [axial, across, down, grazing] {
            boxes.noise(field, width, height, window, stream);
        }
        self.measure(&call, scratch, &mut crop.depth, stream);
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
        let rows = disparity.chunks_exact(call.width).zip(matched.chunks_exact_mut(call.width));
        let last = call.width - 1;
        for (row, matched) in rows {
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
        let least = self.min_support * (window * window) as f64;
        if least <= 1.0 {
            return;
        }
        let (padded, stride) = boxes.padded(call.width, call.height, window);
        for (y, row) in matched.chunks_exact(call.width).enumerate() {
            let line = &mut padded[(y + window / 2) * stride + window / 2..][..call.width];
            for (seen, disparity) in line.iter_mut().zip(row) {
                *seen = i32::from(*disparity > 0.0);
            }
        }
        boxes.sums(call.width, call.height, window, |y, sums| {
            for (disparity, sum) in matched[y * call.width..][..call.width].iter_mut().zip(sums) {
                if f64::from(*sum) < least {
                    *disparity = 0.0;
                }
            }
        });
    }

    /// Writes the returned depth of every pixel.
    fn measure(&self, call: &Call, scratch: &SensorScratch, out: &mut [f32], stream: &mut Stream) {
        let lateral = self.lateral_sigma_px as f32;
        let reach = libm::ceil(3.0 * self.lateral_sigma_px) as f32;
        let shift = |noise: f32| {
            let shift = (noise * lateral).clamp(-reach, reach);
            // Rounds to nearest without a call: casts cut towards zero, and the sum is positive.
            (shift + (reach + 0.5)) as isize - reach as isize
        };
        for y in 0..call.height {
            for x in 0..call.width {
                let i = y * call.width + x;
                let from_x = x as isize + shift(scratch.lateral[0][i]);
                let from_y = y as isize + shift(scratch.lateral[1][i]);
                let inside = (0..call.width as isize).contains(&from_x) && (0..call.height as isize).contains(&from_y);
                let (mut source_x, mut source_y) = (x, y);
                // A shift along one surface is no error of its own: the axial noise holds it. It only moves edges.
                let from = if inside { from_y as usize * call.width + from_x as usize } else { i };
                let steps = (from_x - x as isize).unsigned_abs() + (from_y - y as isize).unsigned_abs();
                if inside && !same_surface(scratch.matched[i], scratch.matched[from], call.jump * steps as f32) {
                    (source_x, source_y) = (from_x as usize, from_y as usize);
                }
                out[i] = self.measure_pixel(call, scratch, [source_x, source_y], i, stream);
            }
        }
    }

    /// The returned depth [m] of pixel `i`, which looks at pixel `source`; NaN = no return.
    fn measure_pixel(
        &self,
        call: &Call,
        scratch: &SensorScratch,
        source: [usize; 2],
        i: usize,
        stream: &mut Stream,
    ) -> f32 {
        let s = source[1] * call.width + source[0];
        if scratch.matched[s] == 0.0 {
            return f32::NAN;
        }
        let depth = scratch.depth[s];
        let angle = call.incidence(&scratch.depth, &scratch.matched, source);
        let limit = (self.grazing_angle_deg as f32 + self.grazing_spread_deg as f32 * scratch.grazing[i]).to_radians();
        if angle > limit {
            return f32::NAN;
        }
        let Some(seen) = self.at_jump(call, &scratch.matched, source, stream) else { return f32::NAN };
        let mut disparity = seen * call.device_per_image;

        let steep = angle.min(MAX_ANGLE as f32);
        let steep = steep / (std::f32::consts::FRAC_PI_2 - steep);
        let slanted = self.angle_sigma_m as f32 * steep * steep / depth.sqrt() * call.device / (depth * depth);
        let step = self.disparity_step_px as f32;
        let sigma = self.disparity_sigma_px as f32 + slanted;
        // The published figure holds the quantisation, whose variance is step^2 / 12.
        disparity += (sigma * sigma - step * step / 12.0).max(0.0).sqrt() * scratch.axial[i];
        if step > 0.0 {
            disparity = nearest_multiple(disparity, step);
        }
        if disparity <= 0.0 {
            return f32::NAN;
        }
        let mut measured = call.device / disparity;
        if self.depth_step_m > 0.0 {
            measured = nearest_multiple(measured, self.depth_step_m as f32);
        }
        let range = self.min_range_m as f32..=self.max_range_m as f32;
        if range.contains(&measured) { measured } else { f32::NAN }
    }

    /// Disparity in pixels of the image after what a jump beside the pixel does to it; `None` when it is lost.
    fn at_jump(&self, call: &Call, matched: &[f32], [x, y]: [usize; 2], stream: &mut Stream) -> Option<f32> {
        let i = y * call.width + x;
        let own = matched[i];
        let mut other = own;
        let neighbours = [
            (x > 0).then(|| i - 1),
            (x + 1 < call.width).then(|| i + 1),
            (y > 0).then(|| i - call.width),
            (y + 1 < call.height).then(|| i + call.width),
        ];
        for neighbour in neighbours.into_iter().flatten() {
            let disparity = matched[neighbour];
            if disparity > 0.0 && (disparity - own).abs() > call.jump.max((other - own).abs()) {
                other = disparity;
            }
        }
        if other == own {
            return Some(own);
        }
        let draw = stream.unit();
        if draw < self.edge_dropout {
            None
        } else if draw < self.edge_dropout + self.edge_mixed {
            Some(own + (other - own) * stream.unit() as f32)
        } else {
            Some(own)
        }
    }
}

impl Call {
    /// Angle between the line of sight and the normal of the surface [rad], from the slopes of depth to the neighbours
    /// on the same surface; 0 where there are none.
    fn incidence(&self, depth: &[f32], matched: &[f32], [x, y]: [usize; 2]) -> f32 {
        let i = y * self.width + x;
        let slope = |before: Option<usize>, after: Option<usize>| {
            let rise = |j: usize| same_surface(matched[i], matched[j], self.jump).then(|| depth[j] - depth[i]);
            match (before.and_then(rise), after.and_then(rise)) {
                (Some(before), Some(after)) => 0.5 * (after - before),
                (Some(before), None) => -before,
                (None, Some(after)) => after,
                (None, None) => 0.0,
            }
        };
        let along_x = slope((x > 0).then(|| i - 1), (x + 1 < self.width).then(|| i + 1));
        let along_y = slope((y > 0).then(|| i - self.width), (y + 1 < self.height).then(|| i + self.width));
        let (u, v) = (x as f32 + 0.5 - self.centre[0], y as f32 + 0.5 - self.centre[1]);
        // Point = depth * ray; the cross product of its derivatives along u and v, times the focal lengths.
        let normal = [self.focal[0] * along_x, self.focal[1] * along_y, -(depth[i] + u * along_x + v * along_y)];
        let ray = [u / self.focal[0], v / self.focal[1], 1.0];
        let length = |v: [f32; 3]| v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
        arc_cosine((depth[i] / (length(normal) * length(ray)).sqrt()).min(1.0))
    }
}

/// Whether two pixels see one surface: both see something and their disparities differ by at most `jump`.
fn same_surface(a: f32, b: f32, jump: f32) -> bool {
    (a > 0.0) == (b > 0.0) && (a - b).abs() <= jump
}

/// Abramowitz and Stegun 4.4.45, good to 7e-5 rad for 0 <= x <= 1; adds and products only, so the same bits everywhere.
fn arc_cosine(x: f32) -> f32 {
    (1.0 - x).sqrt() * (1.570_728_8 + x * (-0.212_114_4 + x * (0.074_261 - x * 0.018_729_3)))
}

/// The multiple of `step` next to `value`; `value / step` below 2^23.
fn nearest_multiple(value: f32, step: f32) -> f32 {
    (value / step + 0.5).floor() * step
}

/// Walks a row whose second viewpoint lies towards growing x and calls `lose` for every pixel hidden from there.
fn shade_row(at: impl Fn(usize) -> f32, last: usize, nearest: f32, jump: f32, mut lose: impl FnMut(usize)) {
    for x in 0..=last {
        let own = at(x);
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
    scratch.depth.clear();
    scratch.depth.resize(width * height, 0.0);
    let first = (crop.top - top) as usize * width + (crop.left - left) as usize;
    for (y, row) in crop.depth.chunks_exact(crop.width as usize).enumerate() {
        let target = &mut scratch.depth[first + y * width..][..row.len()];
        for (target, depth) in target.iter_mut().zip(row) {
            *target = if depth.is_nan() { 0.0 } else { *depth };
        }
    }
    *crop = DepthCrop { left, top, width: right - left, height: bottom - top, depth: std::mem::take(&mut crop.depth) };
    crop.depth.clear();
    crop.depth.resize(width * height, f32::NAN);
}
