//! Volumes: truncated signed distances fused from the depth images of settled scenes, a stage behind views, about a dataset of them.
//!
//! [`VolumeWorker`] is the producer of one thread: it draws which images of a scene are fused, fuses them
//! ([`kernel::voxel::VolumeFusion`]) and finds the body at the centre of every voxel (`scene`). Views contain depth,
//! cameras, poses and meshes, so that nothing else is read except picks where the job names some: the grasps in the
//! cube (`grasps`). All of it is of class `exact`.

mod check;
mod grasps;
mod images;
mod keys;
mod row;
mod scene;
mod settings;
pub mod spec;
mod work;
mod worker;

pub use row::FACTORY;
pub use settings::{VolumeGrasps, VolumeJob, VolumeSettings};
pub use worker::VolumeWorker;
