//! Heatmaps: grasps of all bodies of settled scenes in the images of these scenes, a stage behind views and picks, about a dataset of
//! each.
//!
//! [`HeatmapWorker`] is the producer of one thread: it reads the grasps of a scene's bodies with the outcomes of their
//! trials (`picked`), renders each view of the scene again for its exact depth (`viewed`), and marks palm and
//! fingertips of the grasps that approach from about the camera's direction (`grasps`). Views contain cameras, poses
//! and meshes, and picks the closed hands, so that nothing else is read. All of it is of class `exact`: outcomes of
//! trials are read, nothing is stepped.

mod check;
mod grasps;
mod keys;
mod meshes;
mod row;
mod settings;
pub mod spec;
mod types;
mod work;
mod worker;

pub use row::FACTORY;
pub use settings::{HeatmapJob, HeatmapSettings};
pub use types::count_types;
pub use worker::HeatmapWorker;
