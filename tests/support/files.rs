//! Reading, listing and damaging files.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    files::Folder,
    format::{
        PARTIAL_INSIDE_COMPLETE,
        dataset::{VerifyLevel, VerifyOptions, verify},
    },
    ids::Digest,
    tables::ParquetIndex,
};
use serde_json::Value;

/// The repository's root, which is the working folder of the tests as well.
pub const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A file of the repository, by its path from the root.
pub fn repository_path(path: impl AsRef<Path>) -> PathBuf {
    Path::new(ROOT).join(path)
}

/// The name of a file without its ending.
pub fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

#[track_caller]
pub fn read_text(path: impl AsRef<Path>) -> String {
    let path = path.as_ref();
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

#[track_caller]
pub fn read_json(path: impl AsRef<Path>) -> Value {
    let path = path.as_ref();
    serde_json::from_str(&read_text(path)).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The number at a pointer such as `/counts/kept`.
#[track_caller]
pub fn number_at(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("{pointer} of {value}"))
}

/// The files below a folder with their content, by their paths inside it.
#[track_caller]
pub fn read_tree(folder: impl AsRef<Path>) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = folder.as_ref();
    let (mut files, mut folders) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(below) = folders.pop() {
        for name in list_names(&below) {
            let path = below.join(name);
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).expect("inside").to_owned();
                files.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    files
}

/// Checks everything that can be checked of a dataset without making its samples again, but for the rules of its job.
pub const FULL_CHECK: VerifyOptions =
    VerifyOptions { level: VerifyLevel::Full, rules: &[], index: Some(&ParquetIndex), threads: 2 };

/// [`FULL_CHECK`] of a dataset whose partial cells lie in complete ones.
pub const CHECK_INSIDE: VerifyOptions = VerifyOptions { rules: &[PARTIAL_INSIDE_COMPLETE], ..FULL_CHECK };

/// Verifies a dataset whole.
#[track_caller]
pub fn assert_intact(folder: impl AsRef<Path>, options: VerifyOptions) {
    let report = verify(&Folder::at(folder.as_ref()), options, |_| ()).expect("readable");
    assert!(report.is_intact(), "{:?}", report.problems);
}

/// Digests of the files of a dataset by their paths, without the notes of its run, which contain times.
#[track_caller]
pub fn digest_dataset(folder: impl AsRef<Path>) -> BTreeMap<PathBuf, Digest> {
    let mut files = read_tree(folder);
    files.remove(Path::new("notes.json"));
    files.into_iter().map(|(path, content)| (path, Digest::hash(&content))).collect()
}

/// The names in a folder, sorted.
#[track_caller]
pub fn list_names(folder: impl AsRef<Path>) -> Vec<String> {
    let folder = folder.as_ref();
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut names: Vec<String> =
        entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8")).collect();
    names.sort();
    names
}

/// Copies a folder with its content.
#[track_caller]
pub fn copy_folder(from: impl AsRef<Path>, to: impl AsRef<Path>) {
    let (from, to) = (from.as_ref(), to.as_ref());
    fs::create_dir_all(to).unwrap_or_else(|error| panic!("{}: {error}", to.display()));
    for name in list_names(from) {
        let (from, to) = (from.join(&name), to.join(&name));
        if from.is_dir() { copy_folder(&from, &to) } else { _ = fs::copy(&from, &to).expect("a copy") }
    }
}

/// The paths of a dataset's shards, sorted.
#[track_caller]
pub fn list_shards(dataset: impl AsRef<Path>) -> Vec<PathBuf> {
    let folder = dataset.as_ref().join("shards");
    list_names(&folder).into_iter().map(|name| folder.join(name)).collect()
}

/// Damages a file: one bit in its middle.
#[track_caller]
pub fn flip_bit(path: impl AsRef<Path>) {
    let path = path.as_ref();
    let mut bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(path, bytes).expect("written");
}
