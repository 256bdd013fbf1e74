//! All files of a folder, to compare.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

/// The files below a folder with their content, by their paths inside it.
pub fn tree(folder: impl AsRef<Path>) -> BTreeMap<PathBuf, Vec<u8>> {
    let folder = folder.as_ref();
    let (mut files, mut folders) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(below) = folders.pop() {
        for entry in fs::read_dir(&below).expect("a folder") {
            let path = entry.expect("an entry").path();
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
