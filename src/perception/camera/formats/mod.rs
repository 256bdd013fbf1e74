//! Kinds of camera files: each makes a [`super::CameraDescription`] of its statements.

mod bop;
mod entry;
mod fields;
mod kalibr;
mod open3d;
mod own;
mod realsense;
mod ros;

pub(super) use entry::{Entry, entries};
pub use ros::RosImage;
