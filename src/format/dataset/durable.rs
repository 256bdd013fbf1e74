//! Files that are there whole or not at all.

use std::{
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
    time::{SystemTime, UNIX_EPOCH},
};

use serde::Serialize;

use super::DatasetError;

/// Ending of temporary names.
pub(super) const TEMPORARY: &str = ".tmp";

/// A unique temporary name in the folder of a final one; the file goes when this does, unless it was published.
///
/// The file is locked while it is open, which distinguishes a writer at work from the leftovers of a killed one, whatever
/// process or machine it ran on.
pub struct Temporary {
    path: PathBuf,
}

impl Temporary {
    /// Creates `.<name>.<process>-<time>-<count>.tmp` in `folder`; none of these parts reaches the content.
    pub fn create(folder: &Path, name: &str) -> Result<(File, Self), DatasetError> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let nanos = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos());
        let path = folder.join(format!(".{name}.{}-{nanos:x}-{count}{TEMPORARY}", std::process::id()));
        let file =
            OpenOptions::new().write(true).create_new(true).open(&path).map_err(DatasetError::io("creating", &path))?;
        // A file system without locks still works; its leftovers are then taken for writers at work and stay.
        let _ = file.try_lock();
        Ok((file, Self { path }))
    }

    /// The temporary path, for messages.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Syncs, renames to `name` and syncs the folder.
    pub fn publish(mut self, file: &File, folder: &Path, name: &str) -> Result<PathBuf, DatasetError> {
        let path = folder.join(name);
        file.sync_all().map_err(DatasetError::io("syncing", &path))?;
        fs::rename(&self.path, &path).map_err(DatasetError::io("renaming to", &path))?;
        self.path.clear();
        sync_folder(folder)?;
        Ok(path)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            // A failure is not worth an error over the one that led here; the next run finds the leftover.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Writes a whole file: temporary name, sync, rename.
pub(crate) fn write_file(folder: &Path, name: &str, content: &[u8]) -> Result<PathBuf, DatasetError> {
    let (mut file, temporary) = Temporary::create(folder, name)?;
    file.write_all(content).map_err(DatasetError::io("writing", &folder.join(name)))?;
    temporary.publish(&file, folder, name)
}

/// Makes renames in a folder last through a power cut.
pub(super) fn sync_folder(folder: &Path) -> Result<(), DatasetError> {
    kernel::files::Folder::at(folder).sync().map_err(DatasetError::io("syncing", folder))
}

/// Whether a temporary file is a leftover: nobody holds its lock. What is no regular file is none, and is not opened: a FIFO
/// would wait for its reader.
pub(super) fn is_leftover(path: &Path) -> bool {
    if !path.is_file() {
        return false;
    }
    match OpenOptions::new().write(true).open(path) {
        Ok(file) => file.try_lock().is_ok(),
        Err(_) => false,
    }
}

/// JSON for people, with a line end.
pub(crate) fn json_text(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect("tables are plain data with text keys") + "\n"
}
