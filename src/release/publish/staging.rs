//! A folder that is there whole or not at all: filled under a temporary name beside its own, then renamed.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use super::ReleaseError;
use crate::dataset::DatasetError;

/// A folder on its way; it goes when this does, unless it was published.
pub(super) struct Staging {
    path: PathBuf,
    out: PathBuf,
}

impl Staging {
    /// Begins a folder that will be `out`.
    ///
    /// # Errors
    /// When `out` holds something, or the folder can't be made.
    pub fn begin(out: &Path) -> Result<Self, ReleaseError> {
        if let Some(entry) = first_entry(out)? {
            return Err(ReleaseError::Occupied { folder: out.to_owned(), entry });
        }
        let whole = std::path::absolute(out).map_err(failed("finding", out))?;
        let name = whole.file_name().map(|name| name.to_string_lossy().into_owned());
        let (Some(name), Some(parent)) = (name, whole.parent()) else {
            return Err(failed("creating", out)(io::Error::other("not a folder's name")).into());
        };
        fs::create_dir_all(parent).map_err(failed("creating", parent))?;
        let path = parent.join(format!(".{name}.{}.tmp", std::process::id()));
        fs::create_dir(&path).map_err(failed("creating", &path))?;
        Ok(Self { path, out: whole })
    }

    /// The folder, under its temporary name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Copies a file to `name` inside the folder; where the file system can, without a second copy of its blocks.
    pub fn copy(&self, from: &Path, name: &str) -> Result<(), DatasetError> {
        let to = self.place_of(name)?;
        fs::copy(from, &to).map_err(failed("copying", from)).map(|_| ())
    }

    /// Writes a file `name` inside the folder.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), DatasetError> {
        let to = self.place_of(name)?;
        fs::write(&to, content).map_err(failed("writing", &to))
    }

    /// Removes a file inside the folder, where it is there.
    pub fn remove(&self, name: &str) -> Result<(), DatasetError> {
        let path = self.path.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(failed("removing", &path)(error)),
            _ => Ok(()),
        }
    }

    fn place_of(&self, name: &str) -> Result<PathBuf, DatasetError> {
        let path = self.path.join(name);
        let parent = path.parent().unwrap_or(&self.path);
        fs::create_dir_all(parent).map_err(failed("creating", parent))?;
        Ok(path)
    }

    /// Paths of all files inside, sorted, with `/` between folders.
    pub fn files(&self) -> Result<Vec<String>, DatasetError> {
        files_below(&self.path)
    }

    /// Syncs every file and folder and gives the folder its name.
    ///
    /// # Errors
    /// When somebody else filled that folder in the meantime, or the disk fails.
    pub fn publish(mut self) -> Result<PathBuf, ReleaseError> {
        let files: Vec<PathBuf> = self.files()?.iter().map(|name| self.path.join(name)).collect();
        let folders: BTreeSet<&Path> =
            files.iter().filter_map(|file| file.parent()).chain([self.path.as_path()]).collect();
        for path in files.iter().map(PathBuf::as_path).chain(folders) {
            File::open(path).and_then(|file| file.sync_all()).map_err(failed("syncing", path))?;
        }
        if let Some(entry) = first_entry(&self.out)? {
            return Err(ReleaseError::Occupied { folder: self.out.clone(), entry });
        }
        // Renaming takes the place of an empty folder.
        fs::rename(&self.path, &self.out).map_err(failed("renaming to", &self.out))?;
        self.path.clear();
        if let Some(parent) = self.out.parent() {
            File::open(parent).and_then(|folder| folder.sync_all()).map_err(failed("syncing", parent))?;
        }
        Ok(self.out.clone())
    }
}

impl Drop for Staging {
    fn drop(&mut self) {
        if !self.path.as_os_str().is_empty() {
            // A failure is not worth an error over the one that led here; the folder's name says what it is.
            let _ = fs::remove_dir_all(&self.path);
        }
    }
}

/// Paths of all files below a folder, sorted, with `/` between folders.
pub(in crate::release) fn files_below(folder: &Path) -> Result<Vec<String>, DatasetError> {
    let (mut files, mut folders) = (Vec::new(), vec![String::new()]);
    while let Some(below) = folders.pop() {
        let path = folder.join(&below);
        for entry in fs::read_dir(&path).map_err(failed("reading", &path))? {
            let entry = entry.map_err(failed("reading", &path))?;
            let name = format!("{below}{}", entry.file_name().to_string_lossy());
            match entry.file_type().map_err(failed("reading", &path))?.is_dir() {
                true => folders.push(format!("{name}/")),
                false => files.push(name),
            }
        }
    }
    files.sort();
    Ok(files)
}

/// One thing that stands in a folder; `None` where the folder is empty or not there.
fn first_entry(folder: &Path) -> Result<Option<String>, DatasetError> {
    match fs::read_dir(folder) {
        Ok(mut entries) => match entries.next() {
            Some(entry) => {
                Ok(Some(entry.map_err(failed("reading", folder))?.file_name().to_string_lossy().into_owned()))
            }
            None => Ok(None),
        },
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(failed("reading", folder)(error)),
    }
}

fn failed(action: &'static str, path: &Path) -> impl FnOnce(io::Error) -> DatasetError {
    let path = path.to_owned();
    move |source| DatasetError::Io { action, path, source }
}
