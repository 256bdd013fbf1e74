//! Paths and folders that a user names on the command line, and how they are printed.

use std::{
    io,
    path::{self, Component, Path, PathBuf},
};

use clap::builder::{PathBufValueParser, TypedValueParser};
use kernel::{
    files::{self, Folder},
    words::Show,
};

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

/// A folder that is read: links in its path are followed, links inside it are not.
pub fn folder() -> impl TypedValueParser<Value = Folder> {
    PathBufValueParser::new().map(Folder::at)
}

/// A folder that is written to, of this machine's file systems.
pub fn local_folder() -> impl TypedValueParser<Value = Folder> {
    local_path().map(Folder::at)
}

/// A path from the root, without `..` where the folder before it is not a link.
pub fn absolute(path: &Path) -> io::Result<PathBuf> {
    let mut absolute = PathBuf::new();
    for component in path::absolute(path)?.components() {
        // The folder above a link's target is not the folder that holds the link.
        if component == Component::ParentDir && !files::is_link(&absolute) {
            absolute.pop();
        } else {
            absolute.push(component);
        }
    }
    Ok(absolute)
}

/// A path as a shell takes it: quoted where it holds anything but letters, digits and `/._-+=:@,`.
pub fn in_shell(path: &Path) -> String {
    let text = path.shown().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+=:@,".contains(letter);
    if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}
