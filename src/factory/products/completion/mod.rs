//! Shape-completion pairs: a partial and a complete occupancy grid of one view (thesis ch. 5).
//!
//! [`CompletionWorker`] is the producer of one thread: it loads an object, then makes its views one by one, and reuses all of
//! its memory. The chain of a view: pose (`scene`) -> depth (raster or MuJoCo) -> occluder (`occlusion`) -> sensor -> grid placement -> partial
//! -> complete (all three in `pair`, which other products of pairs share) -> gate -> records (`encode`): the pair, channels beside
//! it, touch (`pair::touch`).

mod check;
mod check_occlusion;
mod depth;
mod encode;
mod keys;
mod object;
mod occlusion;
mod row;
mod scene;
mod settings;
pub mod spec;
mod spec_occlusion;
mod work;
mod worker;

pub use encode::channels_of;
pub use row::FACTORY;
pub use scene::{camera_from_world, world_from_object};
pub use settings::{CompletionJob, CompletionSettings, Distance, Gate, Pivot, Renderer, SceneCamera};
pub use worker::{CompletionWorker, RejectReason};
