//! The one room that opens, writes, renames and removes files.
//!
//! There are two ways to reach a file. A path that a user names is followed, including its links: [`open`], [`read`]
//! and the other functions. Inside a folder, which another user may have filled, a [`Folder`] reaches everything and
//! follows no link.
//!
//! Only regular files are read, each up to the [`Bound`] of its kind: a FIFO waits for its writer, a device may never
//! end, and opening one can have effects.

mod bound;
mod folder;
mod lines;
mod named;
mod refusal;
mod temporary;

pub use bound::Bound;
pub use folder::{Entry, Folder};
pub use lines::BoundedLines;
pub use named::{
    canonical, is_file, is_folder, is_link, is_present, list, open, open_bounded, open_log, read, read_text, replace,
};
pub use refusal::FileRefusal;
pub use temporary::{Temporary, is_leftover, is_temporary_name, name_of_temporary, remove_leftover, unique_name};

use std::{
    fs::{File, FileType},
    io::{self, Read},
    os::unix::fs::{FileExt, FileTypeExt},
};

/// Bytes of a file that are read before the others, to judge it.
pub const HEAD_BYTES: u64 = 64 << 10;

/// Whether an error means that there is no such file, also because its folder is missing or a file.
pub fn is_absent(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

/// Reads an open file whole.
///
/// # Errors
/// [`FileRefusal::TooLarge`] above the bound, before any of it is read, or an error of the operating system.
pub fn read_open(file: &mut File, bound: Bound) -> io::Result<Vec<u8>> {
    let size = file.metadata()?.len();
    if size > bound.bytes {
        return Err(FileRefusal::TooLarge { size, bound }.into());
    }
    let mut content = Vec::new();
    content.try_reserve_exact(usize::try_from(size).unwrap_or(usize::MAX))?;
    // The file may grow meanwhile.
    file.take(bound.bytes + 1).read_to_end(&mut content)?;
    let size = content.len() as u64;
    if size > bound.bytes { Err(FileRefusal::TooLarge { size, bound }.into()) } else { Ok(content) }
}

/// The first bytes of an open file, up to [`HEAD_BYTES`] of them, without moving its position. A reader decides by them
/// whether to read the others.
///
/// # Errors
/// An error of the operating system.
pub fn peek(file: &File) -> io::Result<Vec<u8>> {
    let mut head = vec![0; HEAD_BYTES.min(file.metadata()?.len()) as usize];
    let mut filled = 0;
    while filled < head.len() {
        match file.read_at(&mut head[filled..], filled as u64)? {
            0 => break,
            read => filled += read,
        }
    }
    head.truncate(filled);
    Ok(head)
}

/// The text of a file's content.
fn text_of(content: Vec<u8>) -> io::Result<String> {
    let not_text = |_| io::Error::new(io::ErrorKind::InvalidData, "it is no UTF-8 text");
    String::from_utf8(content).map_err(not_text)
}

/// Refuses everything but regular files.
fn check_regular(kind: FileType) -> io::Result<()> {
    let found = match kind {
        kind if kind.is_file() => return Ok(()),
        kind if kind.is_dir() => "a folder",
        kind if kind.is_fifo() => "a FIFO",
        kind if kind.is_socket() => "a socket",
        _ => "a device",
    };
    Err(FileRefusal::NotRegular { found }.into())
}
