//! The scheduler: threads, resume, regeneration, progress.
//!
//! A run fills a folder with the shards of a plan, each made by one thread from its first sample to its last, and closes
//! the dataset when all are there. Nothing but the finished shard files says what is done, so a run that was stopped,
//! killed or started twice goes on from them. Threads decide only who makes which shard, never what stands in it.

mod assets;
mod event;
mod execute;
mod preview;
mod regenerate;
mod shapes;
mod tables;
mod workshop;

pub use assets::{PreparedAssets, prepare_assets};
pub use event::{Cancel, Event, Listener, Progress};
pub use execute::{Crew, PilotRate, RunError, RunSummary, RunTask, ShareSummary, merge, pilot, run, run_share};
pub use preview::{grasp_preview, map_preview, patch_preview, preview};
pub use regenerate::{Difference, Regeneration, regenerate};
pub use tables::dataset_header;
