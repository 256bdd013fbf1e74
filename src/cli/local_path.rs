//! Paths that the program writes to, and how it prints them.

use std::{
    io,
    path::{self, Component, Path, PathBuf},
};

use clap::builder::{PathBufValueParser, TypedValueParser};

/// A path of this machine's file systems: an address of object storage would become a folder of that name.
pub fn local_path() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        let text = path.to_string_lossy();
        match text.split_once("://") {
            Some((scheme, _)) if !scheme.is_empty() && scheme.chars().all(|letter| letter.is_ascii_alphanumeric()) => {
                Err(format!("graspmill writes to file systems, not to {scheme}: give a folder, and copy it afterwards"))
            }
            _ => Ok(path),
        }
    })
}

/// A path from the root, without `..` where the folder before it is not a link.
pub fn absolute(path: &Path) -> io::Result<PathBuf> {
    let mut absolute = PathBuf::new();
    for component in path::absolute(path)?.components() {
        // The folder above a link's target is not the folder that holds the link.
        if component == Component::ParentDir && !absolute.is_symlink() {
            absolute.pop();
        } else {
            absolute.push(component);
        }
    }
    Ok(absolute)
}

/// A path as a shell takes it: quoted where it holds anything but letters, digits and `/._-+=:@,`.
pub fn in_shell(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+=:@,".contains(letter);
    if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}
