//! From a depth picture to objects on a table, and to a network's input (thesis, section 4.3).
//!
//! [`read_frame`] reads a picture and [`SegmentedScene`] segments it: [`find_plane`] finds the support plane, and [`find_parts`]
//! the objects on it, also where they touch ([`find_clusters`] by distance alone); [`visible_sheet`] is the visible surface of an
//! object, and [`NetworkInput`] contains its grids. Every number is of class `exact`.

// Tests compare with what the C library computes.
#![cfg_attr(test, allow(clippy::disallowed_methods))]

mod camera;
mod clusters;
mod contact;
mod container;
mod cuboid;
mod frame;
mod input;
mod labels;
mod outline;
mod partition;
mod plane;
mod read;
mod rectification;
mod scene;
mod score;
mod sheet;

#[cfg(test)]
mod tests;

pub use camera::{
    CAMERA_KEYS, CENTRE_AT_HALF, CENTRE_AT_ZERO, CameraDescription, CameraError, CameraFormat, CameraKey,
    CameraProblem, CameraRule, Distortion, KeyTreatment, RosImage, is_depth_scale,
};
pub use clusters::{Cluster, ClusterRule, find_clusters};
pub use contact::{Outline, Support};
pub use container::{Container, ContainerChoice, Wall};
pub use cuboid::OrientedBox;
pub use frame::{DepthFrame, LabelledFrame};
pub use input::{InputError, NetworkInput, without_outliers};
pub use labels::{CONTAINER_LABEL, LabelExtent, LabelImage, MAX_OBJECTS, PLANE_LABEL};
pub use outline::{cluster_colour, draw_outlines, outline_pixels};
pub use partition::{PartitionRule, find_parts};
pub use plane::{Plane, PlaneRule, find_plane};
pub use read::{FrameError, FrameProblem, FrameRule, read_frame, read_mask};
pub use rectification::Rectification;
pub use scene::{PlaneChoice, Refusal, SceneRule, SegmentedScene};
pub use score::{ObjectScore, SegmentationScore};
pub use sheet::visible_sheet;
