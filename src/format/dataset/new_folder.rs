//! A folder that is there whole or not at all.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use super::{
    DatasetError,
    durable::{TEMPORARY, sync_folder},
    folder::sorted_entries,
};

/// A folder in work: filled under a temporary name beside its own, then renamed. It goes when this does, unless it was
/// published.
pub struct NewFolder {
    out: PathBuf,
    temporary: PathBuf,
    /// Locked, which distinguishes a folder in work from the leftovers of a killed program.
    _lock: File,
    /// Whether `out` was not there before.
    created: bool,
    published: bool,
}

impl NewFolder {
    /// Begins a folder that will be `out`, which must not exist or be empty. What killed programs left of it goes.
    ///
    /// # Errors
    /// When `out` is a file or holds something, or the folder can't be made.
    pub fn begin(out: &Path) -> Result<Self, DatasetError> {
        let created = match fs::read_dir(out) {
            Ok(mut entries) => {
                if let Some(entry) = entries.next() {
                    let entry = entry.map_err(DatasetError::io("reading", out))?;
                    let entry = entry.file_name().to_string_lossy().into_owned();
                    return Err(DatasetError::Occupied { folder: out.to_owned(), entry });
                }
                false
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => true,
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => {
                return Err(DatasetError::NotAFolder { path: out.to_owned() });
            }
            Err(error) => return Err(DatasetError::io("reading", out)(error)),
        };
        // `canonicalize` needs a folder that exists: "out", "a/out", "out/" and "." all have a place then.
        fs::create_dir_all(out).map_err(DatasetError::io("creating", out))?;
        let out = fs::canonicalize(out).map_err(DatasetError::io("reading", out))?;
        let name = format!(".{}.", out.file_name().unwrap_or_default().to_string_lossy());
        let temporary = out.with_file_name(format!("{name}{}{TEMPORARY}", std::process::id()));
        for path in sorted_entries(out.parent().unwrap_or(&out))?.iter().filter(|path| is_leftover(path, &name)) {
            fs::remove_dir_all(path).map_err(DatasetError::io("removing", path))?;
        }
        fs::create_dir(&temporary).map_err(DatasetError::io("creating", &temporary))?;
        let lock = File::open(&temporary).map_err(DatasetError::io("opening", &temporary))?;
        // A file system without locks still works; its leftovers are then taken for folders in work and stay.
        let _ = lock.try_lock();
        Ok(Self { out, temporary, _lock: lock, created, published: false })
    }

    /// The folder, under its temporary name.
    pub fn path(&self) -> &Path {
        &self.temporary
    }

    /// Gives the folder its name, which it returns. Over an empty folder a rename succeeds, over any other it fails: nothing is
    /// ever replaced.
    ///
    /// # Errors
    /// When somebody else filled that folder in the meantime, or the disk fails.
    pub fn publish(mut self) -> Result<PathBuf, DatasetError> {
        fs::rename(&self.temporary, &self.out).map_err(DatasetError::io("renaming to", &self.out))?;
        self.published = true;
        if let Some(parent) = self.out.parent() {
            sync_folder(parent)?;
        }
        Ok(self.out.clone())
    }
}

impl Drop for NewFolder {
    fn drop(&mut self) {
        if !self.published {
            // The first error is the one to report; what can't be removed bears a temporary name.
            let _ = fs::remove_dir_all(&self.temporary);
            if self.created {
                let _ = fs::remove_dir(&self.out);
            }
        }
    }
}

/// Whether this is a temporary folder of that name, `.<name>.<process>.tmp`, that nobody is filling any more.
fn is_leftover(path: &Path, name: &str) -> bool {
    let own = path.file_name().unwrap_or_default().to_string_lossy();
    let process = own.strip_prefix(name).and_then(|rest| rest.strip_suffix(TEMPORARY));
    process.is_some_and(|process| process.parse::<u32>().is_ok())
        && path.is_dir()
        && File::open(path).is_ok_and(|folder| folder.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_program_left_goes_and_what_is_on_its_way_stays() {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join("out");
        for left in [".out.4294967295.tmp", ".out.words.tmp", ".other.4294967295.tmp"] {
            fs::create_dir_all(folder.path().join(left).join("inside")).expect("a folder");
        }
        let names = || {
            let names = sorted_entries(folder.path()).expect("readable");
            names.iter().map(|path| path.file_name().expect("a name").to_owned()).collect::<Vec<_>>()
        };
        let first = NewFolder::begin(&out).expect("a new folder");
        let own = first.path().file_name().expect("a name").to_owned();
        assert_eq!(names(), [".other.4294967295.tmp".into(), own, ".out.words.tmp".into(), "out".into()]);
        assert!(!is_leftover(first.path(), ".out."), "it is locked");
        fs::write(first.path().join("file"), "x").expect("written");
        assert_eq!(first.publish().expect("published"), fs::canonicalize(&out).expect("a place"));
        assert!(out.join("file").exists());
        assert!(matches!(NewFolder::begin(&out), Err(DatasetError::Occupied { .. })));
        assert!(matches!(NewFolder::begin(&out.join("file")), Err(DatasetError::NotAFolder { .. })));
    }

    #[test]
    fn what_is_not_published_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        drop(NewFolder::begin(&folder.path().join("new")).expect("a new folder"));
        assert_eq!(sorted_entries(folder.path()).expect("readable"), Vec::<PathBuf>::new());
        let empty = folder.path().join("empty");
        fs::create_dir(&empty).expect("a folder");
        drop(NewFolder::begin(&empty).expect("a new folder"));
        assert_eq!(sorted_entries(folder.path()).expect("readable"), [empty]);
    }
}
