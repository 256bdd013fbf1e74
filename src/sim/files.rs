//! Files of a description, before MuJoCo opens them itself.

use std::path::Path;

use kernel::{assets::Description, files::NotRegularFile};

/// Refuses a description that is, or names, what is no regular file: MuJoCo would wait for it.
pub(super) fn refuse_irregular(path: &Path) -> Result<(), String> {
    match Description::check_files(path) {
        Err(error) if error.source.get_ref().is_some_and(|source| source.is::<NotRegularFile>()) => {
            Err(error.to_string())
        }
        // Whatever else is wrong, MuJoCo says in its own words.
        _ => Ok(()),
    }
}
