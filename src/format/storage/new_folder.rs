//! A folder that is either complete or absent.

use std::{
    ffi::OsStr,
    fs::{File, TryLockError},
    io,
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
};

use super::DatasetError;
use kernel::files::{self, Folder};

/// Names to try before it is an error that another program removes each.
const TRIES: u32 = 64;

/// A folder under construction: filled under a temporary name next to its own, then renamed. Dropping this removes it unless it
/// was published.
pub struct NewFolder {
    /// The folder that holds it.
    parent: Folder,
    /// Name of the folder in it.
    name: String,
    temporary: String,
    folder: Folder,
    /// Locked, which distinguishes a folder under construction from the leftovers of a killed program.
    _lock: File,
    /// Whether it was not there before.
    created: bool,
    published: bool,
}

impl NewFolder {
    /// Begins a folder that will become `out`, which must be empty or not exist. Removes leftovers of killed programs.
    ///
    /// # Errors
    /// When `out` is a file or holds something, or the folder can't be made.
    pub fn begin(out: &Path) -> Result<Self, DatasetError> {
        let target = Folder::at(out);
        let created = match target.names() {
            Ok(names) => {
                if let Some(entry) = names.first() {
                    let entry = entry.to_string_lossy().into_owned();
                    return Err(DatasetError::Occupied { folder: out.to_owned(), entry });
                }
                false
            }
            Err(_) if target.is_another_file() => return Err(DatasetError::NotAFolder { path: out.to_owned() }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => true,
            Err(error) => return Err(DatasetError::io("reading", out)(error)),
        };
        // Only a folder that exists has a canonical path: "out", "a/out", "out/" and ".".
        target.create().map_err(DatasetError::io("creating", out))?;
        let out = files::canonical(out).map_err(DatasetError::io("reading", out))?;
        let name = out.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let parent = Folder::at(out.parent().unwrap_or(&out));
        for left in parent.names().map_err(DatasetError::io("reading", parent.path()))? {
            if is_leftover(&parent, &left, &name) {
                parent.remove_tree(&left).map_err(DatasetError::io("removing", &parent.path_of(&left)))?;
            }
        }
        let (temporary, lock) = create(&parent, &name).map_err(DatasetError::io("creating", &out))?;
        let folder = Folder::at(parent.path_of(&temporary));
        Ok(Self { parent, name, temporary, folder, _lock: lock, created, published: false })
    }

    /// The folder, under its temporary name.
    pub fn folder(&self) -> &Folder {
        &self.folder
    }

    /// Gives the folder its name, and returns its path. Over an empty folder a rename succeeds, over any other it fails: nothing
    /// is ever replaced.
    ///
    /// # Errors
    /// When somebody else filled that folder in the meantime, or the disk fails.
    pub fn publish(mut self) -> Result<PathBuf, DatasetError> {
        let out = self.parent.path_of(&self.name);
        self.parent.rename(&self.temporary, &self.name).map_err(DatasetError::io("renaming to", &out))?;
        self.published = true;
        self.parent.sync().map_err(DatasetError::io("syncing", self.parent.path()))?;
        Ok(out)
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        if !self.published {
            // The first error is the one to report; anything that can't be removed keeps its temporary name.
            let _ = self.parent.remove_tree(&self.temporary);
            if self.created {
                let _ = self.parent.remove_empty_folder(&self.name);
            }
        }
    }
}

/// Makes a locked folder under a temporary name.
fn create(parent: &Folder, name: &str) -> io::Result<(String, File)> {
    for _ in 0..TRIES {
        let temporary = files::unique_name(name);
        parent.subfolder(&temporary).create()?;
        // Before it is locked, another program may remove it as a leftover: a removed folder has no links.
        let Ok(lock) = parent.subfolder(&temporary).open_itself() else { continue };
        // A file system without locks still works; leftovers then count as folders under construction and are kept.
        let is_taken = matches!(lock.try_lock(), Err(TryLockError::WouldBlock));
        if !is_taken && lock.metadata()?.nlink() > 0 {
            return Ok((temporary, lock));
        }
    }
    Err(io::Error::new(io::ErrorKind::ResourceBusy, "another program removes every new folder here"))
}

/// Whether this is a temporary folder of that name, `.<name>.<process>-<time>-<count>.tmp`, that no program fills any more.
fn is_leftover(parent: &Folder, left: &OsStr, name: &str) -> bool {
    let left = left.to_string_lossy();
    files::name_of_temporary(&left) == Some(name)
        && parent.subfolder(&*left).open_itself().is_ok_and(|folder| folder.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn what_a_killed_program_left_goes_and_what_is_on_its_way_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("out");
        for left in [".out.4294967295-1a-0.tmp", ".out.words.tmp", ".other.4294967295-1a-0.tmp", ".out.b.1-1-1.tmp"] {
            fs::create_dir_all(folder.path().join(left).join("inside")).expect("a folder");
        }
        let names = || Folder::at(folder.path()).names().expect("readable");
        let first = NewFolder::begin(&out).expect("a new folder");
        let own = first.folder().path().file_name().expect("a name").to_owned();
        let mut expected = [
            ".other.4294967295-1a-0.tmp".into(),
            own.clone(),
            ".out.words.tmp".into(),
            "out".into(),
            ".out.b.1-1-1.tmp".into(),
        ];
        expected.sort();
        assert_eq!(names(), expected);
        assert!(!is_leftover(&Folder::at(folder.path()), &own, "out"), "it is locked");
        first.folder().create_new("file").expect("written");
        assert_eq!(first.publish().expect("published"), fs::canonicalize(&out).expect("a place"));
        assert!(out.join("file").exists());
        assert!(matches!(NewFolder::begin(&out), Err(DatasetError::Occupied { .. })));
        assert!(matches!(NewFolder::begin(&out.join("file")), Err(DatasetError::NotAFolder { .. })));
    }

    #[test]
    fn what_is_not_published_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        drop(NewFolder::begin(&folder.path().join("new")).expect("a new folder"));
        assert_eq!(fs::read_dir(folder.path()).expect("readable").count(), 0);
        let empty = folder.path().join("empty");
        fs::create_dir(&empty).expect("a folder");
        drop(NewFolder::begin(&empty).expect("a new folder"));
        assert_eq!(Folder::at(folder.path()).names().expect("readable"), ["empty"]);
    }
}
