//! Folders that tests work in.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    sync::LazyLock,
};

use graspmill::ids::Digest;
use tempfile::TempDir;

use super::{
    files::{copy_folder, digest_dataset, read_text, repository_path},
    program::Program,
};

/// Digest of the built program and of the descriptions in `scenes/`: fixtures of another program are not used.
static PROGRAM: LazyLock<Digest> = LazyLock::new(|| {
    let program = fs::read(env!("CARGO_BIN_EXE_graspmill")).expect("the program");
    let scenes = digest_dataset(repository_path("scenes"));
    Digest::hash(format!("{} {scenes:?}", Digest::hash(&program)).as_bytes())
});

/// Folder of the fixtures, which later runs of the tests use again.
const FIXTURES: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/fixtures");

/// A folder that a test works in.
pub struct Workspace {
    folder: PathBuf,
    /// Removes the folder when the workspace goes.
    _temporary: Option<TempDir>,
}

impl Workspace {
    /// [`Workspace::kept`] beside the folders of [`Workspace::with_datasets`]: relative paths in jobs that are copied from there
    /// lead to the same files.
    pub fn beside_fixtures(name: &str) -> Self {
        Self::kept(&format!("fixtures/{name}"))
    }

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

    /// A workspace with datasets made by these jobs, by name, each of which may name those before it by relative paths.
    ///
    /// Every prefix of the list is a fixture: a folder of `target/tmp/fixtures` named by a digest of the program, the names and
    /// the jobs. It is made once, also when several tests need it at the same time, and kept for later runs. Tests must not
    /// write into it: [`Workspace::copy_of`] gives a copy.
    #[track_caller]
    pub fn with_datasets(jobs: &[(&str, String)]) -> Self {
        let Some(((name, job), before)) = jobs.split_last() else { panic!("no dataset") };
        let key = Digest::hash(format!("{} {jobs:?}", *PROGRAM).as_bytes()).hex();
        let fixture = Self { folder: Path::new(FIXTURES).join(&key[..24]), _temporary: None };
        fs::create_dir_all(FIXTURES).expect("a folder");
        let lock = File::create(fixture.folder.with_extension("lock")).expect("a lock");
        lock.lock().expect("locked");
        let complete = fixture.folder.with_extension("complete");
        if !complete.exists() {
            _ = fs::remove_dir_all(&fixture.folder);
            fs::create_dir(&fixture.folder).expect("a folder");
            if !before.is_empty() {
                copy_folder(Self::with_datasets(before).folder(), fixture.folder());
            }
            fixture.make_dataset(name, job, &[]);
            File::create(complete).expect("a mark");
        }
        fixture
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
