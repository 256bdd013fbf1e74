//! Patches of images around the palm and the fingertips of grasps (thesis ch. 4): a second stage, about a dataset of grasps.
//!
//! [`PatchWorker`] is the producer of one thread: it loads an object's mesh and renders its grasps one by one, each along
//! its own approach ([`camera_from_object`]). Depth is the raster's, class `exact`; colours are MuJoCo's.

mod check;
mod colour;
mod grasps_reader;
mod hand;
mod heat;
mod keys;
mod marks;
mod resample;
mod row;
mod settings;
pub mod spec;
mod tabletop;
mod viewpoint;
mod work;
mod worker;

pub use grasps_reader::{InvalidGrasps, WantedGrasps, read_grasps};
pub use hand::{Fingertips, NoFingertip, PALM, PatchHand};
pub use resample::area_mean;
pub use row::FACTORY;
pub use settings::{
    ChosenGrasp, FoundGrasps, GraspTable, GraspTrialEnd, GraspedObject, PatchJob, PatchLabel, PatchSettings,
};
pub use viewpoint::{camera_from_object, camera_over_table, corner};
pub use worker::PatchWorker;
