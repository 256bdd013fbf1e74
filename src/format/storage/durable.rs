//! Files of a dataset that are either complete or absent.

use std::{fs::File, path::PathBuf};

use serde::Serialize;

use super::DatasetError;
use kernel::files::{self, Folder};

/// A file under a unique temporary name next to its final one; dropping this removes the file unless it was published
/// ([`files::Temporary`]).
pub struct TemporaryFile {
    folder: Folder,
    temporary: files::Temporary,
}

impl TemporaryFile {
    /// Creates a file under a temporary name of `name`; the folder must exist.
    ///
    /// # Errors
    /// When it cannot be made.
    pub fn create(folder: &Folder, name: &str) -> Result<(File, Self), DatasetError> {
        let created = files::Temporary::create(folder, name);
        let (file, temporary) = created.map_err(DatasetError::io("creating", &folder.path_of(name)))?;
        Ok((file, Self { folder: folder.clone(), temporary }))
    }

    /// The temporary path, for messages.
    pub fn path(&self) -> PathBuf {
        self.temporary.path()
    }

    /// Syncs, renames to `name` and syncs the folder. Returns the new path.
    ///
    /// # Errors
    /// When the disk fails, or the name belongs to something that is not a file.
    pub fn publish(self, file: &File, name: &str) -> Result<PathBuf, DatasetError> {
        let path = self.folder.path_of(name);
        self.temporary.publish(file, name).map_err(DatasetError::io("renaming to", &path))?;
        Ok(path)
    }
}

/// Writes a whole file: temporary name, sync, rename. Returns its path.
pub(crate) fn write_file(folder: &Folder, name: &str, content: &[u8]) -> Result<PathBuf, DatasetError> {
    let path = folder.path_of(name);
    files::Temporary::write(folder, name, content).map_err(DatasetError::io("writing", &path))?;
    Ok(path)
}

/// JSON for people, with a line end.
pub(crate) fn json_text(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("tables are plain data with text keys") + "\n"
}
