//! The folder of an export: it appears when it is complete, and replaces nothing.

use std::{
    fs::{self, File},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use super::ExportError;

/// An output folder under a temporary name beside its place; dropped before [`Target::publish`], it leaves nothing.
pub(super) struct Target {
    out: PathBuf,
    temporary: PathBuf,
    /// Last folder made below, so that a folder of many files is made once.
    last_folder: PathBuf,
    files: u64,
    published: bool,
}

impl Target {
    /// A target for `out`, which must not exist or be an empty folder.
    pub fn create(out: &Path) -> Result<Self, ExportError> {
        match fs::read_dir(out) {
            Ok(mut entries) => {
                if let Some(entry) = entries.next() {
                    let entry = entry.map_err(ExportError::io("reading", out))?;
                    let entry = entry.file_name().to_string_lossy().into_owned();
                    return Err(ExportError::OutputExists { path: out.to_owned(), entry });
                }
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => {
                return Err(ExportError::OutputIsFile { path: out.to_owned() });
            }
            Err(error) => return Err(ExportError::io("reading", out)(error)),
        }
        // `canonicalize` needs a folder that exists: "out", "a/out", "out/" and "." all have a place then.
        fs::create_dir_all(out).map_err(ExportError::io("creating", out))?;
        let whole = fs::canonicalize(out).map_err(ExportError::io("reading", out))?;
        let mut name = std::ffi::OsString::from(".");
        name.push(whole.file_name().unwrap_or_default());
        name.push(format!(".{}.export.tmp", std::process::id()));
        let temporary = whole.with_file_name(name);
        fs::create_dir(&temporary).map_err(ExportError::io("creating", &temporary))?;
        Ok(Self { out: whole, last_folder: temporary.clone(), temporary, files: 0, published: false })
    }

    /// Opens a new file below the folder; also returns where it stands for the time being.
    pub fn open(&mut self, name: &str) -> Result<(BufWriter<File>, PathBuf), ExportError> {
        let (file, path) = self.file(name)?;
        Ok((BufWriter::with_capacity(128 << 10, file), path))
    }

    /// Writes a whole file.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> Result<(), ExportError> {
        let (mut file, path) = self.file(name)?;
        file.write_all(bytes).map_err(ExportError::io("writing", &path))
    }

    /// Opens a new file below the folder, for writers with a buffer of their own.
    pub fn file(&mut self, name: &str) -> Result<(File, PathBuf), ExportError> {
        let path = self.temporary.join(name);
        let folder = path.parent().unwrap_or(&self.temporary);
        if folder != self.last_folder {
            fs::create_dir_all(folder).map_err(ExportError::io("creating", folder))?;
            self.last_folder = folder.to_owned();
        }
        let file = File::create_new(&path).map_err(ExportError::io("creating", &path))?;
        self.files += 1;
        Ok((file, path))
    }

    /// Gives the folder its name; how many files it has.
    pub fn publish(mut self) -> Result<u64, ExportError> {
        // Over an empty folder a rename succeeds, over any other it fails: nothing is ever replaced.
        fs::rename(&self.temporary, &self.out).map_err(ExportError::io("renaming", &self.out))?;
        self.published = true;
        Ok(self.files)
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        if !self.published {
            // The first error is the one to tell; what can't be removed bears a temporary name.
            let _ = fs::remove_dir_all(&self.temporary);
        }
    }
}
