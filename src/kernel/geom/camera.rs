//! The pinhole camera.

use nalgebra::Point3;

/// Longest side of an image [px].
const MAX_SIDE: u32 = 16384;
/// Shortest and longest focal length, in longer sides of the image: fields of view from 178.9 to 0.6 degrees.
const FOCAL_SIDES: [f64; 2] = [0.01, 100.0];
/// Largest distance of the principal point from the middle of the image, in image sides along that axis: in images
/// cropped from larger ones it is outside.
const PRINCIPAL_SIDES: f64 = 5.0;

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
    /// Nothing nearer than this along the optical axis is visible [m].
    pub near: f64,
}

/// Why numbers do not make a camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidIntrinsics {
    /// The image has no pixels or too many for the kernels' 16-bit pixel coordinates.
    #[error("image size {width} x {height} px: each side must be 1 to {MAX_SIDE}")]
    Size {
        /// Given width [px].
        width: u32,
        /// Given height [px].
        height: u32,
    },
    /// A focal length or a principal point that no camera of this image size has.
    #[error("{name} = {value:?} px: must lie between {} and {} px for an image of {width} x {height} px", range[0], range[1])]
    OutOfRange {
        /// `fx`, `fy`, `cx` or `cy`.
        name: &'static str,
        /// Value of the number [px].
        value: f64,
        /// Smallest and largest value [px].
        range: [f64; 2],
        /// Image width [px].
        width: u32,
        /// Image height [px].
        height: u32,
    },
    /// The near limit is not positive and finite.
    #[error("near = {0:?} m: must be positive and finite")]
    Near(f64),
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

    /// Passes `self` on when every number is one that a camera can have: sides of 1 to 16384 px, focal lengths of 0.01 to 100 times
    /// the longer side, a principal point up to five sides from the middle.
    ///
    /// # Errors
    /// When a number is out of range; NaN is in none.
    pub fn checked(self) -> Result<Self, InvalidIntrinsics> {
        let Self { width, height, fx, fy, cx, cy, near } = self;
        if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
            return Err(InvalidIntrinsics::Size { width, height });
        }
        let focal = FOCAL_SIDES.map(|sides| sides * f64::from(width.max(height)));
        let principal = |side: u32| [0.5 - PRINCIPAL_SIDES, 0.5 + PRINCIPAL_SIDES].map(|sides| sides * f64::from(side));
        let numbers =
            [("fx", fx, focal), ("fy", fy, focal), ("cx", cx, principal(width)), ("cy", cy, principal(height))];
        for (name, value, range) in numbers {
            if !(range[0]..=range[1]).contains(&value) {
                return Err(InvalidIntrinsics::OutOfRange { name, value, range, width, height });
            }
        }
        if near > 0.0 && near.is_finite() { Ok(self) } else { Err(InvalidIntrinsics::Near(near)) }
    }

    /// Returns the camera with another focal length [px], where one is given.
    pub fn with_focal_length(self, focal_length: Option<f64>) -> Self {
        focal_length.map_or(self, |f| Self { fx: f, fy: f, ..self })
    }

    /// Vertical field of view [rad], as for MuJoCo's `fovy` (there in degrees).
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_no_camera_has_are_refused_by_name() {
        let camera = Intrinsics { width: 640, height: 480, fx: 525.0, fy: 525.0, cx: 320.0, cy: 240.0, near: 0.01 };
        assert_eq!(camera.checked(), Ok(camera));
        // The ends of each range are allowed, the next values beyond them are not.
        for (low, high, set) in [
            (6.4, 64_000.0, (|camera, fx| Intrinsics { fx, ..camera }) as fn(Intrinsics, f64) -> Intrinsics),
            (6.4, 64_000.0, |camera, fy| Intrinsics { fy, ..camera }),
            (-2880.0, 3520.0, |camera, cx| Intrinsics { cx, ..camera }),
            (-2160.0, 2640.0, |camera, cy| Intrinsics { cy, ..camera }),
        ] {
            assert!([low, high].iter().all(|value| set(camera, *value).checked().is_ok()));
            for value in [low.next_down(), high.next_up(), f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
                assert!(matches!(set(camera, value).checked(), Err(InvalidIntrinsics::OutOfRange { .. })), "{value}");
            }
        }
        for near in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(Intrinsics { near, ..camera }.checked(), Err(InvalidIntrinsics::Near(_))));
        }
        for (width, height) in [(0, 480), (640, 0), (16385, 480)] {
            let expected = Err(InvalidIntrinsics::Size { width, height });
            assert_eq!(Intrinsics { width, height, ..camera }.checked(), expected);
        }
        let words = Intrinsics { fx: 1e-320, ..camera }.checked().expect_err("no focal length").to_string();
        assert!(
            words.starts_with("fx = 1e-320 px") && words.contains("between 6.4 and 64000 px for an image of 640 x 480")
        );
    }
}
