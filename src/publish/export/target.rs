//! The folder of an export: it appears when it is complete, and never replaces files.

use std::{
    fs::File,
    io::{BufWriter, Write},
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::error::ExportError;
use format::dataset::NewFolder;

/// An output folder under a temporary name; dropped before [`Target::publish`], it leaves nothing.
pub(super) struct Target {
    folder: NewFolder,
    files: u64,
}

impl Target {
    /// A target for `out`, which must not exist or be an empty folder.
    pub fn create(out: &Path) -> Result<Self, ExportError> {
        Ok(Self { folder: NewFolder::begin(out)?, files: 0 })
    }

    /// Opens a new file below the folder; also returns its temporary path.
    pub fn open(&mut self, name: &str) -> Result<(BufWriter<File>, PathBuf), ExportError> {
        let (file, path) = self.file(name)?;
        Ok((BufWriter::with_capacity(128 << 10, file), path))
    }

    /// Writes a whole file.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), ExportError> {
        let (mut file, path) = self.file(name)?;
        file.write_all(bytes).map_err(ExportError::io("writing", &path))
    }

    /// Writes a JSON file, indented.
    pub fn write_json(&mut self, name: &str, value: &Value) -> Result<(), ExportError> {
        let text = serde_json::to_string_pretty(value).expect("plain data with text keys") + "\n";
        self.write(name, text.as_bytes())
    }

    /// Opens a new file below the folder, for writers with their own buffer.
    pub fn file(&mut self, name: &str) -> Result<(File, PathBuf), ExportError> {
        let folder = self.folder.folder();
        let path = folder.path_of(name);
        let file = folder.create_new(name).map_err(ExportError::io("creating", &path))?;
        self.files += 1;
        Ok((file, path))
    }

    /// Renames the folder to its final name; returns its number of files.
    pub fn publish(self) -> Result<u64, ExportError> {
        self.folder.publish()?;
        Ok(self.files)
    }
}
