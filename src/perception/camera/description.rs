//! Numbers of a camera.

use super::problem::CameraProblem;

/// Coordinate of the first pixel's centre in OpenCV, ROS, librealsense and Open3D [px].
pub const CENTRE_AT_ZERO: f64 = 0.0;
/// Coordinate of the first pixel's centre in graspmill [px].
pub const CENTRE_AT_HALF: f64 = 0.5;

/// A camera as a calibration states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraDescription {
    /// fx, fy, cx, cy [px].
    pub numbers: [f64; 4],
    /// Coordinate of the centre of the first pixel that cx and cy are counted by [px]: 0 or 0.5.
    pub pixel_centre: f64,
    /// Width and height of the image that the numbers belong to [px], where they are stated.
    pub image_size: Option<[u32; 2]>,
    /// Distortion k1, k2, p1, p2, k3 of Brown's model (plumb bob); zeros for none.
    pub distortion: [f64; 5],
}

impl CameraDescription {
    /// A camera without distortion, pixel centres at +0.5.
    pub fn pinhole(numbers: [f64; 4]) -> Self {
        Self { numbers, pixel_centre: CENTRE_AT_HALF, image_size: None, distortion: [0.0; 5] }
    }

    /// fx, fy, cx, cy [px] with pixel centres at +0.5, as graspmill counts them.
    pub fn with_centres_at_half(&self) -> [f64; 4] {
        let [fx, fy, cx, cy] = self.numbers;
        let shift = CENTRE_AT_HALF - self.pixel_centre;
        [fx, fy, cx + shift, cy + shift]
    }

    /// Refuses numbers that no camera has.
    pub(super) fn checked(self) -> Result<Self, CameraProblem> {
        let [fx, fy, cx, cy] = self.numbers;
        let is_wrong = |name: &str, value: f64| match name {
            "fx" | "fy" => !(value > 0.0 && value.is_finite()),
            _ => !value.is_finite(),
        };
        let named = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)];
        let distortion = ["k1", "k2", "p1", "p2", "k3"].into_iter().zip(self.distortion);
        match named.into_iter().chain(distortion).find(|(name, value)| is_wrong(name, *value)) {
            None => Ok(self),
            Some((name, value)) => {
                let remedy = "focal lengths are positive, and every number is finite";
                Err(CameraProblem::content(name, value, remedy))
            }
        }
    }
}
