//! Files of datasets: shards, ledgers, manifests and tables, as they are begun, written and read.
//!
//! This room takes plain data: it knows no job, plan, simulator or producer, and of products their rows alone.

mod assets;
mod begin;
pub(crate) mod durable;
pub(crate) mod error;
pub(crate) mod folder;
pub(crate) mod index;
pub mod layout;
mod ledger;
mod manifest;
mod merkle;
mod new_folder;
mod object_facts;
pub(crate) mod reader;
pub(crate) mod roots;
pub(crate) mod seal;
mod set;
pub(crate) mod shard;
pub(crate) mod shard_file;
pub(crate) mod subjects;

pub use assets::{AssetRow, AssetTable};
pub use begin::{Begun, abandon_run, begin_run};
pub use durable::TemporaryFile;
pub use error::DatasetError;
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
pub use reader::{DatasetReader, Sample, Samples, Selection};
pub use set::{SetContent, SetEntry, SetObject, SetTable};
pub use shard::{CHUNK_BYTES, FinishedShard, ShardHeader, ShardWriter};
