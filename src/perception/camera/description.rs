//! Numbers of a camera.

use kernel::geom::{Intrinsics, InvalidIntrinsics};

use super::{distortion::Distortion, problem::CameraProblem};

/// Coordinate of the first pixel's centre in OpenCV, ROS, librealsense, Kalibr, BOP and Open3D [px].
pub const CENTRE_AT_ZERO: f64 = 0.0;
/// Coordinate of the first pixel's centre in graspmill [px].
pub const CENTRE_AT_HALF: f64 = 0.5;

/// Smallest and largest unit of depth [m].
pub(crate) const DEPTH_SCALES: [f64; 2] = [1e-7, 10.0];
/// Largest coefficient of distortion.
const MAX_COEFFICIENT: f64 = 1e4;

/// A camera as a calibration states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraDescription {
    /// fx, fy, cx, cy [px].
    pub numbers: [f64; 4],
    /// Coordinate of the centre of the first pixel that cx and cy are counted by [px]: 0 or 0.5.
    pub pixel_centre: f64,
    /// Width and height of the image that the numbers belong to [px], where they are stated.
    pub image_size: Option<[u32; 2]>,
    /// Distortion of the lens.
    pub distortion: Distortion,
    /// Metres per unit of the whole numbers of the camera's depth pictures, where the description states it.
    pub depth_scale: Option<f64>,
}

impl CameraDescription {
    /// A camera without distortion, pixel centres at +0.5.
    pub fn pinhole(numbers: [f64; 4]) -> Self {
        Self {
            numbers,
            pixel_centre: CENTRE_AT_HALF,
            image_size: None,
            distortion: Distortion::default(),
            depth_scale: None,
        }
    }

    /// fx, fy, cx, cy [px] with pixel centres at +0.5, as graspmill counts them.
    pub fn with_centres_at_half(&self) -> [f64; 4] {
        let [fx, fy, cx, cy] = self.numbers;
        let shift = CENTRE_AT_HALF - self.pixel_centre;
        [fx, fy, cx + shift, cy + shift]
    }

    /// Refuses numbers that no camera has. Without a stated image size, focal lengths and principal points have to be finite here,
    /// and get their range with the picture's size.
    pub(super) fn checked(self) -> Result<Self, CameraProblem> {
        let [fx, fy, cx, cy] = self.with_centres_at_half();
        if let Some([width, height]) = self.image_size {
            let camera = Intrinsics { width, height, fx, fy, cx, cy, near: 1.0 };
            if let Err(error) = camera.checked() {
                let place = match &error {
                    InvalidIntrinsics::OutOfRange { name, .. } => name,
                    InvalidIntrinsics::Size { .. } | InvalidIntrinsics::FieldOfView(_) | InvalidIntrinsics::Near(_) => {
                        "width and height"
                    }
                };
                let remedy = "give the numbers of this camera in pixels, with the size of its image";
                return Err(CameraProblem::content(place, error, remedy));
            }
        }
        let positive = [("fx", fx), ("fy", fy)].into_iter().filter(|(_, value)| !(*value > 0.0 && value.is_finite()));
        let finite = [("cx", cx), ("cy", cy)].into_iter().filter(|(_, value)| !value.is_finite());
        if let Some((name, value)) = positive.chain(finite).next() {
            let remedy = "focal lengths are positive, and every number is finite";
            return Err(CameraProblem::content(name, format!("{value:?}"), remedy));
        }
        // NaN is in no range.
        let range = -MAX_COEFFICIENT..=MAX_COEFFICIENT;
        if let Some((name, value)) =
            self.distortion.coefficients().into_iter().find(|(_, value)| !range.contains(value))
        {
            return Err(CameraProblem::content(
                name,
                format!("{value:?}"),
                "coefficients of distortion are finite, at most 10000",
            ));
        }
        match self.depth_scale.filter(|scale| !is_depth_scale(*scale)) {
            Some(scale) => {
                Err(CameraProblem::content("depth_scale", format!("{scale:?} m"), "a unit of depth is 1e-7 to 10 m"))
            }
            None => Ok(self),
        }
    }
}

/// Whether pictures can store depth in this unit [m].
pub fn is_depth_scale(scale: f64) -> bool {
    (DEPTH_SCALES[0]..=DEPTH_SCALES[1]).contains(&scale)
}
