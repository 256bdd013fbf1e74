//! The folder of a release: there whole or not at all.

use std::{
    collections::BTreeSet,
    fs::{self},
    io,
    path::{Path, PathBuf},
};

use format::dataset::{DatasetError, NewFolder};

/// A release in work.
pub(super) struct Staging(NewFolder);

impl Staging {
    /// Begins a release that will stand in `out`, as [`NewFolder::begin`].
    pub fn begin(out: &Path) -> Result<Self, DatasetError> {
        NewFolder::begin(out).map(Self)
    }

    /// The folder, under its temporary name.
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// Copies a file to `name` inside the folder; where the file system can, without a second copy of its blocks.
    pub fn copy(&self, from: &Path, name: &str) -> Result<(), DatasetError> {
        let to = self.path_of(name)?;
        // A copy's error does not say which of the two files it is about.
        kernel::files::open(from).map_err(DatasetError::io("reading", from))?;
        fs::copy(from, &to).map_err(DatasetError::io("copying to", &to)).map(|_| ())
    }

    /// Writes a file `name` inside the folder.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), DatasetError> {
        let to = self.path_of(name)?;
        fs::write(&to, content).map_err(DatasetError::io("writing", &to))
    }

    /// Removes a file inside the folder, where it is there.
    pub fn remove(&self, name: &str) -> Result<(), DatasetError> {
        let path = self.path().join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(DatasetError::io("removing", &path)(error)),
            _ => Ok(()),
        }
    }

    fn path_of(&self, name: &str) -> Result<PathBuf, DatasetError> {
        let path = self.path().join(name);
        let parent = path.parent().unwrap_or(self.path());
        fs::create_dir_all(parent).map_err(DatasetError::io("creating", parent))?;
        Ok(path)
    }

    /// Paths of all files inside, sorted, with `/` between folders.
    pub fn files(&self) -> Result<Vec<String>, DatasetError> {
        files_below(self.path())
    }

    /// Syncs every file and folder and gives the folder its name, as [`NewFolder::publish`].
    pub fn publish(self) -> Result<PathBuf, DatasetError> {
        let files: Vec<PathBuf> = self.files()?.iter().map(|name| self.path().join(name)).collect();
        let folders: BTreeSet<&Path> = files.iter().filter_map(|file| file.parent()).chain([self.path()]).collect();
        for path in &files {
            kernel::files::open(path).and_then(|file| file.sync_all()).map_err(DatasetError::io("syncing", path))?;
        }
        for path in folders {
            kernel::files::Folder::at(path).sync().map_err(DatasetError::io("syncing", path))?;
        }
        self.0.publish()
    }
}

/// Paths of all files below a folder, sorted, with `/` between folders.
pub(crate) fn files_below(folder: &Path) -> Result<Vec<String>, DatasetError> {
    let (mut files, mut folders) = (Vec::new(), vec![String::new()]);
    while let Some(below) = folders.pop() {
        let path = folder.join(&below);
        for entry in fs::read_dir(&path).map_err(DatasetError::io("reading", &path))? {
            let entry = entry.map_err(DatasetError::io("reading", &path))?;
            let name = format!("{below}{}", entry.file_name().to_string_lossy());
            match entry.file_type().map_err(DatasetError::io("reading", &path))?.is_dir() {
                true => folders.push(format!("{name}/")),
                false => files.push(name),
            }
        }
    }
    files.sort();
    Ok(files)
}
