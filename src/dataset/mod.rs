//! Datasets: MCAP shards, manifest, index, reader, verification.
//!
//! A dataset is a folder (docs/format.md says every byte of it):
//!
//! ```text
//! run.json       what the folder was begun for; written first
//! shards/        completion-00003-of-00152-<16 hex digits of its BLAKE3>.mcap
//! index.parquet  one row a sample, kept or rejected
//! assets.json    one row an object, and the refused meshes
//! splits.json    who trains and who tests (completion, grasps, patches)
//! field.mcap     labels and signed distances of the whole grid (reachability)
//! shapes.mcap    the hand's shapes and the objects' meshes (grasps)
//! rejects.jsonl  one line a rejected sample
//! job.toml       the resolved job
//! manifest.json  digests of all of these; written last
//! ```
//!
//! A set is a folder of datasets, with `set.json` beside them ([`SetTable`]).
//!
//! A shard proves itself: it is done when a file of its name has the content that the name says. [`begin_run`],
//! [`scan_shards`] and [`ShardWriter`] fill a folder, [`finish_dataset`] closes it. This room takes plain data: it
//! knows no job, plan, simulator or producer.

mod assets;
mod diff;
mod durable;
mod error;
mod field;
mod finish;
mod folder;
mod grasp_preview;
mod index;
mod index_file;
pub mod layout;
mod ledger;
mod manifest;
mod map_preview;
#[cfg(test)]
mod measure;
mod merkle;
mod new_folder;
mod pair_table;
mod patch_preview;
mod patch_sample;
mod pending;
mod preview;
mod reader;
mod roots;
mod seal;
mod set;
mod shapes;
mod shard;
mod shard_file;
mod split;
mod verify;

pub use assets::{AssetRow, AssetTable};
pub use diff::{ChannelCounts, DatasetDifference, ObjectDifference, Reason, SampleCounts, diff};
pub use error::DatasetError;
pub use field::read_field;
pub use finish::{DatasetHeader, ProductTables, finish_dataset};
pub use folder::{
    BadShard, Begun, DoneShard, RunMark, ShardScan, begin_run, clear_away, listed_shards, read_mark, scan_shards,
    scan_some_shards, shards_folder,
};
pub use grasp_preview::write_grasp_preview;
pub use index::{ColumnKind, IndexColumn, index_columns};
pub use layout::ShardName;
pub use ledger::{Fate, Ledger, LedgerRow};
pub use manifest::{
    Counts, FileEntry, GraspCounts, Manifest, NumberClass, PoseCounts, ShardEntry, TrialCounts, TypeCounts,
};
pub use map_preview::write_map_preview;
pub use new_folder::NewFolder;
pub use pair_table::{PairRow, PairTableWriter};
pub use patch_preview::write_patch_preview;
pub use pending::{Pending, clear_pending, read_pending, write_pending};
pub use preview::{PreviewSample, preview_samples, write_preview};
pub use reader::{DatasetReader, Sample, Samples, Selection, TouchedPair};
pub use set::{SetContent, SetEntry, SetObject, SetTable};
pub use shapes::{Shapes, ShapesWriter};
pub use shard::{CHUNK_BYTES, FinishedShard, ShardHeader, ShardWriter};
pub use split::{ObjectSplit, Split, SplitTable};
pub use verify::{Problem, VerifyLevel, VerifyOptions, VerifyProgress, VerifyReport, verify};
