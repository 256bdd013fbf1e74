//! Remedies for errors of the operating system.

use std::io;

use crate::files::FileRefusal;

/// Numbers of errors on Linux that the standard library has no stable kind for.
const EIO: i32 = 5;
const ENFILE: i32 = 23;
const EMFILE: i32 = 24;
const ENAMETOOLONG: i32 = 36;
const ELOOP: i32 = 40;

/// Remedy for a file or folder that cannot be read, for the end of a message.
pub fn for_reading(error: &io::Error) -> &'static str {
    if FileRefusal::find_in(error).is_some() {
        return "docs/security.md has the rules for links, sizes and kinds of files";
    }
    match (error.raw_os_error(), error.kind()) {
        (Some(EMFILE), _) => "this process has too many open files; raise the limit (`ulimit -n`)",
        (Some(ENFILE), _) => "this machine has too many open files; end programs that hold many",
        (Some(EIO), _) => "check the disk, or the connection to the server of its file system",
        (Some(ENAMETOOLONG), _) => "check the path: a name in it is too long",
        (Some(ELOOP), _) => "check the path: a link in it leads back to itself",
        (_, io::ErrorKind::NotFound) => "check the path",
        (_, io::ErrorKind::PermissionDenied) => "change its permissions, or those of a folder above it",
        (_, io::ErrorKind::NotADirectory) => "check the path: a part of it is a file",
        (_, io::ErrorKind::IsADirectory) => "check the path: it is a folder",
        (_, io::ErrorKind::OutOfMemory) => "free some memory",
        (_, io::ErrorKind::StaleNetworkFileHandle) => "it changed on the server of its file system; try again",
        (_, io::ErrorKind::TimedOut) => "check the connection to the server of its file system",
        // Such errors carry their own words: no text.
        (_, io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData) => "give another file",
        _ => "check the path, its permissions and the disk",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remedies_fit_the_errors_of_the_system() {
        for (number, word) in [
            (1, "permissions"),
            (2, "path"),
            (5, "disk"),
            (12, "memory"),
            (13, "permissions"),
            (20, "a part of it is a file"),
            (21, "it is a folder"),
            (23, "this machine has too many open files"),
            (24, "ulimit -n"),
            (36, "too long"),
            (40, "link"),
            (110, "connection"),
            (116, "server"),
        ] {
            let remedy = for_reading(&io::Error::from_raw_os_error(number));
            assert!(remedy.contains(word), "{number}: {remedy}");
            assert_eq!(remedy.contains("permissions"), [1, 13].contains(&number), "{number}: {remedy}");
        }
    }

    #[test]
    fn refused_files_lead_to_the_rules() {
        let error = crate::files::read("/".as_ref(), crate::files::Bound::JOB).expect_err("a folder");
        assert!(for_reading(&error).contains("docs/security.md"));
    }
}
