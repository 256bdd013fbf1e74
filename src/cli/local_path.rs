//! Paths that the program writes to.

use std::path::PathBuf;

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
