//! The files of a dataset that somebody else made.

use std::{fs, path::Path, sync::LazyLock};

use graspmill::{
    files::Folder,
    format::{
        Channel, PARTIAL_INSIDE_COMPLETE, Product,
        dataset::{DatasetReader, Manifest, Selection, SetTable, VerifyLevel, VerifyOptions, read_mark, verify},
        extras::{Shapes, read_field},
    },
    tables::ParquetIndex,
};

use super::{
    inputs::{repository_folder, scratch},
    mcap::{shard_of, with_checksums},
};

/// Every channel of every product, in the order of their numbers in inputs.
pub fn channels() -> impl Iterator<Item = Channel> {
    Product::all().flat_map(Product::channels)
}

/// Tables of a dataset, and of a set.
pub const TABLES: [&str; 7] =
    ["manifest.json", "assets.json", "splits.json", "rejects.jsonl", "run.json", "set.json", "job.toml"];

/// A copy of the small dataset.
struct Copy(tempfile::TempDir);

impl Copy {
    fn new() -> Self {
        let (golden, copy) = (repository_folder("tests/golden/v4"), scratch());
        fs::create_dir(copy.path().join("shards")).expect("a folder");
        for folder in ["", "shards"] {
            for entry in fs::read_dir(golden.join(folder)).expect("files") {
                let path = entry.expect("a file").path();
                if path.is_file() {
                    let to = copy.path().join(folder).join(path.file_name().expect("a name"));
                    fs::copy(&path, to).expect("a copy");
                }
            }
        }
        Self(copy)
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    /// Verifies, and reads what can be read.
    fn read(&self, level: VerifyLevel) {
        // What has no manifest or no index is refused, and nothing more is read.
        let Ok(reader) = DatasetReader::open(&Folder::at(self.path())) else { return };
        let options =
            VerifyOptions { level, rules: &[PARTIAL_INSIDE_COMPLETE], index: Some(&ParquetIndex), threads: 1 };
        if let Ok(report) = verify(&Folder::at(self.path()), options, |_| {}) {
            for problem in &report.problems {
                assert!(!problem.to_string().is_empty());
            }
        }
        let _ = reader.assets();
        let _ = reader.job_text();
        if level == VerifyLevel::Hashes {
            return;
        }
        for sample in reader.shuffled(Selection::default(), 1) {
            let Ok(sample) = sample else { continue };
            let _ = reader.sample_of(&sample.id);
            let _ = sample.touched();
        }
    }
}

/// A table without its seal, which is valid too: no change would come past one.
fn unsealed(table: &[u8]) -> Vec<u8> {
    let seal = b",\n  \"seal\": \"";
    match table.windows(seal.len()).rposition(|window| window == seal) {
        Some(at) => [&table[..at], b"\n}\n"].concat(),
        None => table.to_vec(),
    }
}

/// A table that the first byte names, in place of the small dataset's.
pub fn tables(input: &[u8]) {
    static COPY: LazyLock<Copy> = LazyLock::new(Copy::new);
    let Some((table, bytes)) = input.split_first() else { return };
    let path = COPY.path().join(TABLES[usize::from(*table) % TABLES.len()]);
    let before = fs::read(&path).ok();
    fs::write(&path, unsealed(bytes)).expect("a file");
    COPY.read(VerifyLevel::Hashes);
    if let Err(error) = Manifest::read(&Folder::at(COPY.path())) {
        assert!(!error.to_string().is_empty());
    }
    let _ = (read_mark(&Folder::at(COPY.path())), SetTable::read(&Folder::at(COPY.path())));
    match before {
        Some(before) => fs::write(&path, before).expect("a file"),
        None => fs::remove_file(&path).expect("no file"),
    }
}

/// A whole shard in place of the small dataset's first, its checksums corrected.
pub fn shard(input: &[u8]) {
    put_shard(&with_checksums(input));
}

/// Ledger and messages in a well-formed shard.
pub fn shard_content(input: &[u8]) {
    let topics: Vec<&str> = channels().map(|channel| channel.topic).collect();
    if let Some(shard) = shard_of(input, &topics) {
        put_shard(&shard);
    }
}

fn put_shard(bytes: &[u8]) {
    static COPY: LazyLock<(Copy, serde_json::Value)> = LazyLock::new(|| {
        let copy = Copy::new();
        let text = fs::read(copy.path().join("manifest.json")).expect("a manifest");
        (copy, serde_json::from_slice(&text).expect("JSON"))
    });
    let (copy, manifest) = &*COPY;
    let mut manifest = manifest.clone();
    let entry = &mut manifest["shards"][0];
    // A reader holds the size against the manifest before it opens a shard.
    entry["bytes"] = bytes.len().into();
    let name = entry["file"].as_str().expect("a name").to_owned();
    fs::write(copy.path().join("shards").join(name), bytes).expect("a file");
    fs::write(copy.path().join("manifest.json"), manifest.to_string()).expect("a file");
    copy.read(VerifyLevel::Full);
}

/// `field.mcap` or `shapes.mcap`, selected by the first byte, checksums corrected.
pub fn beside(input: &[u8]) {
    static SCRATCH: LazyLock<tempfile::TempDir> = LazyLock::new(scratch);
    let Some((file, bytes)) = input.split_first() else { return };
    let bytes = with_checksums(bytes);
    if file.is_multiple_of(2) {
        fs::write(SCRATCH.path().join("field.mcap"), bytes).expect("a file");
        let _ = read_field(&Folder::at(SCRATCH.path()));
        return;
    }
    fs::write(SCRATCH.path().join("shapes.mcap"), bytes).expect("a file");
    let Ok(shapes) = Shapes::open(&Folder::at(SCRATCH.path())) else { return };
    let _ = (shapes.hand(), shapes.trial_hand());
    for index in 0..shapes.objects() {
        let _ = shapes.object(index);
    }
}
