//! The folder of a release, which appears only when it is complete.

use std::{
    collections::BTreeSet,
    io::{self, Write},
    path::{Path, PathBuf},
};

use format::dataset::{DatasetError, NewFolder};
use kernel::files::{Entry, Folder};

/// A release in progress.
pub(super) struct Staging(NewFolder);

impl Staging {
    /// Starts a release in `out`, like [`NewFolder::begin`].
    pub fn begin(out: &Path) -> Result<Self, DatasetError> {
        NewFolder::begin(out).map(Self)
    }

    /// The folder, under its temporary name.
    pub fn folder(&self) -> &Folder {
        self.0.folder()
    }

    /// Copies a file of a folder to the same name, sharing its blocks if the file system supports this.
    pub fn copy(&self, from: &Folder, name: &str) -> Result<(), DatasetError> {
        // An error of a copy does not name the affected file.
        let mut source = from.open(name).map_err(DatasetError::io("reading", &from.path_of(name)))?;
        let copied = self.folder().create_new(name).and_then(|mut copy| io::copy(&mut source, &mut copy));
        copied.map_err(DatasetError::io("copying to", &self.folder().path_of(name))).map(|_| ())
    }

    /// Writes a file `name` inside the folder.
    pub fn write(&self, name: &str, content: &[u8]) -> Result<(), DatasetError> {
        let written = self.folder().create_new(name).and_then(|mut file| file.write_all(content));
        written.map_err(DatasetError::io("writing", &self.folder().path_of(name)))
    }

    /// Removes a file inside the folder, if it exists.
    pub fn remove(&self, name: &str) -> Result<(), DatasetError> {
        match self.folder().remove_file(name) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(DatasetError::io("removing", &self.folder().path_of(name))(error))
            }
            _ => Ok(()),
        }
    }

    /// Paths of all files inside, sorted, with `/` between folders.
    pub fn files(&self) -> Result<Vec<String>, DatasetError> {
        files_below(self.folder())
    }

    /// Syncs every file and folder and renames the folder, like [`NewFolder::publish`].
    pub fn publish(self) -> Result<PathBuf, DatasetError> {
        let names = self.files()?;
        let folders: BTreeSet<&Path> = names.iter().filter_map(|name| Path::new(name).parent()).collect();
        for name in &names {
            let synced = self.folder().open(name).and_then(|file| file.sync_all());
            synced.map_err(DatasetError::io("syncing", &self.folder().path_of(name)))?;
        }
        for folder in folders {
            let folder = self.folder().subfolder(folder);
            folder.sync().map_err(DatasetError::io("syncing", folder.path()))?;
        }
        self.0.publish()
    }
}

/// Paths of all files below a folder, including links, sorted, with `/` between folders.
pub(crate) fn files_below(folder: &Folder) -> Result<Vec<String>, DatasetError> {
    let (mut files, mut folders) = (Vec::new(), vec![String::new()]);
    while let Some(below) = folders.pop() {
        let place = folder.subfolder(&below);
        for name in place.names().map_err(DatasetError::io("reading", place.path()))? {
            let entry = place.entry(&name).map_err(DatasetError::io("reading", &place.path_of(&name)))?;
            let path = format!("{below}{}", name.to_string_lossy());
            match entry {
                Some(Entry::Folder) => folders.push(format!("{path}/")),
                Some(_) => files.push(path),
                // It was removed meanwhile.
                None => {}
            }
        }
    }
    files.sort();
    Ok(files)
}
