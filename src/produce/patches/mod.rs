//! Patches of images around the palm and the fingertips of grasps (thesis ch. 4): a second stage, of a dataset of grasps.
//!
//! [`PatchWorker`] is one thread's workshop: it loads an object's mesh and looks at its grasps one by one, each along its own
//! approach ([`camera_from_object`]). Depth is the raster's, class `exact`; colours are MuJoCo's.

#[cfg(feature = "sim")]
mod colour;
mod hand;
mod heat;
mod look;
mod worker;

#[cfg(feature = "sim")]
pub use colour::check_colours;
pub use hand::PatchHand;
pub use look::{camera_from_object, corner};
pub use worker::{MeshReader, PatchWorker};

/// Whether colours can be drawn here.
///
/// # Errors
/// Always: this build has no simulator.
#[cfg(not(feature = "sim"))]
pub fn check_colours() -> Result<(), crate::produce::ProduceError> {
    let why = "this build has no simulator to draw with (feature `sim`); render.colour = false does without".to_owned();
    Err(crate::produce::ProduceError::NoColour { why })
}
