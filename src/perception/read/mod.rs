//! Reading depth pictures: PNG of 16 bits, NPY, and organised clouds as PCD or PLY.

mod head;
mod lzf;
mod mask;
mod npy;
mod organised;
mod pcd;
mod picture;
mod ply;
mod raw;

use std::path::{Path, PathBuf};

use kernel::{
    files::{self, Bound},
    geom::Intrinsics,
    ids::Digest,
    words::Show,
};

use crate::{
    camera::{CameraDescription, rectified},
    frame::{DepthFrame, LabelledFrame},
};

pub use mask::read_mask;
pub use raw::FrameProblem;
use raw::RawFrame;

/// Nearest and farthest median depth of a picture of objects on a table [m].
const MEDIAN_RANGE: [f64; 2] = [0.1, 10.0];
/// Metres per unit that depth is commonly stored in.
const COMMON_SCALES: [f64; 4] = [1.0, 0.001, 0.0002, 0.0001];
/// Nothing nearer is seen [m].
const NEAR: f64 = 0.01;

/// Camera and unit by which a picture's numbers are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameRule {
    /// The camera of an image; that of a cloud is found from its points.
    pub camera: Option<CameraDescription>,
    /// Metres per unit of whole numbers; 0 means no return.
    pub depth_scale: f64,
    /// Whether an image holds distances from the camera's centre, and not along its axis.
    pub is_range: bool,
}

impl Default for FrameRule {
    fn default() -> Self {
        Self { camera: None, depth_scale: 0.001, is_range: false }
    }
}

/// Why a file gives no depth picture.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", file.shown())]
pub struct FrameError {
    /// The file.
    pub file: PathBuf,
    /// The fault in it.
    #[source]
    pub problem: FrameProblem,
}

/// Reads a depth picture by what its name ends in.
///
/// # Errors
/// With the file, the place in it and the remedy.
pub fn read_frame(path: &Path, rule: &FrameRule) -> Result<LabelledFrame, FrameError> {
    let failed = |problem| FrameError { file: path.to_owned(), problem };
    let kind = path.extension().map(|kind| kind.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if !["png", "npy", "pcd", "ply"].contains(&kind.as_str()) {
        return Err(failed(FrameProblem::Kind));
    }
    let bytes = judged_bytes(path, &kind, Bound::PICTURE, |head| parse(&kind, head, rule).map(drop)).map_err(failed)?;
    let raw = parse(&kind, &bytes, rule);
    let (frame, labels) = raw.and_then(|raw| checked(raw, rule)).map_err(failed)?;
    Ok(LabelledFrame { frame, labels, digest: Digest::of(&bytes) })
}

fn parse(kind: &str, bytes: &[u8], rule: &FrameRule) -> Result<RawFrame, FrameProblem> {
    match kind {
        "png" => picture::parse(bytes, rule.depth_scale),
        "npy" => npy::parse(bytes, rule.depth_scale),
        "pcd" => pcd::parse(bytes),
        _ => ply::parse(bytes),
    }
}

/// The bytes of a picture, once its head says that they are worth reading; `refuse` reads a head alone.
fn judged_bytes(
    path: &Path,
    kind: &str,
    bound: Bound,
    refuse: impl FnOnce(&[u8]) -> Result<(), FrameProblem>,
) -> Result<Vec<u8>, FrameProblem> {
    let mut file = files::open_bounded(path, bound)?;
    let (head, size) = (files::peek(&file)?, file.metadata().map_err(FrameProblem::from)?.len());
    match head::most_bytes(kind, &head)? {
        Some(most) if size > most => {
            let found = format!("{size} bytes, of which the head describes {most} at most");
            return Err(FrameProblem::content("the file's end", found, "save the picture again"));
        }
        // No more than the head is needed to refuse it.
        None if size > head.len() as u64 => refuse(&head)?,
        _ => {}
    }
    Ok(files::read_open(&mut file, bound)?)
}

fn checked(mut raw: RawFrame, rule: &FrameRule) -> Result<(DepthFrame, Option<Vec<u32>>), FrameProblem> {
    let is_return = |depth: f32| depth.is_finite() && depth > 0.0;
    if !raw.depth.iter().copied().any(is_return) {
        return Err(FrameProblem::Empty);
    }
    let (width, height) = (raw.width, raw.height);
    let [fx, fy, cx, cy] = match (raw.intrinsics, &rule.camera) {
        (Some(intrinsics), None) if !rule.is_range => intrinsics,
        (Some(_), _) => return Err(FrameProblem::CameraOfCloud),
        (None, Some(camera)) => camera.with_centres_at_half(),
        (None, None) => return Err(FrameProblem::NoIntrinsics),
    };
    let size = rule.camera.and_then(|camera| camera.image_size).unwrap_or([width, height]);
    if size != [width, height] {
        return Err(FrameProblem::OtherCameraSize { size, width, height });
    }
    let camera = Intrinsics { width, height, fx, fy, cx, cy, near: NEAR }.checked()?;
    // A comparison that is false for NaN.
    let is_inside = (0.0..=f64::from(width)).contains(&cx) && (0.0..=f64::from(height)).contains(&cy);
    if !is_inside {
        return Err(FrameProblem::OtherImageSize { cx, cy, width, height });
    }
    let distortion = rule.camera.map_or([0.0; 5], |camera| camera.distortion);
    if distortion != [0.0; 5] {
        raw.depth = rectified(&raw.depth, size, [fx, fy, cx, cy], distortion);
    }
    if rule.is_range {
        for (pixel, depth) in raw.depth.iter_mut().enumerate() {
            let (column, row) = (pixel % width as usize, pixel / width as usize);
            let ray = camera.unproject(column as f64 + 0.5, row as f64 + 0.5, 1.0);
            *depth = (f64::from(*depth) / ray.coords.norm()) as f32;
        }
    }
    if !raw.depth.iter().copied().any(is_return) {
        return Err(FrameProblem::Empty);
    }
    let depth: Vec<f32> = raw.depth.iter().map(|depth| if is_return(*depth) { *depth } else { f32::NAN }).collect();
    let mut returns: Vec<f32> = depth.iter().copied().filter(|depth| !depth.is_nan()).collect();
    let middle = returns.len() / 2;
    let median = f64::from(*returns.select_nth_unstable_by(middle, f32::total_cmp).1);
    let fits = |median: f64| (MEDIAN_RANGE[0]..=MEDIAN_RANGE[1]).contains(&median);
    if !fits(median) {
        let scale = COMMON_SCALES.iter().find(|scale| fits(median / rule.depth_scale * **scale));
        let remedy = scale.map_or("no common unit of depth would fit".to_owned(), |scale| {
            format!("in units of {scale} m it would fit")
        });
        return Err(FrameProblem::Median { median, remedy });
    }
    Ok((DepthFrame { camera, depth }, raw.labels))
}

#[cfg(test)]
mod tests;
