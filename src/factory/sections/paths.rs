//! Paths in job files: relative to the file, with `/`, and as short as they can be.

use std::path::{Component, Path, PathBuf, absolute};

/// Without `a/..`, so that messages and resolved jobs show the shortest path.
pub fn tidy(path: &Path) -> PathBuf {
    let mut tidy = PathBuf::new();
    for part in path.components() {
        match (part, tidy.components().next_back()) {
            (Component::CurDir, _) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                tidy.pop();
            }
            _ => tidy.push(part),
        }
    }
    if tidy.as_os_str().is_empty() { PathBuf::from(".") } else { tidy }
}

/// With `/` between its parts on every system.
pub fn with_slashes(path: &Path) -> String {
    let parts: Vec<String> = path.components().map(|part| part.as_os_str().to_string_lossy().into_owned()).collect();
    parts.join("/")
}

/// The path from a folder to a file. Links are not followed: the file system is not accessed.
pub fn relative_to(path: &Path, folder: &Path) -> PathBuf {
    let whole = |path: &Path| absolute(path).map_or_else(|_| path.to_owned(), |path| tidy(&path));
    let (path, folder) = (whole(path), whole(folder));
    let common = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(common).map(|_| Component::ParentDir);
    up.chain(path.components().skip(common)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_as_short_as_can_be() {
        assert_eq!(tidy(Path::new("jobs/../meshes/./mug.stl")), Path::new("meshes/mug.stl"));
        assert_eq!(tidy(Path::new("../meshes")), Path::new("../meshes"));
        assert_eq!(tidy(Path::new("jobs/..")), Path::new("."));
        assert_eq!(with_slashes(&relative_to(Path::new("a/b/mug.stl"), Path::new("a/c"))), "../b/mug.stl");
    }
}
