//! Files that are either complete or missing.

use std::{
    fs::{File, TryLockError},
    io::{self, Write},
    os::unix::fs::MetadataExt,
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
    time::{SystemTime, UNIX_EPOCH},
};

use super::{Entry, FileRefusal, Folder};

/// Ending of temporary names.
const TEMPORARY: &str = ".tmp";
/// Names that are tried before another program that takes each is an error.
const TRIES: u32 = 64;

/// A unique temporary name in the folder of a final one; the file goes when this does, unless it was published.
///
/// The file is locked while it is open, which distinguishes an active writer from the leftovers of a killed one, on any
/// machine ([`remove_leftover`]).
#[derive(Debug)]
pub struct Temporary {
    folder: Folder,
    /// Empty once it was published.
    name: String,
}

impl Temporary {
    /// Creates `.<name>.<process>-<time>-<count>.tmp` in a folder; none of these parts reaches the content.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn create(folder: &Folder, name: impl AsRef<Path>) -> io::Result<(File, Self)> {
        let name = name.as_ref().to_string_lossy().into_owned();
        for _ in 0..TRIES {
            let temporary = Self { folder: folder.clone(), name: unique_name(&name) };
            let file = match folder.create_new(&temporary.name) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => continue,
                file => file?,
            };
            // Before it had the lock, another run may have mistaken the file for a leftover: a run that holds the lock
            // is about to remove it, a run that removed it has taken its name away. A file system without locks still
            // works; its leftovers then look like active writers and stay.
            let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
            if !is_taken && file.metadata()?.nlink() > 0 {
                return Ok((file, temporary));
            }
        }
        Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            "another program locks or removes every new file in this folder",
        ))
    }

    /// The temporary path, for messages.
    pub fn path(&self) -> PathBuf {
        self.folder.path_of(&self.name)
    }

    /// Syncs, renames to `name` and syncs the folder. A link with that name is itself replaced.
    ///
    /// # Errors
    /// [`FileRefusal::NotRegular`] if the name is a folder, FIFO, socket or device, or an error of the operating system.
    pub fn publish(mut self, file: &File, name: impl AsRef<Path>) -> io::Result<()> {
        let name = name.as_ref();
        file.sync_all()?;
        match self.folder.entry(name)? {
            None | Some(Entry::File | Entry::Link) => {}
            Some(Entry::Folder) => return Err(FileRefusal::NotRegular { found: "a folder" }.into()),
            Some(Entry::Other(found)) => return Err(FileRefusal::NotRegular { found }.into()),
        }
        self.folder.rename(&self.name, name)?;
        self.name.clear();
        self.folder.sync()
    }

    /// Writes a whole file: temporary name, sync, rename.
    ///
    /// # Errors
    /// Errors of [`Temporary::create`] and [`Temporary::publish`].
    pub fn write(folder: &Folder, name: impl AsRef<Path>, content: &[u8]) -> io::Result<()> {
        let (mut file, temporary) = Self::create(folder, &name)?;
        file.write_all(content)?;
        temporary.publish(&file, name)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.name.is_empty() {
            // A failure is not worth an error over the one that led here; the next run finds the leftover.
            let _ = self.folder.remove_file(&self.name);
        }
    }
}

/// A temporary name that no other program gives: `.<name>.<process>-<time>-<count>.tmp`.
pub fn unique_name(name: &str) -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let count = COUNT.fetch_add(1, Ordering::Relaxed);
    let nanos = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos());
    format!(".{name}.{}-{nanos:x}-{count}{TEMPORARY}", std::process::id())
}

/// The final name of a temporary name: `run.json` for `.run.json.12-1a-0.tmp`; `None` for any other name.
pub fn name_of_temporary(name: &str) -> Option<&str> {
    let (name, unique) = name.strip_prefix('.')?.strip_suffix(TEMPORARY)?.rsplit_once('.')?;
    let (process, rest) = unique.split_once('-')?;
    let (time, count) = rest.split_once('-')?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let is_hex = !time.is_empty() && time.bytes().all(|byte| byte.is_ascii_hexdigit());
    (!name.is_empty() && is_number(process) && is_hex && is_number(count)).then_some(name)
}

/// Whether a name has the form of [`unique_name`].
pub fn is_temporary_name(name: &str) -> bool {
    name_of_temporary(name).is_some()
}

/// Whether a temporary file is a leftover that no process has locked. Entries that are not regular files or have
/// another name are not leftovers.
pub fn is_leftover(folder: &Folder, name: &str) -> bool {
    lock_leftover(folder, name).is_some()
}

/// Removes a leftover ([`is_leftover`]) while its lock is held, so that no writer that is about to begin loses its file unnoticed.
///
/// # Errors
/// When it cannot be removed.
pub fn remove_leftover(folder: &Folder, name: &str) -> io::Result<()> {
    let Some(_lock) = lock_leftover(folder, name) else { return Ok(()) };
    match folder.remove_file(name) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

fn lock_leftover(folder: &Folder, name: &str) -> Option<File> {
    let file = is_temporary_name(name).then(|| folder.open_to_write(Path::new(name)).ok())??;
    file.try_lock().ok().map(|()| file)
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::atomic::AtomicBool, thread};

    use super::*;

    #[test]
    fn temporary_names_have_one_form() {
        assert_eq!(name_of_temporary(&unique_name("run.json")), Some("run.json"));
        assert_eq!(name_of_temporary(".a.1-1-0.tmp"), Some("a"));
        for other in
            ["notes.tmp", ".tmp", ".a.tmp", "..1-1-0.tmp", ".a.1-g-0.tmp", "a.1-1-0.tmp", ".a.1-1-0", ".a.1-1-.tmp"]
        {
            assert!(!is_temporary_name(other), "{other}");
        }
    }

    #[test]
    fn leftovers_are_files_of_that_form_that_nobody_writes() {
        let scratch = tempfile::tempdir().expect("a folder");
        let folder = Folder::at(scratch.path());
        let (file, at_work) = Temporary::create(&folder, "table").expect("a file");
        let name = at_work.path().file_name().expect("a name").to_string_lossy().into_owned();
        for left in [".table.1-1-0.tmp", "notes.tmp"] {
            fs::write(scratch.path().join(left), "left").expect("a file");
        }
        assert!(is_leftover(&folder, ".table.1-1-0.tmp"));
        assert!(!is_leftover(&folder, "notes.tmp") && !is_leftover(&folder, &name));
        for each in [".table.1-1-0.tmp", "notes.tmp", name.as_str()] {
            remove_leftover(&folder, each).expect("removed or left");
        }
        at_work.publish(&file, "table").expect("published");
        assert_eq!(folder.names().expect("names"), ["notes.tmp", "table"]);
    }

    /// Two runs in one folder: one writes while the other clears leftovers away all the time.
    #[test]
    fn no_writer_loses_its_file_to_one_that_clears_away() {
        let scratch = tempfile::tempdir().expect("a folder");
        let folder = Folder::at(scratch.path());
        let done = AtomicBool::new(false);
        thread::scope(|scope| {
            for _ in 0..2 {
                scope.spawn(|| {
                    while !done.load(Ordering::Relaxed) {
                        for name in folder.names().expect("names") {
                            remove_leftover(&folder, &name.to_string_lossy()).expect("removed or left");
                        }
                    }
                });
            }
            let written: io::Result<()> = (0..100).try_for_each(|_| Temporary::write(&folder, "table", b"rows"));
            done.store(true, Ordering::Relaxed);
            written.expect("no file was lost");
        });
        assert_eq!(folder.names().expect("names"), ["table"]);
    }
}
