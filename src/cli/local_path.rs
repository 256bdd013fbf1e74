//! Paths and folders on the command line, and how they are printed.

use std::{
    io,
    path::{self, Component, Path, PathBuf},
};

use clap::builder::{PathBufValueParser, TypedValueParser};
use kernel::{
    files::{self, Folder},
    words::Show,
};

/// Parser of a path on this machine's file systems. It refuses addresses of object storage, which would become folders of that
/// name.
pub fn local_path() -> impl TypedValueParser<Value = PathBuf> {
    PathBufValueParser::new().try_map(|path| {
        let text = path.to_string_lossy();
        match text.split_once("://") {
            Some((scheme, _)) if !scheme.is_empty() && scheme.chars().all(|letter| letter.is_ascii_alphanumeric()) => {
                Err(format!("graspmill writes to file systems, not to {scheme}: give a folder and copy it afterwards"))
            }
            _ => Ok(path),
        }
    })
}

/// Parser of a folder to read: links in its path are followed, links inside it are not.
pub fn folder() -> impl TypedValueParser<Value = Folder> {
    PathBufValueParser::new().map(Folder::at)
}

/// Parser of a folder to write to, on this machine's file systems.
pub fn local_folder() -> impl TypedValueParser<Value = Folder> {
    local_path().map(Folder::at)
}

/// Path from the root, without `..` unless the folder before it is a link.
pub fn absolute(path: &Path) -> io::Result<PathBuf> {
    let mut absolute = PathBuf::new();
    for component in path::absolute(path)?.components() {
        // The folder above a link's target is not the folder that contains the link.
        if component == Component::ParentDir && !files::is_link(&absolute) {
            absolute.pop();
        } else {
            absolute.push(component);
        }
    }
    Ok(absolute)
}

/// Path quoted for a shell, if it contains anything but letters, digits and `/._-+=:@,`.
pub fn in_shell(path: &Path) -> String {
    let text = path.shown().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+=:@,".contains(letter);
    if text.chars().all(is_plain) { text } else { format!("'{}'", text.replace('\'', r"'\''")) }
}
