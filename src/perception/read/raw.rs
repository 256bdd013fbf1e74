//! The results of the readers, and the reasons for refusing a file.

use kernel::geom::InvalidIntrinsics;

use crate::camera::DEPTH_SCALES;

/// Most pixels of a picture: 4096 x 4096.
const MAX_PIXELS: usize = 1 << 24;

/// A fault in a file or in the numbers that it is read by.
#[derive(Debug, thiserror::Error)]
pub enum FrameProblem {
    /// The file cannot be read.
    #[error("it cannot be read")]
    Io(#[from] std::io::Error),
    /// The name ends in nothing that is known.
    #[error("its kind is unknown: give a .png of 16 bits, a .npy, or an organised .pcd or .ply")]
    Kind,
    /// The content breaks its format's rules.
    #[error("at {place}: {found}; {remedy}")]
    Content {
        /// Where in the file.
        place: String,
        /// Words or numbers found there.
        found: String,
        /// Remedy, as an instruction.
        remedy: &'static str,
    },
    /// An image without intrinsics.
    #[error("an image does not contain its camera: give its intrinsics (fx, fy, cx, cy)")]
    NoIntrinsics,
    /// Intrinsics that describe no camera.
    #[error("intrinsics: {0}; give the numbers of this image's camera, in pixels")]
    Intrinsics(#[from] InvalidIntrinsics),
    /// The principal point lies outside of the image, and no size is stated that the intrinsics belong to.
    #[error(
        "the principal point ({cx:?}, {cy:?}) lies outside of the image of {width} x {height} px: are the intrinsics of another image \
         size? Give those of this one; for a part of a larger picture, give a file with this width and height"
    )]
    OtherImageSize {
        /// Principal point, x [px].
        cx: f64,
        /// Principal point, y [px].
        cy: f64,
        /// Image width [px].
        width: u32,
        /// Image height [px].
        height: u32,
    },
    /// The intrinsics are those of an image of another size.
    #[error(
        "the image has {width} x {height} px, its intrinsics belong to one of {} x {} px: give those of this image",
        size[0],
        size[1]
    )]
    OtherCameraSize {
        /// Width and height that the intrinsics state [px].
        size: [u32; 2],
        /// Image width [px].
        width: u32,
        /// Image height [px].
        height: u32,
    },
    /// Intrinsics or ranges for a cloud, whose points determine its camera.
    #[error("the points of a cloud determine its camera: leave intrinsics and ranges out")]
    CameraOfCloud,
    /// Axes to mirror in an image, which has none.
    #[error("an image has no axes to mirror, only clouds do: leave --flip out")]
    FlipOfImage,
    /// A unit of depth that no file has.
    #[error("a depth scale of {0} m: give one from {low} to {high} m per unit", low = DEPTH_SCALES[0], high = DEPTH_SCALES[1])]
    Scale(f64),
    /// No pixel has a depth.
    #[error("no pixel has a depth: all are 0, NaN, infinite or saturated; give a picture with depths")]
    Empty,
    /// All depths are negative.
    #[error(
        "all depths are behind the camera, which looks along +z (x right, y down): z is {:.3} to {:.3} m; {remedy}",
        range[0],
        range[1]
    )]
    Behind {
        /// Smallest and largest depth [m].
        range: [f64; 2],
        /// Remedy, as an instruction.
        remedy: &'static str,
    },
    /// The depths are no table's.
    #[error("the median depth is {median} m, not between 0.1 and 10 m; {remedy}")]
    Median {
        /// The median [m].
        median: f64,
        /// A change that makes it fit, as an instruction.
        remedy: String,
    },
}

impl FrameProblem {
    pub(super) fn content(place: impl ToString, found: impl ToString, remedy: &'static str) -> Self {
        Self::Content { place: place.to_string(), found: found.to_string(), remedy }
    }
}

/// Numbers of an image as a file has them, row by row.
pub(super) enum Values {
    /// Whole numbers of some unit; 0 and the largest one are no return.
    Whole(Vec<u16>),
    /// Metres, unless a unit is given; what is not above 0 and finite is no return.
    Real(Vec<f32>),
}

impl Values {
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Whole(values) => values.len(),
            Self::Real(values) => values.len(),
        }
    }
}

/// An image as a file has it, before it is checked.
pub(super) struct Image {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) values: Values,
}

/// An organised cloud as a file has it, before it is checked.
pub(super) struct Cloud {
    pub(super) width: u32,
    pub(super) height: u32,
    /// A point per pixel, row by row; in metres, unless a unit is given.
    pub(super) points: Vec<[f64; 3]>,
    /// A label per pixel, where the file has them.
    pub(super) labels: Option<Vec<u32>>,
}

/// Width times height, within bounds.
pub(super) fn pixel_count(width: usize, height: usize, place: &str) -> Result<usize, FrameProblem> {
    let count = width.checked_mul(height).filter(|count| (1..=MAX_PIXELS).contains(count));
    count.ok_or_else(|| {
        FrameProblem::content(place, format!("{width} x {height} pixels"), "a picture has 1 to 16,777,216 pixels")
    })
}
