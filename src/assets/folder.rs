//! Mesh files of a folder, their names, and which are copies.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::{AssetRecord, read::is_mesh_name};
use kernel::{files, remedy};

/// A folder that cannot be listed.
#[derive(Debug, thiserror::Error)]
#[error("{folder}: cannot be listed ({error}); {}", remedy::for_reading(error))]
pub struct FolderError {
    /// The folder.
    pub folder: PathBuf,
    /// Why.
    #[source]
    pub error: std::io::Error,
}

/// The mesh files below a folder, sorted by path: `.stl`, `.obj`, `.ply`, `.off` in any case, and `.glb`, `.gltf`, `.dae`,
/// `.3mf`, so that those are refused by name instead of overlooked.
///
/// Files and folders whose names start with a dot are skipped; links to files are followed, links to folders are not.
///
/// # Errors
/// When the folder, or one below it, cannot be read.
pub fn list_folder(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        let fail = |error| FolderError { folder: current.clone(), error };
        for (path, is_folder) in files::list(&current).map_err(fail)? {
            if path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b".")) {
                continue;
            }
            if is_folder {
                folders.push(path);
            } else if is_mesh_name(&path) && files::is_file(&path) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// A mesh that is a copy of another one.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct DuplicateOf {
    /// Index of the copy in the list.
    pub index: usize,
    /// Index of the first mesh with that geometry.
    pub of: usize,
}

/// Meshes with the same geometry as an earlier one in the list, with any name and order of faces.
pub fn duplicates<'a>(records: impl IntoIterator<Item = &'a AssetRecord>) -> Vec<DuplicateOf> {
    let mut first = BTreeMap::new();
    let find = |(index, record): (usize, &AssetRecord)| match *first.entry(record.geometry).or_insert(index) {
        of if of == index => None,
        of => Some(DuplicateOf { index, of }),
    };
    records.into_iter().enumerate().filter_map(find).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_listing_is_sorted_and_holds_every_mesh_below() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("b/.hidden")).unwrap();
        for name in ["mug.stl", "mug.OBJ", "b/mug.ply", "b/bowl.glb", "b/.hidden/x.stl", "notes.txt", "Müll 1.off"] {
            std::fs::write(root.join(name), "").unwrap();
        }
        let found = list_folder(root).unwrap();
        let wanted = ["Müll 1.off", "b/bowl.glb", "b/mug.ply", "mug.OBJ", "mug.stl"];
        assert_eq!(found, wanted.map(|name| root.join(name)));
        assert!(list_folder(&root.join("none")).is_err());
    }
}
