//! Reading depth pictures: PNG of 16 bits, NPY, and organised clouds as PCD or PLY.

mod head;
mod lzf;
mod mask;
mod median;
mod npy;
mod organised;
mod pcd;
mod picture;
mod ply;
mod raw;
mod scalar;

use std::path::{Path, PathBuf};

use kernel::{
    files::{self, Bound},
    geom::Intrinsics,
    ids::Digest,
    words::Show,
};

use crate::{
    camera::{CameraDescription, is_depth_scale},
    frame::{DepthFrame, LabelledFrame},
    rectification::Rectification,
};

pub use mask::read_mask;
use median::check_median;
use organised::depths_and_camera;
pub use raw::FrameProblem;
use raw::{Cloud, Image, Values};

/// Default metres per unit of integers.
const MILLIMETRE: f64 = 0.001;
/// Nothing nearer is seen [m].
const NEAR: f64 = 0.01;

/// Camera and unit by which a picture's numbers are read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameRule {
    /// The camera of an image; that of a cloud is found from its points.
    pub camera: Option<CameraDescription>,
    /// Metres per unit of the file. Without it, whole numbers are in the unit of the camera's description, or else in millimetres,
    /// and floats and points of clouds in metres.
    pub depth_scale: Option<f64>,
    /// Whether an image holds distances from the camera's centre, and not along its axis.
    pub is_range: bool,
    /// Whether a cloud looks along -z with y up (OpenGL's axes): y and z are mirrored.
    pub is_flipped: bool,
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
    if let Some(scale) = rule.depth_scale.filter(|scale| !is_depth_scale(*scale)) {
        return Err(failed(FrameProblem::Scale(scale)));
    }
    let bytes = judged_bytes(path, &kind, Bound::PICTURE, |head| parse(&kind, head).map(drop)).map_err(failed)?;
    let read = parse(&kind, &bytes).and_then(|raw| match raw {
        Raw::Image(image) => Ok((frame_of_image(&image, rule)?, None)),
        Raw::Cloud(cloud) => frame_of_cloud(cloud, rule),
    });
    let (frame, labels) = read.map_err(failed)?;
    Ok(LabelledFrame { frame, labels, digest: Digest::hash(&bytes) })
}

/// Content of a file, before the camera and the unit are applied.
enum Raw {
    Image(Image),
    Cloud(Cloud),
}

fn parse(kind: &str, bytes: &[u8]) -> Result<Raw, FrameProblem> {
    match kind {
        "png" => picture::parse(bytes).map(Raw::Image),
        "npy" => npy::parse(bytes).map(Raw::Image),
        "pcd" => pcd::parse(bytes).map(Raw::Cloud),
        _ => ply::parse(bytes).map(Raw::Cloud),
    }
}

/// The bytes of a picture, read only if its header is acceptable; `refuse` reads only a header.
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

/// The picture of an image, its distortion undone.
fn frame_of_image(image: &Image, rule: &FrameRule) -> Result<DepthFrame, FrameProblem> {
    if rule.is_flipped {
        return Err(FrameProblem::FlipOfImage);
    }
    let scale = match image.values {
        Values::Whole(_) => {
            rule.depth_scale.or(rule.camera.and_then(|camera| camera.depth_scale)).unwrap_or(MILLIMETRE)
        }
        Values::Real(_) => rule.depth_scale.unwrap_or(1.0),
    };
    let measured = depths_of(&image.values, scale);
    if !measured.iter().any(|depth| *depth > 0.0) {
        return Err(match range_of(measured.iter().copied().map(f64::from)) {
            Some(range) => FrameProblem::Behind { range, remedy: "save the depths with the other sign" },
            None => FrameProblem::Empty,
        });
    }
    let Some(description) = rule.camera else { return Err(FrameProblem::NoIntrinsics) };
    let camera = camera_of(image.width, image.height, description.with_centres_at_half(), description.image_size)?;
    let rectification = (!description.distortion.is_none()).then(|| {
        let (size, numbers) = ([image.width, image.height], description.with_centres_at_half());
        Rectification::new(&measured, size, numbers, description.distortion)
    });
    let mut depth = rectification.as_ref().map_or(measured, Rectification::rectified);
    if rule.is_range {
        // A distance from the centre is the depth times the length of the ray through (x, y, 1).
        for (pixel, depth) in (0..).zip(&mut depth) {
            let (column, row) = (pixel % image.width, pixel / image.width);
            let ray = camera.unproject(f64::from(column) + 0.5, f64::from(row) + 0.5, 1.0);
            *depth = (f64::from(*depth) / ray.coords.norm()) as f32;
        }
    }
    // What is negative is no return either.
    depth.iter_mut().filter(|depth| **depth <= 0.0).for_each(|depth| *depth = f32::NAN);
    check_median(&depth, scale)?;
    Ok(DepthFrame { camera, depth, rectification })
}

/// The picture of an organised cloud, and its labels.
fn frame_of_cloud(mut cloud: Cloud, rule: &FrameRule) -> Result<(DepthFrame, Option<Vec<u32>>), FrameProblem> {
    if rule.camera.is_some() || rule.is_range {
        return Err(FrameProblem::CameraOfCloud);
    }
    let scale = rule.depth_scale.unwrap_or(1.0);
    let signs = if rule.is_flipped { [1.0, -1.0, -1.0] } else { [1.0; 3] };
    for point in &mut cloud.points {
        point.iter_mut().zip(signs).for_each(|(value, sign)| *value *= scale * sign);
    }
    let depths = || cloud.points.iter().map(|point| point[2]).filter(|depth| depth.is_finite());
    if !depths().any(|depth| depth > 0.0) {
        let Some(range) = range_of(depths()) else { return Err(FrameProblem::Empty) };
        let remedy = if rule.is_flipped { FLIPPED_WRONGLY } else { remedy_of_flip(cloud) };
        return Err(FrameProblem::Behind { range, remedy });
    }
    let (depth, numbers) = depths_and_camera(&cloud)?;
    // The points determine the camera, also where they are a part of a larger picture.
    let camera = camera_of(cloud.width, cloud.height, numbers, Some([cloud.width, cloud.height]))?;
    check_median(&depth, scale)?;
    Ok((DepthFrame::new(camera, depth), cloud.labels))
}

const FLIPPED_WRONGLY: &str = "leave --flip out";

/// The remedy for a cloud behind the camera: mirrored axes where they make a camera's picture of it.
fn remedy_of_flip(mut cloud: Cloud) -> &'static str {
    cloud.points.iter_mut().for_each(|[_, y, z]| (*y, *z) = (-*y, -*z));
    match depths_and_camera(&cloud) {
        Ok(_) => "give --flip where y is up and the camera looks along -z, as in OpenGL",
        Err(_) => "give the cloud in the camera's own frame, each point at its pixel",
    }
}

/// A camera whose numbers belong to an image of this size. Where no size is stated, a principal point outside of the image is taken
/// for that of another size.
fn camera_of(
    width: u32,
    height: u32,
    [fx, fy, cx, cy]: [f64; 4],
    stated: Option<[u32; 2]>,
) -> Result<Intrinsics, FrameProblem> {
    if let Some(size) = stated.filter(|size| *size != [width, height]) {
        return Err(FrameProblem::OtherCameraSize { size, width, height });
    }
    let is_inside = (0.0..=f64::from(width)).contains(&cx) && (0.0..=f64::from(height)).contains(&cy);
    if stated.is_none() && !is_inside {
        return Err(FrameProblem::OtherImageSize { cx, cy, width, height });
    }
    Ok(Intrinsics { width, height, fx, fy, cx, cy, near: NEAR }.checked()?)
}

/// Numbers of a file in metres; 0, and the largest whole number, at which a sensor saturates, are no return.
fn depths_of(values: &Values, scale: f64) -> Vec<f32> {
    match values {
        Values::Whole(values) => values.iter().map(|value| depth_of_whole(*value, scale)).collect(),
        Values::Real(values) => values.iter().map(|value| depth_of_real(*value, scale)).collect(),
    }
}

fn depth_of_whole(value: u16, scale: f64) -> f32 {
    if value == 0 || value == u16::MAX { f32::NAN } else { (f64::from(value) * scale) as f32 }
}

fn depth_of_real(value: f32, scale: f64) -> f32 {
    let depth = (f64::from(value) * scale) as f32;
    if depth.is_finite() { depth } else { f32::NAN }
}

/// Smallest and largest of the negative depths; `None` without any.
fn range_of(depths: impl Iterator<Item = f64>) -> Option<[f64; 2]> {
    let below = depths.filter(|depth| *depth < 0.0);
    below.fold(None, |range: Option<[f64; 2]>, depth| {
        let [low, high] = range.unwrap_or([depth; 2]);
        Some([low.min(depth), high.max(depth)])
    })
}

#[cfg(test)]
mod tests;
