//! A folder that somebody else may have filled: everything in it is reached without following a link.

use std::{
    ffi::{OsStr, OsString},
    fs::{self, File},
    io,
    os::{fd::OwnedFd, unix::ffi::OsStringExt},
    path::{Component, Path, PathBuf},
};

use rustix::fs::{AtFlags, Dir, FileType, Mode, OFlags};

use super::{Bound, FileRefusal, check_regular, is_absent, read_open, text_of};

/// Flags for opening parent folders.
const ON_THE_WAY: OFlags = OFlags::PATH.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);
/// Flags of files: a FIFO that took a file's name after it was checked is refused as well, and no terminal takes control.
const AT_ITS_END: OFlags = OFlags::NOFOLLOW.union(OFlags::NONBLOCK).union(OFlags::NOCTTY).union(OFlags::CLOEXEC);
/// Permissions of new files and folders, before the user's mask.
const FILE_MODE: u32 = 0o666;
const FOLDER_MODE: u32 = 0o777;

/// A folder by the path that a user named, or one below it.
///
/// Links in the path that the user named are followed. Links below it are not: every operation opens the folders to a
/// file one by one, each relative to the one before and without following a link (`openat` with `O_NOFOLLOW`), and
/// fails with [`FileRefusal::Link`] at the first link, even if a link replaces a folder while an operation runs. Names
/// are relative paths of plain parts, `shards/x.mcap`; others fail with [`FileRefusal::Outside`]. No file is open
/// between two operations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    /// The path that a user named.
    named: PathBuf,
    /// Path below it; empty for the folder that was named.
    below: PathBuf,
    /// Both, for messages.
    path: PathBuf,
}

/// Kind of the entry at a name in a folder; links are not followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Entry {
    /// A regular file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link.
    Link,
    /// Something else, with its article: `a FIFO`.
    Other(&'static str),
}

impl Entry {
    fn of(kind: FileType) -> Self {
        match kind {
            FileType::RegularFile => Self::File,
            FileType::Directory => Self::Folder,
            FileType::Symlink => Self::Link,
            FileType::Fifo => Self::Other("a FIFO"),
            FileType::Socket => Self::Other("a socket"),
            _ => Self::Other("a device"),
        }
    }
}

impl Folder {
    /// The folder at a path that a user named, whether it is there or not.
    pub fn at(path: impl AsRef<Path>) -> Self {
        let named = path.as_ref().to_owned();
        Self { path: named.clone(), below: PathBuf::new(), named }
    }

    /// A folder below this one, whether it is there or not.
    pub fn subfolder(&self, name: impl AsRef<Path>) -> Self {
        let name = name.as_ref();
        Self { named: self.named.clone(), below: self.below.join(name), path: self.path.join(name) }
    }

    /// Path of the folder, for messages and for programs of others.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Path of a file or folder in it, for messages.
    pub fn path_of(&self, name: impl AsRef<Path>) -> PathBuf {
        self.path.join(name)
    }

    /// Whether the folder is there.
    pub fn is_there(&self) -> bool {
        self.open_folder().is_ok()
    }

    /// Whether the path exists but is a file, not a folder.
    pub fn is_another_file(&self) -> bool {
        let found = match (self.below.parent(), self.below.file_name()) {
            (Some(parent), Some(name)) => Self { below: parent.to_owned(), ..self.clone() }.entry(name).ok().flatten(),
            _ => fs::metadata(&self.named).ok().map(|facts| if facts.is_dir() { Entry::Folder } else { Entry::File }),
        };
        matches!(found, Some(Entry::File | Entry::Other(_)))
    }

    /// Makes the folder and those on the way to it, where they are missing.
    ///
    /// # Errors
    /// [`FileRefusal::Link`], or an error of the operating system.
    pub fn create(&self) -> io::Result<()> {
        fs::create_dir_all(&self.named)?;
        make_folders(self.open_named()?, &self.below, &mut self.named.clone())
    }

    /// Looks up a name; `None` where nothing has it.
    ///
    /// # Errors
    /// [`FileRefusal::Link`] for a link on the way to it, or an error of the operating system.
    pub fn entry(&self, name: impl AsRef<Path>) -> io::Result<Option<Entry>> {
        let found = self.parent_of(name.as_ref()).and_then(|(parent, last)| entry_of(&parent, last));
        match found {
            Err(error) if is_absent(&error) => Ok(None),
            found => found.map(Some),
        }
    }

    /// Whether an entry of any kind has this name, including a link.
    pub fn contains(&self, name: impl AsRef<Path>) -> bool {
        matches!(self.entry(name), Ok(Some(_)))
    }

    /// The names in the folder, sorted.
    ///
    /// # Errors
    /// [`FileRefusal::Link`], or an error of the operating system.
    pub fn names(&self) -> io::Result<Vec<OsString>> {
        let mut names = names_in(&self.open_folder()?)?;
        names.sort();
        Ok(names)
    }

    /// Opens a regular file for reading.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn open(&self, name: impl AsRef<Path>) -> io::Result<File> {
        self.open_with(name.as_ref(), OFlags::RDONLY)
    }

    /// Opens an existing regular file for writing, without truncating it.
    pub(super) fn open_to_write(&self, name: &Path) -> io::Result<File> {
        self.open_with(name, OFlags::WRONLY)
    }

    fn open_with(&self, name: &Path, access: OFlags) -> io::Result<File> {
        let (parent, last) = self.parent_of(name)?;
        // Before opening, since opening alone makes some devices act.
        match entry_of(&parent, last)? {
            Entry::File => {}
            Entry::Link => return Err(FileRefusal::Link { path: self.path_of(name) }.into()),
            Entry::Folder => return Err(FileRefusal::NotRegular { found: "a folder" }.into()),
            Entry::Other(found) => return Err(FileRefusal::NotRegular { found }.into()),
        }
        let file = File::from(rustix::fs::openat(&parent, last, access | AT_ITS_END, Mode::empty())?);
        check_regular(file.metadata()?.file_type())?;
        Ok(file)
    }

    /// Reads a regular file whole.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn read(&self, name: impl AsRef<Path>, bound: Bound) -> io::Result<Vec<u8>> {
        read_open(&mut self.open(name)?, bound)
    }

    /// Reads a regular file of UTF-8 text whole.
    ///
    /// # Errors
    /// Errors of [`Folder::read`], or [`io::ErrorKind::InvalidData`] where it is no UTF-8.
    pub fn read_text(&self, name: impl AsRef<Path>, bound: Bound) -> io::Result<String> {
        text_of(self.read(name, bound)?)
    }

    /// Size of a regular file [bytes].
    ///
    /// # Errors
    /// Errors of [`Folder::open`].
    pub fn size(&self, name: impl AsRef<Path>) -> io::Result<u64> {
        Ok(self.open(name)?.metadata()?.len())
    }

    /// Makes a file that was not there, for writing, and the folders of its name; the folder itself must be there.
    ///
    /// # Errors
    /// [`io::ErrorKind::AlreadyExists`] if the name exists, a [`FileRefusal`], or an error of the operating
    /// system.
    pub fn create_new(&self, name: impl AsRef<Path>) -> io::Result<File> {
        let name = name.as_ref();
        let (parent, last) = match self.parent_of(name) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let parent = name.parent().unwrap_or(Path::new(""));
                make_folders(self.open_folder()?, parent, &mut self.path.clone())?;
                self.parent_of(name)?
            }
            found => found?,
        };
        let flags = OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL | AT_ITS_END;
        Ok(rustix::fs::openat(&parent, last, flags, Mode::from_raw_mode(FILE_MODE))?.into())
    }

    /// Renames a file or folder within this folder. An entry with the new name is replaced; a link itself is replaced,
    /// not its target.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn rename(&self, from: impl AsRef<Path>, to: impl AsRef<Path>) -> io::Result<()> {
        let ((from_parent, from), (to_parent, to)) = (self.parent_of(from.as_ref())?, self.parent_of(to.as_ref())?);
        Ok(rustix::fs::renameat(&from_parent, from, &to_parent, to)?)
    }

    /// Removes a file; a link itself is removed, not its target.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn remove_file(&self, name: impl AsRef<Path>) -> io::Result<()> {
        let (parent, last) = self.parent_of(name.as_ref())?;
        Ok(rustix::fs::unlinkat(&parent, last, AtFlags::empty())?)
    }

    /// Removes an empty folder.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn remove_empty_folder(&self, name: impl AsRef<Path>) -> io::Result<()> {
        let (parent, last) = self.parent_of(name.as_ref())?;
        Ok(rustix::fs::unlinkat(&parent, last, AtFlags::REMOVEDIR)?)
    }

    /// Removes a folder with everything in it; links in it go themselves.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn remove_tree(&self, name: impl AsRef<Path>) -> io::Result<()> {
        let folder = self.subfolder(name.as_ref());
        empty(&folder.open_folder()?)?;
        self.remove_empty_folder(name)
    }

    /// Removes the folder itself, where it is empty.
    ///
    /// # Errors
    /// A [`FileRefusal`], or an error of the operating system.
    pub fn remove_itself(&self) -> io::Result<()> {
        match (self.below.parent(), self.below.file_name()) {
            (Some(parent), Some(name)) => Self { below: parent.to_owned(), ..self.clone() }.remove_empty_folder(name),
            _ => fs::remove_dir(&self.named),
        }
    }

    /// Opens the folder itself, to lock it.
    ///
    /// # Errors
    /// [`FileRefusal::Link`], or an error of the operating system.
    pub fn open_itself(&self) -> io::Result<File> {
        Ok(readable(&self.open_folder()?)?.into())
    }

    /// Makes the folder's renames and new files last through a power cut.
    ///
    /// # Errors
    /// [`FileRefusal::Link`], or an error of the operating system.
    pub fn sync(&self) -> io::Result<()> {
        self.open_itself()?.sync_all()
    }

    fn open_named(&self) -> io::Result<OwnedFd> {
        let named = if self.named.as_os_str().is_empty() { Path::new(".") } else { &self.named };
        Ok(rustix::fs::open(named, ON_THE_WAY, Mode::empty())?)
    }

    fn open_folder(&self) -> io::Result<OwnedFd> {
        self.walk(Path::new(""))
    }

    /// The folder below this one.
    fn walk(&self, name: &Path) -> io::Result<OwnedFd> {
        let mut folder = self.open_named()?;
        let mut path = self.named.clone();
        for part in parts(&self.below)?.into_iter().chain(parts(name)?) {
            folder = step(&folder, part, &mut path)?;
        }
        Ok(folder)
    }

    /// The folder that holds a file of this name, and the name's last part.
    fn parent_of<'n>(&self, name: &'n Path) -> io::Result<(OwnedFd, &'n OsStr)> {
        let outside = || FileRefusal::Outside { name: name.to_string_lossy().into_owned() };
        let last = *parts(name)?.last().ok_or_else(outside)?;
        Ok((self.walk(name.parent().unwrap_or(Path::new("")))?, last))
    }
}

/// The parts of a path that leads nowhere but below.
fn parts(path: &Path) -> io::Result<Vec<&OsStr>> {
    let outside = || FileRefusal::Outside { name: path.to_string_lossy().into_owned() };
    let part = |component| match component {
        Component::Normal(part) => Ok(part),
        _ => Err(outside().into()),
    };
    path.components().map(part).collect()
}

/// Opens a folder in another, and adds its name to the path of that.
fn step(folder: &OwnedFd, part: &OsStr, path: &mut PathBuf) -> io::Result<OwnedFd> {
    path.push(part);
    rustix::fs::openat(folder, part, ON_THE_WAY | OFlags::NOFOLLOW, Mode::empty()).map_err(|error| {
        match entry_of(folder, part) {
            Ok(Entry::Link) => FileRefusal::Link { path: path.clone() }.into(),
            _ => error.into(),
        }
    })
}

/// Makes folders below another, where they are missing.
fn make_folders(mut folder: OwnedFd, below: &Path, path: &mut PathBuf) -> io::Result<()> {
    for part in parts(below)? {
        match rustix::fs::mkdirat(&folder, part, Mode::from_raw_mode(FOLDER_MODE)) {
            Err(error) if error != rustix::io::Errno::EXIST => return Err(error.into()),
            _ => {}
        }
        folder = step(&folder, part, path)?;
    }
    Ok(())
}

/// Looks up a name in an open folder.
fn entry_of(folder: &OwnedFd, name: &OsStr) -> io::Result<Entry> {
    let facts = rustix::fs::statat(folder, name, AtFlags::SYMLINK_NOFOLLOW)?;
    Ok(Entry::of(FileType::from_raw_mode(facts.st_mode)))
}

/// A folder that can be listed and synced, of one that can be passed through.
fn readable(folder: &OwnedFd) -> io::Result<OwnedFd> {
    Ok(rustix::fs::openat(folder, ".", OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC, Mode::empty())?)
}

/// The names in a folder, in no order.
fn names_in(folder: &OwnedFd) -> io::Result<Vec<OsString>> {
    let mut names = Vec::new();
    for entry in Dir::read_from(readable(folder)?)? {
        let name = OsString::from_vec(entry?.file_name().to_bytes().to_vec());
        if name != "." && name != ".." {
            names.push(name);
        }
    }
    Ok(names)
}

/// Removes everything in a folder.
fn empty(folder: &OwnedFd) -> io::Result<()> {
    for name in names_in(folder)? {
        if entry_of(folder, &name)? == Entry::Folder {
            empty(&step(folder, &name, &mut PathBuf::new())?)?;
            rustix::fs::unlinkat(folder, &name, AtFlags::REMOVEDIR)?;
        } else {
            rustix::fs::unlinkat(folder, &name, AtFlags::empty())?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use rustix::fs::{CWD, RenameFlags};

    use super::*;

    fn is_link(error: &io::Error, path: &Path) -> bool {
        matches!(FileRefusal::find_in(error), Some(FileRefusal::Link { path: found }) if found == path)
    }

    #[test]
    fn a_folder_follows_no_link_inside_and_those_of_its_own_path() {
        let scratch = tempfile::tempdir().expect("a folder");
        let path = |name: &str| scratch.path().join(name);
        fs::create_dir_all(path("elsewhere/below")).expect("a folder");
        fs::create_dir(path("data")).expect("a folder");
        fs::write(path("elsewhere/file"), "text").expect("a file");
        symlink(path("data"), path("named")).expect("a link");
        symlink(path("elsewhere"), path("data/shards")).expect("a link");
        symlink(path("elsewhere/file"), path("data/file")).expect("a link");
        symlink("nowhere", path("data/dangling")).expect("a link");

        let data = Folder::at(path("named"));
        data.create().expect("it is there");
        let (shards, of_shards) = (data.subfolder("shards"), path("named/shards"));
        let refused: [io::Result<()>; 13] = [
            data.open("shards/file").map(drop),
            data.read("shards/file", Bound::RUN).map(drop),
            data.create_new("shards/new").map(drop),
            data.create_new("shards/deep/new").map(drop),
            data.rename("shards/file", "moved"),
            data.remove_file("shards/file"),
            data.remove_tree("shards/below"),
            data.remove_empty_folder("shards/below"),
            data.entry("shards/file").map(drop),
            shards.create(),
            shards.names().map(drop),
            shards.subfolder("below").create(),
            shards.sync(),
        ];
        for (number, refused) in refused.into_iter().enumerate() {
            let error = refused.expect_err("refused");
            assert!(is_link(&error, &of_shards), "{number}: {error}");
        }
        let error = data.read_text("file", Bound::RUN).expect_err("refused");
        assert!(is_link(&error, &path("named/file")), "{error}");
        assert_eq!(data.entry("file").expect("an entry"), Some(Entry::Link));
        assert!(data.contains("dangling") && !shards.is_there());
        assert_eq!(data.create_new("dangling").expect_err("taken").kind(), io::ErrorKind::AlreadyExists);

        // The link itself is removed; its target stays.
        data.create_new("a/b/c").expect("a file");
        data.rename("a/b/c", "file").expect("renamed");
        data.remove_file("dangling").expect("removed");
        symlink(path("elsewhere"), path("data/a/link")).expect("a link");
        data.remove_tree("a").expect("removed");
        data.remove_file("shards").expect("removed");
        assert_eq!(data.names().expect("names"), ["file"]);
        assert_eq!(fs::read_to_string(path("elsewhere/file")).expect("a file"), "text");
        assert!(path("elsewhere/below").is_dir() && !path("nowhere").exists());
    }

    #[test]
    fn names_stay_inside() {
        let scratch = tempfile::tempdir().expect("a folder");
        let folder = Folder::at(scratch.path());
        for name in ["", "/etc/passwd", "..", "../x", "a/../../x", "."] {
            for refused in [folder.open(name).map(drop), folder.create_new(name).map(drop), folder.remove_file(name)] {
                let error = refused.expect_err(name);
                assert!(matches!(FileRefusal::find_in(&error), Some(FileRefusal::Outside { .. })), "{name}: {error}");
            }
        }
        assert!(folder.subfolder("..").create().is_err() && !folder.subfolder("../x").is_there());
    }

    /// A folder is exchanged for a link, and back, while files are written into it.
    #[test]
    fn no_exchange_of_a_folder_for_a_link_leads_elsewhere() {
        let scratch = tempfile::tempdir().expect("a folder");
        let path = |name: &str| scratch.path().join(name);
        fs::create_dir_all(path("data/shards")).expect("a folder");
        fs::create_dir(path("elsewhere")).expect("a folder");
        symlink(path("elsewhere"), path("link")).expect("a link");
        let data = Folder::at(path("data"));
        std::thread::scope(|scope| {
            let exchange = scope.spawn(|| {
                for _ in 0..4000 {
                    let (folder, link) = (path("data/shards"), path("link"));
                    rustix::fs::renameat_with(CWD, &folder, CWD, &link, RenameFlags::EXCHANGE).expect("exchanged");
                }
            });
            let mut number = 0;
            while !exchange.is_finished() {
                // Whichever end it has, nothing is written elsewhere.
                _ = data.create_new(format!("shards/{number}"));
                number += 1;
            }
        });
        assert_eq!(fs::read_dir(path("elsewhere")).expect("a folder").count(), 0);
        assert!(data.subfolder("shards").names().expect("names").len() > 1, "some were written where they belong");
    }
}
