//! The result of every reader, and the reasons for refusing a file.

use kernel::geom::InvalidIntrinsics;

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
    #[error("an image says nothing of its camera: give its intrinsics (fx, fy, cx, cy)")]
    NoIntrinsics,
    /// Intrinsics that are none.
    #[error("intrinsics: {0}")]
    Intrinsics(#[from] InvalidIntrinsics),
    /// The principal point lies outside of the image.
    #[error(
        "the principal point ({cx}, {cy}) lies outside of the image of {width} x {height} px: are the intrinsics of another image size?"
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
    /// Intrinsics or ranges for a cloud, whose points say where its camera is.
    #[error("the points of a cloud say what its camera is: leave intrinsics and ranges out")]
    CameraOfCloud,
    /// No pixel has a depth.
    #[error("no pixel has a depth: all are 0, NaN or behind the camera, which looks along +z (x right, y down)")]
    Empty,
    /// The depths are no table's.
    #[error("the median depth is {median} m, not between 0.1 and 10 m; {remedy}")]
    Median {
        /// The median [m].
        median: f64,
        /// A scale that would fit, in words.
        remedy: String,
    },
}

impl FrameProblem {
    pub(super) fn content(place: impl ToString, found: impl ToString, remedy: &'static str) -> Self {
        Self::Content { place: place.to_string(), found: found.to_string(), remedy }
    }
}

/// Depths and labels as a file has them, before they are checked.
pub(super) struct RawFrame {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Depth [m]; what is not above 0 is no return.
    pub(super) depth: Vec<f32>,
    pub(super) labels: Option<Vec<u32>>,
    /// fx, fy, cx, cy that the points themselves obey.
    pub(super) intrinsics: Option<[f64; 4]>,
}

/// Width times height, within bounds.
pub(super) fn pixel_count(width: usize, height: usize, place: &str) -> Result<usize, FrameProblem> {
    let count = width.checked_mul(height).filter(|count| (1..=MAX_PIXELS).contains(count));
    count.ok_or_else(|| {
        FrameProblem::content(place, format!("{width} x {height} pixels"), "a picture has 1 to 16,777,216 pixels")
    })
}
