//! Patches of images around the palm and the fingertips of grasps (thesis ch. 4): a second stage, of a dataset of grasps.
//!
//! [`PatchWorker`] is one thread's workshop: it loads an object's mesh and looks at its grasps one by one, each along its own
//! approach ([`camera_from_object`]). Depth is the raster's, class `exact`; colours are MuJoCo's.

mod hand;
mod look;
mod worker;

pub use hand::PatchHand;
pub use look::{camera_from_object, corner};
pub use worker::{MeshReader, PatchWorker};
