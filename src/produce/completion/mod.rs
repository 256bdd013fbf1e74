//! Shape-completion pairs: a partial and a complete occupancy grid of one view (thesis ch. 5).
//!
//! [`CompletionWorker`] is one thread's workshop: it loads an object, then makes its views one by one, and reuses all of
//! its memory. The chain of a view: pose ([`scene`]) -> depth (raster or MuJoCo) -> sensor -> grid placement -> partial
//! -> complete -> gate -> records ([`payloads`]), among them touch ([`touch`]).

mod depth;
#[cfg(feature = "sim")]
mod feel;
mod payloads;
mod scene;
mod touch;
mod worker;

pub use payloads::channels_of;
pub use scene::{camera_from_world, world_from_object};
pub use touch::TouchSurface;
pub use worker::{CompletionWorker, RejectReason};
