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
//! simulators or producers. The room `storage` holds the shards and tables themselves.

mod diff;
mod finish;
#[cfg(test)]
mod measure;
mod pending;
mod sizes;
mod verify;

pub use crate::storage::{
    AssetRow, AssetTable, BadShard, Begun, CHUNK_BYTES, Cell, ColumnKind, Counts, DatasetError, DatasetReader,
    DoneShard, Fate, FileEntry, FinishedShard, IndexColumn, IndexFormat, IndexWriter, InvalidObjectFacts, Ledger,
    LedgerRow, Manifest, NewFolder, ObjectFacts, RunMark, Sample, Samples, Selection, SetContent, SetEntry, SetObject,
    SetTable, ShardEntry, ShardHeader, ShardName, ShardScan, ShardWriter, TemporaryFile, abandon_run, add_symmetries,
    begin_run, clear_away, index_columns, layout, listed_shards, read_mark, scan_shards, scan_some_shards,
    shards_folder, without_manifest,
};
pub use diff::{ChannelCounts, DatasetDifference, ObjectDifference, Reason, SampleCounts, diff, other_platform};
pub use finish::{DatasetHeader, finish_dataset};
pub use pending::{Pending, clear_pending, read_pending, write_pending};
pub use sizes::TableSizes;
pub use verify::{Problem, VerifyLevel, VerifyOptions, VerifyProgress, VerifyReport, verify};
