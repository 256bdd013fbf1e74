//! Readers of bytes from outside, one target each: none may panic, hang, or take memory beyond a bound, whatever the
//! bytes. The fuzzer feeds them (`make fuzz`); `tests/integrity/fuzz_corpus.rs` replays the kept inputs without it.

mod dataset;
mod inputs;
mod mcap;
mod pictures;
mod records;

pub use dataset::channels;
pub use mcap::{Chunk, ShardParts, parts, record};
pub use records::count_records;

/// Takes one input.
pub type Target = fn(&[u8]);

/// Every target, by name: that of its folder in `fuzz/corpus`.
pub const TARGETS: [(&str, Target); 14] = [
    ("arrangement", inputs::arrangement),
    ("beside", dataset::beside),
    ("binvox", inputs::binvox),
    ("camera", pictures::camera),
    ("description", inputs::description),
    ("hand", inputs::hand),
    ("job", inputs::job),
    ("mesh", inputs::mesh),
    ("model", pictures::model),
    ("picture", pictures::picture),
    ("records", records::records),
    ("shard", dataset::shard),
    ("shard_content", dataset::shard_content),
    ("tables", dataset::tables),
];

/// Names of the tables, by the first byte of an input of the target `tables`.
pub use dataset::TABLES;
/// Files of arrangements, by the first byte of an input of the target `arrangement`, and endings of mesh files, by that of
/// `mesh`.
pub use inputs::{ARRANGEMENTS, MESHES};
/// Files that `complete` reads, by the first byte of an input of the targets `camera`, `model` and `picture`.
pub use pictures::{CAMERAS, MODELS, PICTURES};
