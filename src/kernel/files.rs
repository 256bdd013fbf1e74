//! Reading and replacing regular files, and nothing else: a FIFO waits for its writer, a device may never end, and opening one can have
//! effects. Every file that graspmill reads is opened here.
//!
//! A link is followed, and what it leads to counts.

use std::{
    fs::{self, File, FileType, OpenOptions},
    io::{self, Read},
    os::unix::fs::{FileTypeExt, OpenOptionsExt},
    path::{Path, PathBuf},
};

/// Something that is no regular file, inside an [`io::Error`] of the kind [`io::ErrorKind::InvalidInput`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("it is {found}, not a regular file; replace it by one")]
pub struct NotRegularFile {
    /// Kind of file, with its article: `a FIFO`.
    pub found: &'static str,
}

/// Linux's flag for opening without waiting: a FIFO that took the file's name after it was checked is refused as well.
const O_NONBLOCK: i32 = 0o4000;

/// Opens a regular file for reading.
///
/// # Errors
/// [`NotRegularFile`], or an error of the operating system.
pub fn open(path: &Path) -> io::Result<File> {
    // Before opening, since that alone makes some devices act.
    check(fs::metadata(path)?.file_type())?;
    let file = OpenOptions::new().read(true).custom_flags(O_NONBLOCK).open(path)?;
    check(file.metadata()?.file_type())?;
    Ok(file)
}

/// Reads a regular file whole.
///
/// # Errors
/// [`NotRegularFile`], or an error of the operating system.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = open(path)?;
    let mut content = Vec::new();
    content.try_reserve_exact(usize::try_from(file.metadata()?.len()).unwrap_or(usize::MAX))?;
    file.read_to_end(&mut content)?;
    Ok(content)
}

/// Reads a regular file of UTF-8 text whole.
///
/// # Errors
/// [`NotRegularFile`], an error of the operating system, or [`io::ErrorKind::InvalidData`] where it is no UTF-8.
pub fn read_to_string(path: &Path) -> io::Result<String> {
    let not_text = |_| io::Error::new(io::ErrorKind::InvalidData, "it is no UTF-8 text");
    String::from_utf8(read(path)?).map_err(not_text)
}

/// Makes a folder's renames and new files last through a power cut.
///
/// # Errors
/// An error of the operating system.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

/// The file that a new one may replace: the path itself, or what a link at it leads to.
///
/// # Errors
/// [`NotRegularFile`] where something else stands there: renaming onto a device would remove the device.
pub fn replaceable(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(facts) => check(facts.file_type()).and_then(|()| fs::canonicalize(path)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(path.to_owned()),
        Err(error) => Err(error),
    }
}

fn check(kind: FileType) -> io::Result<()> {
    let found = match kind {
        kind if kind.is_file() => return Ok(()),
        kind if kind.is_dir() => "a folder",
        kind if kind.is_fifo() => "a FIFO",
        kind if kind.is_socket() => "a socket",
        _ => "a device",
    };
    Err(io::Error::new(io::ErrorKind::InvalidInput, NotRegularFile { found }))
}

#[cfg(test)]
mod tests {
    use std::{os::unix::fs::symlink, os::unix::net::UnixListener, process::Command, time::Instant};

    use super::*;

    #[test]
    fn only_regular_files_are_read_and_links_to_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("file"), "text").expect("a file");
        symlink(path("file"), path("link")).expect("a link");
        assert_eq!(read_to_string(&path("file")).expect("text"), "text");
        assert_eq!(read(&path("link")).expect("bytes"), b"text");

        assert!(Command::new("mkfifo").arg(path("fifo")).status().expect("mkfifo").success());
        let _socket = UnixListener::bind(path("socket")).expect("a socket");
        symlink("/dev/zero", path("zero")).expect("a link");
        symlink(path("fifo"), path("link to fifo")).expect("a link");
        fs::create_dir(path("folder")).expect("a folder");
        let began = Instant::now();
        for (name, found) in [
            ("fifo", "a FIFO"),
            ("link to fifo", "a FIFO"),
            ("socket", "a socket"),
            ("zero", "a device"),
            ("folder", "a folder"),
        ] {
            for refused in [open(&path(name)).map(drop), read(&path(name)).map(drop)] {
                let error = refused.expect_err(name);
                let inner = error.get_ref().and_then(|inner| inner.downcast_ref::<NotRegularFile>());
                assert_eq!(inner, Some(&NotRegularFile { found }), "{name}");
            }
        }
        assert!(began.elapsed().as_secs_f64() < 1.0, "refused before waiting");
        assert_eq!(open(&path("none")).expect_err("nothing").kind(), io::ErrorKind::NotFound);
        sync_folder(&path("folder")).expect("a folder");
        assert!(["fifo", "zero", "folder"].iter().all(|name| replaceable(&path(name)).is_err()));
        assert_eq!(replaceable(&path("none")).expect("free"), path("none"));
        let file = fs::canonicalize(path("file")).expect("a path");
        assert_eq!(replaceable(&path("link")).expect("a link to a file"), file);
    }
}
