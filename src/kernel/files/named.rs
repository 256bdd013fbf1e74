//! Files by paths that a user names: links are followed to their targets.

use std::{
    fs::{self, File, OpenOptions},
    io,
    os::unix::fs::OpenOptionsExt,
    path::{Path, PathBuf},
};

use super::{Bound, FileRefusal, Folder, Temporary, check_regular, read_open, text_of};

/// Linux's flag for opening without waiting: a FIFO that took the file's name after it was checked is refused as well.
const O_NONBLOCK: i32 = 0o4000;

/// Opens a regular file for reading.
///
/// # Errors
/// [`FileRefusal::NotRegular`], or an error of the operating system.
pub fn open(path: &Path) -> io::Result<File> {
    // Before opening, since opening alone makes some devices act.
    check_regular(fs::metadata(path)?.file_type())?;
    let file = OpenOptions::new().read(true).custom_flags(O_NONBLOCK).open(path)?;
    check_regular(file.metadata()?.file_type())?;
    Ok(file)
}

/// Opens a regular file that is no larger than its bound.
///
/// # Errors
/// A [`FileRefusal`], or an error of the operating system.
pub fn open_bounded(path: &Path, bound: Bound) -> io::Result<File> {
    let file = open(path)?;
    let size = file.metadata()?.len();
    if size > bound.bytes { Err(FileRefusal::TooLarge { size, bound }.into()) } else { Ok(file) }
}

/// Reads a regular file whole.
///
/// # Errors
/// A [`FileRefusal`], or an error of the operating system.
pub fn read(path: &Path, bound: Bound) -> io::Result<Vec<u8>> {
    read_open(&mut open(path)?, bound)
}

/// Reads a regular file of UTF-8 text whole.
///
/// # Errors
/// Errors of [`read`], or [`io::ErrorKind::InvalidData`] where it is no UTF-8.
pub fn read_text(path: &Path, bound: Bound) -> io::Result<String> {
    text_of(read(path, bound)?)
}

/// Whether a path is a regular file.
pub fn is_file(path: &Path) -> bool {
    path.is_file()
}

/// Whether a path is a folder.
pub fn is_folder(path: &Path) -> bool {
    path.is_dir()
}

/// Whether a path exists.
pub fn is_present(path: &Path) -> bool {
    path.exists()
}

/// Whether a path is a symbolic link itself.
pub fn is_link(path: &Path) -> bool {
    path.is_symlink()
}

/// The one path of a file or folder that has neither links nor dots.
///
/// # Errors
/// An error of the operating system.
pub fn canonical(path: &Path) -> io::Result<PathBuf> {
    fs::canonicalize(path)
}

/// Paths of the entries of a folder, in no order, each with whether it is a folder itself; a link is none.
///
/// # Errors
/// An error of the operating system.
pub fn list(folder: &Path) -> io::Result<Vec<(PathBuf, bool)>> {
    let entry = |entry: io::Result<fs::DirEntry>| {
        let entry = entry?;
        Ok((entry.path(), entry.file_type()?.is_dir()))
    };
    fs::read_dir(folder)?.map(entry).collect()
}

/// Opens a file that grows by lines, or begins one.
///
/// # Errors
/// [`FileRefusal::NotRegular`], or an error of the operating system.
pub fn open_log(path: &Path) -> io::Result<File> {
    OpenOptions::new().append(true).create(true).open(replaceable(path)?)
}

/// Writes a file whole under a temporary name in the same folder, then renames it. A link at the path stays and its
/// target is replaced, since naming an output names where it goes.
///
/// # Errors
/// [`FileRefusal::NotRegular`] if the path is something else: renaming onto a device would remove the device. An error
/// of the operating system.
pub fn replace(path: &Path, content: &[u8]) -> io::Result<()> {
    let target = replaceable(path)?;
    let no_name = || io::Error::new(io::ErrorKind::InvalidInput, "it is no path of a file");
    let name = target.file_name().ok_or_else(no_name)?;
    Temporary::write(&Folder::at(target.parent().unwrap_or(Path::new(""))), name, content)
}

/// The file that a new one may replace: the path itself, or the target of a link at that path.
fn replaceable(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(facts) => check_regular(facts.file_type()).and_then(|()| fs::canonicalize(path)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(path.to_owned()),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use std::{
        os::unix::{fs::symlink, net::UnixListener},
        process::Command,
        time::Instant,
    };

    use super::*;

    #[test]
    fn only_regular_files_are_read_and_links_to_them() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        fs::write(path("file"), "text").expect("a file");
        symlink(path("file"), path("link")).expect("a link");
        assert_eq!(read_text(&path("file"), Bound::RUN).expect("text"), "text");
        assert_eq!(read(&path("link"), Bound::RUN).expect("bytes"), b"text");

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
            for refused in [open(&path(name)).map(drop), read(&path(name), Bound::RUN).map(drop)] {
                let error = refused.expect_err(name);
                assert_eq!(FileRefusal::find_in(&error), Some(&FileRefusal::NotRegular { found }), "{name}");
            }
            let inside = Folder::at(folder.path()).open(name).expect_err(name);
            assert!(FileRefusal::find_in(&inside).is_some(), "{name}: {inside}");
        }
        assert!(began.elapsed().as_secs_f64() < 1.0, "refused before waiting");
        assert_eq!(open(&path("none")).expect_err("nothing").kind(), io::ErrorKind::NotFound);
        for name in ["fifo", "zero", "folder"] {
            assert!(replace(&path(name), b"new").is_err() && open_log(&path(name)).is_err(), "{name}");
        }
        // A link that is named as an output stays, and its target is replaced.
        replace(&path("link"), b"new").expect("written");
        replace(&path("none"), b"new").expect("written");
        assert!(fs::symlink_metadata(path("link")).expect("a link").is_symlink());
        for name in ["file", "none"] {
            assert_eq!(fs::read(path(name)).expect("a file"), b"new");
        }
    }

    #[test]
    fn a_file_above_its_bound_is_refused_unread_and_names_both_sizes() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        let file = File::create(&path).expect("a file");
        for (size, is_read) in [(Bound::RUN.bytes, true), (Bound::RUN.bytes + 1, false), (3 << 30, false)] {
            file.set_len(size).expect("a size");
            let inside = Folder::at(folder.path()).read("file", Bound::RUN);
            for found in [read(&path, Bound::RUN), inside] {
                assert_eq!(found.is_ok(), is_read, "{size}");
                if let Err(error) = found {
                    let said = error.to_string();
                    assert!(
                        said.contains(&size.to_string()) && said.contains("65536") && said.contains("run.json"),
                        "{said}"
                    );
                }
            }
        }
    }
}
