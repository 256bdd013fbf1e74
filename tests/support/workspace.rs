//! Folders that tests work in.

use std::{
    fs,
    path::{Path, PathBuf},
};

use tempfile::TempDir;

use super::{
    files::{copy_folder, read_text},
    program::Program,
};

/// A folder that a test works in.
pub struct Workspace {
    folder: PathBuf,
    /// Removes the folder when the workspace goes.
    _temporary: Option<TempDir>,
}

impl Workspace {
    /// A folder that is removed with the workspace.
    pub fn new() -> Self {
        let temporary = tempfile::tempdir().expect("a temporary folder");
        Self { folder: temporary.path().to_owned(), _temporary: Some(temporary) }
    }

    /// The folder `target/tmp/NAME`, emptied first. It stays: for people to look at, or because a `static` holds it, which is
    /// never dropped.
    pub fn kept(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder).expect("a folder");
        Self { folder, _temporary: None }
    }

    /// A folder that is removed with the workspace, with a copy of everything in another.
    pub fn copy_of(other: &Self) -> Self {
        let copy = Self::new();
        copy_folder(other.folder(), copy.folder());
        copy
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The path of a file or folder in it.
    pub fn path(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.join(name)
    }

    /// Makes a folder in it, and those above.
    pub fn make_folder(&self, name: &str) -> PathBuf {
        let folder = self.path(name);
        fs::create_dir_all(&folder).expect("a folder");
        folder
    }

    /// Writes a file, in folders that are made where they are missing.
    pub fn write(&self, name: impl AsRef<Path>, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(&path, content).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        path
    }

    /// The text of a file in it.
    #[track_caller]
    pub fn read(&self, name: impl AsRef<Path>) -> String {
        read_text(self.path(name))
    }

    /// Runs the job file `JOB.toml` into the folder `OUT`.
    pub fn run_job(&self, job: &str, out: &str) -> Program {
        Program::run_job(self.path(format!("{job}.toml")), self.path(out))
    }

    /// Makes the dataset `NAME` by the job `NAME.toml` of this text, with these settings on top.
    #[track_caller]
    pub fn make_dataset(&self, name: &str, job: &str, settings: &[&str]) -> PathBuf {
        self.write(format!("{name}.toml"), job);
        self.run_job(name, name).set(settings).succeed();
        self.path(name)
    }
}
