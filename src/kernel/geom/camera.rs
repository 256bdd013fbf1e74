//! The pinhole camera.

use nalgebra::Point3;

/// A pinhole camera without distortion. Pixel (0, 0) is the top left one; pixel centres lie at +0.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Image width [px].
    pub width: u32,
    /// Image height [px].
    pub height: u32,
    /// Focal length along x [px].
    pub fx: f64,
    /// Focal length along y [px].
    pub fy: f64,
    /// Principal point, x [px].
    pub cx: f64,
    /// Principal point, y [px].
    pub cy: f64,
    /// Nothing nearer than this along the optical axis is seen [m].
    pub near: f64,
}

/// Why numbers do not make a camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidIntrinsics {
    /// The image has no pixels or too many for the kernels' 16-bit pixel coordinates.
    #[error("image size {width} x {height} px: each side must be 1 to 16384")]
    Size {
        /// Given width [px].
        width: u32,
        /// Given height [px].
        height: u32,
    },
    /// A number that must be positive and finite is not.
    #[error("{name} = {value}: must be positive and finite")]
    NotPositive {
        /// Which number.
        name: &'static str,
        /// Value of the parameter.
        value: f64,
    },
    /// The field of view must lie strictly between 0 and pi.
    #[error("field of view {0} rad: must lie between 0 and pi")]
    FieldOfView(f64),
}

impl Intrinsics {
    /// Square pixels, principal point in the middle, from the horizontal field of view [rad].
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn from_horizontal_fov(width: u32, height: u32, fov: f64, near: f64) -> Result<Self, InvalidIntrinsics> {
        if !(fov > 0.0 && fov < std::f64::consts::PI) {
            return Err(InvalidIntrinsics::FieldOfView(fov));
        }
        let f = f64::from(width) / 2.0 / libm::tan(fov / 2.0);
        Self { width, height, fx: f, fy: f, cx: f64::from(width) / 2.0, cy: f64::from(height) / 2.0, near }.checked()
    }

    /// Passes `self` on when every number is usable.
    ///
    /// # Errors
    /// When a number is out of range.
    pub fn checked(self) -> Result<Self, InvalidIntrinsics> {
        let Self { width, height, .. } = self;
        if !(1..=16384).contains(&width) || !(1..=16384).contains(&height) {
            return Err(InvalidIntrinsics::Size { width, height });
        }
        for (name, value) in [("fx", self.fx), ("fy", self.fy), ("near", self.near)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(InvalidIntrinsics::NotPositive { name, value });
            }
        }
        Ok(self)
    }

    /// Returns the camera with another focal length [px], where one is given.
    pub fn with_focal_length(self, focal_length: Option<f64>) -> Self {
        focal_length.map_or(self, |f| Self { fx: f, fy: f, ..self })
    }

    /// Vertical field of view [rad], as MuJoCo's `fovy` wants it (there in degrees).
    pub fn vertical_fov(&self) -> f64 {
        2.0 * libm::atan(f64::from(self.height) / 2.0 / self.fy)
    }

    /// The point seen at pixel coordinates (u, v) [px] at `depth` along the optical axis [m], in `CameraCv`.
    pub fn unproject(&self, u: f64, v: f64, depth: f64) -> Point3<f64> {
        Point3::new((u - self.cx) / self.fx * depth, (v - self.cy) / self.fy * depth, depth)
    }

    /// Pixel coordinates (u, v) [px] of a point in `CameraCv` in front of the camera.
    pub fn project(&self, point: &Point3<f64>) -> (f64, f64) {
        (self.fx * point.x / point.z + self.cx, self.fy * point.y / point.z + self.cy)
    }
}
