//! Patches that show squares of one size in metres.

use prost::Message;

use super::{
    HeatmapPatch, PATCH_POINTS,
    arrays::{depths, is_same_depth},
};
use crate::codec::{
    RecordError,
    fields::{broken, lengthy, ranged},
    proto, sample_from_proto, wire,
};
use kernel::ids::SampleId;

const MESSAGE: &str = "PatchMetric";

/// Side of the square of the image that covers `size` [m] at a depth [m]: the nearest whole number of pixels, at least 1.
pub fn window_side(size: f64, focal_length: f64, depth: f64) -> u32 {
    (size * focal_length / depth).round().max(1.0) as u32
}

/// Pixel of a window of `window` pixels that pixel `index` of a patch of `side` pixels shows: the one that holds its middle,
/// `floor((index + 1/2) window / side)`, in whole numbers.
pub fn window_pixel(index: u32, window: u32, side: u32) -> u32 {
    ((2 * u64::from(index) + 1) * u64::from(window) / (2 * u64::from(side))) as u32
}

/// Patches around the points of a grasp, each a square of the image that covers one size in metres at its point's depth, resampled
/// to one number of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchMetric {
    /// Which sample: that of the [`HeatmapPatch`].
    pub sample: SampleId,
    /// Side of the squares [m].
    pub size: f64,
    /// Side of each patch [px].
    pub side: u32,
    /// Side of the square of the image that each patch was resampled from [px] ([`window_side`]).
    pub windows: [u32; PATCH_POINTS],
    /// The left and top pixel of that square.
    pub corners: [[u32; 2]; PATCH_POINTS],
    /// Depth along the optical axis [m], NaN = no return, of the pixels that [`window_pixel`] names. Shape (points, side, side),
    /// row-major.
    pub depth: Vec<f32>,
}

impl PatchMetric {
    /// The depth of the patch around a point.
    pub fn depth_of(&self, point: usize) -> &[f32] {
        let pixels = (self.side * self.side) as usize;
        &self.depth[point * pixels..(point + 1) * pixels]
    }

    /// The pixel of the image whose depth a pixel of the patch around a point has: column and row.
    pub fn pixel(&self, point: usize, column: u32, row: u32) -> [u32; 2] {
        let (window, [left, top]) = (self.windows[point], self.corners[point]);
        [left + window_pixel(column, window, self.side), top + window_pixel(row, window, self.side)]
    }

    /// Checks that the squares are those of the size around the points of `patch`, and the depth that of its patches where they
    /// show the same pixels.
    ///
    /// # Errors
    /// When they are not.
    pub fn check_beside(&self, patch: &HeatmapPatch) -> Result<(), RecordError> {
        ranged(MESSAGE, "side", f64::from(self.side), self.side == patch.side, "that of the patches in pixels")?;
        for (index, point) in patch.points.iter().enumerate() {
            let depth = patch.camera_from_object.point(&point.point.into()).z;
            let (window, corner) = (self.windows[index], self.corners[index]);
            let covers = window == window_side(self.size, patch.camera.fx, depth);
            ranged(MESSAGE, "windows", f64::from(window), covers, "the size at the depth of the point")?;
            for (axis, max) in [patch.camera.width, patch.camera.height].into_iter().enumerate() {
                let middle = f64::from(corner[axis]) + f64::from(window) / 2.0;
                let is_around = (middle - point.pixel[axis]).abs() <= 0.5 + 1e-6;
                ranged(MESSAGE, "corners", f64::from(corner[axis]), is_around, "around the pixel of its point")?;
                let inside = corner[axis].checked_add(window).is_some_and(|end| end <= max);
                ranged(MESSAGE, "corners", f64::from(corner[axis]), inside, "inside the image")?;
            }
            let depths = (0..self.side).flat_map(|row| (0..self.side).map(move |column| (column, row)));
            for ((column, row), depth) in depths.zip(self.depth_of(index)) {
                let [x, y] = self.pixel(index, column, row);
                let (x, y) = (x.wrapping_sub(point.corner[0]), y.wrapping_sub(point.corner[1]));
                if x >= patch.side || y >= patch.side {
                    continue;
                }
                let seen = patch.depth_of(index)[(y * patch.side + x) as usize];
                ranged(
                    MESSAGE,
                    "depth",
                    f64::from(*depth),
                    is_same_depth(seen, *depth),
                    "that of the patches in pixels",
                )?;
            }
        }
        Ok(())
    }

    /// Appends the payload to `out`; equal records give equal bytes.
    pub fn encode(&self, out: &mut Vec<u8>) {
        wire::sample(out, 1, &self.sample);
        wire::double(out, 2, self.size);
        wire::uint32(out, 3, self.side);
        wire::uint32s(out, 4, self.windows.into_iter());
        wire::uint32s(out, 5, self.corners.as_flattened().iter().copied());
        wire::floats_one_nan(out, 6, &self.depth);
    }

    /// Reads and checks a payload.
    ///
    /// # Errors
    /// When a length does not hold or a number is out of range.
    pub fn decode(payload: &[u8]) -> Result<Self, RecordError> {
        let raw = proto::PatchMetric::decode(payload).map_err(broken(MESSAGE))?;
        let sample = sample_from_proto(MESSAGE, raw.sample)?;
        let proto::PatchMetric { size, side, windows, corners, .. } = raw;
        ranged(MESSAGE, "size", size, size > 0.0 && size.is_finite(), "positive and finite")?;
        ranged(MESSAGE, "side", f64::from(side), (1..=1024).contains(&side), "1 to 1024")?;
        lengthy(MESSAGE, "windows", PATCH_POINTS, windows.len())?;
        lengthy(MESSAGE, "corners", 2 * PATCH_POINTS, corners.len())?;
        for window in &windows {
            ranged(MESSAGE, "windows", f64::from(*window), (1..=16384).contains(window), "1 to 16384")?;
        }
        lengthy(MESSAGE, "depth", 4 * PATCH_POINTS * (side * side) as usize, raw.depth.len())?;
        Ok(Self {
            sample,
            size,
            side,
            windows: std::array::from_fn(|point| windows[point]),
            corners: std::array::from_fn(|point| [corners[2 * point], corners[2 * point + 1]]),
            depth: depths(MESSAGE, "depth", &raw.depth)?,
        })
    }
}
