//! Datasets: MCAP shards, manifest, index, reader, verification.
//!
//! A dataset is a folder (docs/format.md specifies every byte):
//!
//! ```text
//! run.json       identity of the job that the folder belongs to; written first
//! shards/        completion-00003-of-00152-<16 hex digits of its BLAKE3>.mcap
//! index.parquet  one row per sample, kept or rejected; for other readers
//! assets.json    one row per object, and the refused meshes
//! splits.json    splits of the objects, where a product has them
//! rejects.jsonl  one line per rejected sample
//! job.toml       the resolved job
//! ...            files that only one product has
//! manifest.json  digests of all of these; written last
//! ```
//!
//! A set is a folder of datasets, with `set.json` next to them ([`SetTable`]).
//!
//! A shard verifies itself: it is done when the digest in its file name matches the content. [`begin_run`], [`scan_shards`] and
//! [`ShardWriter`] fill a folder, [`finish_dataset`] closes it. This module takes plain data: it does not depend on jobs, plans,
//! simulators or producers.

mod assets;
mod begin;
mod diff;
pub(crate) mod durable;
pub(crate) mod error;
mod finish;
mod folder;
mod index;
pub mod layout;
mod ledger;
mod manifest;
#[cfg(test)]
mod measure;
mod merkle;
mod new_folder;
mod object_facts;
mod pending;
mod reader;
mod roots;
mod seal;
mod set;
pub(crate) mod shard;
pub(crate) mod shard_file;
mod sizes;
mod subjects;
mod verify;

pub use assets::{AssetRow, AssetTable};
pub use begin::{Begun, abandon_run, begin_run};
pub use diff::{ChannelCounts, DatasetDifference, ObjectDifference, Reason, SampleCounts, diff, other_platform};
pub use durable::Temporary;
pub use error::DatasetError;
pub use finish::{DatasetHeader, finish_dataset};
pub use folder::{
    BadShard, DoneShard, RunMark, ShardScan, clear_away, listed_shards, read_mark, scan_shards, scan_some_shards,
    shards_folder,
};
pub use index::{Cell, ColumnKind, IndexColumn, IndexFormat, IndexWriter, index_columns};
pub use layout::ShardName;
pub use ledger::{Fate, Ledger, LedgerRow};
pub use manifest::{Counts, FileEntry, Manifest, ShardEntry, without_manifest};
pub use new_folder::NewFolder;
pub use object_facts::{InvalidObjectFacts, ObjectFacts, add_symmetries};
pub use pending::{Pending, clear_pending, read_pending, write_pending};
pub use reader::{DatasetReader, Sample, Samples, Selection};
pub use set::{SetContent, SetEntry, SetObject, SetTable};
pub use shard::{CHUNK_BYTES, FinishedShard, ShardHeader, ShardWriter};
pub use sizes::TableSizes;
pub use verify::{Problem, VerifyLevel, VerifyOptions, VerifyProgress, VerifyReport, verify};
