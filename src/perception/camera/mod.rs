//! Cameras as calibrations state them: four numbers, or a file of one of the kinds of [`CameraFormat`].
//!
//! Syntax ([`json`], [`yaml`]) becomes statements, [`keys`] lists the supported ones, and [`formats`] interprets them.

mod description;
mod distortion;
mod formats;
mod json;
mod keys;
#[cfg(test)]
mod keys_tests;
mod problem;
mod read;
mod statement;
#[cfg(test)]
mod tests;
mod yaml;

pub(crate) use description::DEPTH_SCALES;
pub use description::{CENTRE_AT_HALF, CENTRE_AT_ZERO, CameraDescription, is_depth_scale};
pub use distortion::Distortion;
pub use formats::RosImage;
pub use keys::{CAMERA_KEYS, CameraFormat, CameraKey, KeyTreatment};
pub use problem::{CameraError, CameraProblem};
pub use read::CameraRule;
