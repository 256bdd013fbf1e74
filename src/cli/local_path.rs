//! Paths and folders that a user names on the command line.

use std::path::PathBuf;

use clap::builder::{PathBufValueParser, TypedValueParser};
use kernel::files::Folder;

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
