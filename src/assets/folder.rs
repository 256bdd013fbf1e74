//! Which mesh files a folder holds, what they are called, and which are copies.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{AssetRecord, read::is_mesh_name};

/// A folder that cannot be listed.
#[derive(Debug, thiserror::Error)]
#[error("{folder}: cannot be listed ({error}); check the path and its permissions")]
pub struct FolderError {
    /// The folder.
    pub folder: PathBuf,
    /// Why.
    #[source]
    pub error: std::io::Error,
}

/// The mesh files of a folder (`.stl`, `.obj`, `.ply`, `.off`, in any case), sorted by path.
///
/// A file is listed when it fits one of `include` (or `include` is empty) and none of `exclude`. A pattern without `/`
/// is held against the file's name, one with `/` against its path below the folder: `*` and `?` stand for any
/// characters but `/`, `**` for any at all. A pattern in `include` that names an extension (`*.glb`) also lists files in formats that are
/// not read, so that they are refused by name instead of overlooked. Files and folders whose names start with a dot
/// are skipped; links are followed, but not to folders.
///
/// # Errors
/// When the folder, or one below it, cannot be read.
pub fn list_folder(
    folder: &Path,
    include: &[String],
    exclude: &[String],
    recursive: bool,
) -> Result<Vec<PathBuf>, FolderError> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(current) = folders.pop() {
        let fail = |error| FolderError { folder: current.clone(), error };
        for entry in std::fs::read_dir(&current).map_err(fail)? {
            let entry = entry.map_err(fail)?;
            let path = entry.path();
            if entry.file_name().as_encoded_bytes().starts_with(b".") {
                continue;
            }
            if entry.file_type().map_err(fail)?.is_dir() {
                if recursive {
                    folders.push(path);
                }
                continue;
            }
            let fits = |pattern: &String| fits(pattern, &below(folder, &path));
            let wanted = if include.is_empty() { is_mesh_name(&path) } else { include.iter().any(fits) };
            if wanted && !exclude.iter().any(fits) && path.is_file() {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Names for mesh files: the file's stem, or, where two files share one, the path below `folder` with its extension.
///
/// In the order of `paths`; parts are joined by `/` and bytes that are no UTF-8 become U+FFFD.
pub fn mesh_names(folder: &Path, paths: &[PathBuf]) -> Vec<String> {
    let stem = |path: &Path| path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let mut count = BTreeMap::new();
    for path in paths {
        *count.entry(stem(path)).or_insert(0) += 1;
    }
    paths.iter().map(|path| if count[&stem(path)] == 1 { stem(path) } else { below(folder, path) }).collect()
}

/// A mesh that is a copy of another one.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct DuplicateOf {
    /// Place of the copy in the list.
    pub index: usize,
    /// Place of the first mesh with that geometry.
    pub of: usize,
}

/// The meshes whose geometry stands earlier in the list already, whatever their names and the order of their faces.
pub fn duplicates<'a>(records: impl IntoIterator<Item = &'a AssetRecord>) -> Vec<DuplicateOf> {
    let mut first = BTreeMap::new();
    let find = |(index, record): (usize, &AssetRecord)| match *first.entry(record.geometry).or_insert(index) {
        of if of == index => None,
        of => Some(DuplicateOf { index, of }),
    };
    records.into_iter().enumerate().filter_map(find).collect()
}

/// A path below a folder, its parts joined by `/`.
fn below(folder: &Path, path: &Path) -> String {
    let relative = path.strip_prefix(folder).unwrap_or(path);
    relative.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

fn fits(pattern: &str, path: &str) -> bool {
    let held_against = if pattern.contains('/') { path } else { path.rsplit('/').next().unwrap_or(path) };
    matches(pattern.as_bytes(), held_against.as_bytes())
}

/// Glob matching with one point to return to per kind of star, so that it never takes exponential time.
fn matches(pattern: &[u8], text: &[u8]) -> bool {
    let (mut p, mut t) = (0, 0);
    // Where to go on, in pattern and text, when what follows a star does not fit.
    let mut star: Option<(usize, usize)> = None;
    let mut stars: Option<(usize, usize)> = None;
    loop {
        match pattern.get(p) {
            Some(b'*') if pattern.get(p + 1) == Some(&b'*') => {
                // `**/` also stands for no folder at all.
                p += if pattern.get(p + 2) == Some(&b'/') { 3 } else { 2 };
                (stars, star) = (Some((p, t)), None);
            }
            Some(b'*') => {
                p += 1;
                star = Some((p, t));
            }
            None if t == text.len() => return true,
            Some(&wanted) if text.get(t).is_some_and(|&c| c == wanted || wanted == b'?' && c != b'/') => {
                p += 1;
                t += 1;
            }
            _ => {
                let retry = star.filter(|&(_, at)| text.get(at).is_some_and(|&c| c != b'/'));
                if let Some((next, at)) = retry {
                    star = Some((next, at + 1));
                    (p, t) = (next, at + 1);
                } else if let Some((next, at)) = stars.filter(|&(_, at)| at < text.len()) {
                    (stars, star) = (Some((next, at + 1)), None);
                    (p, t) = (next, at + 1);
                } else {
                    return false;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns() {
        for (pattern, path, wanted) in [
            ("*.stl", "a/b/mug.stl", true),
            ("*.stl", "mug.obj", false),
            ("mug-??.*", "x/mug-01.ply", true),
            ("a/*.stl", "a/mug.stl", true),
            ("a/*.stl", "a/b/mug.stl", false),
            ("a/**/*.stl", "a/b/c/mug.stl", true),
            ("a/**/*.stl", "a/mug.stl", true),
            ("**/broken/*", "x/broken/mug.stl", true),
            ("**/broken/*", "broken/mug.stl", true),
            ("*a*b*c", "xaxbxbxc", true),
            ("*a*b*c", "xaxbxbxd", false),
            ("Tasse für *.ply", "Tasse für Jörg.ply", true),
        ] {
            assert_eq!(fits(pattern, path), wanted, "{pattern} {path}");
        }
    }

    #[test]
    fn listing_is_sorted_filtered_and_named_without_clashes() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("b/.hidden")).unwrap();
        for name in ["mug.stl", "mug.OBJ", "b/mug.ply", "b/bowl.off", "b/.hidden/x.stl", "notes.txt", "Müll 1.stl"] {
            std::fs::write(root.join(name), "").unwrap();
        }
        let list = |include: &[&str], exclude: &[&str], recursive| {
            let own = |patterns: &[&str]| patterns.iter().map(|pattern| (*pattern).to_owned()).collect::<Vec<_>>();
            let paths = list_folder(root, &own(include), &own(exclude), recursive).unwrap();
            mesh_names(root, &paths)
        };
        assert_eq!(list(&[], &[], true), ["Müll 1", "bowl", "b/mug.ply", "mug.OBJ", "mug.stl"]);
        assert_eq!(list(&[], &[], false), ["Müll 1", "mug.OBJ", "mug.stl"]);
        assert_eq!(list(&["*.stl"], &["M*"], true), ["mug"]);
        assert_eq!(list(&["*.txt"], &[], true), ["notes"]);
        assert!(list_folder(&root.join("none"), &[], &[], true).is_err());
    }
}
