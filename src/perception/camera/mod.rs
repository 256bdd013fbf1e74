//! Cameras as calibrations state them: four numbers, or a file of ours, of Open3D or of ROS.

mod description;
mod json;
mod problem;
mod read;
mod rectify;
#[cfg(test)]
mod tests;
mod yaml;

pub use description::{CENTRE_AT_HALF, CENTRE_AT_ZERO, CameraDescription};
pub use problem::{CameraError, CameraProblem};
pub(crate) use rectify::rectified;
