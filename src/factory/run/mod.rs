//! The scheduler: threads, resume, regeneration, progress.
//!
//! A run fills a folder with the shards of a plan, each made by one thread from its first sample to its last, and
//! closes the dataset when all exist. Only the finished shard files record the progress, so a run that was stopped,
//! killed or started twice continues from them. A panic becomes an error that names the sample (`contain`). Threads
//! decide only who makes which shard, never its content.

mod assets;
mod contain;
mod estimate;
mod execute;
mod open;
mod pilot;
mod regenerate;

pub use self::assets::{PreparedAssets, prepare_assets};
pub use estimate::Estimate;
pub use execute::{RunSummary, RunTask, ShareSummary, merge, run, run_share};
pub(crate) use open::TWIN_LIKENESS;
pub use open::{OpenError, OpenJob};
pub use pilot::{PilotLimits, PilotRate, pilot};
pub use regenerate::{Difference, Regeneration, regenerate};
