//! Files that are not opened, even if the operating system would allow it.

use std::{io, path::PathBuf};

use super::Bound;
use crate::words::Show;

/// Why a file is not opened, read or replaced, inside an [`io::Error`] of the kind [`io::ErrorKind::InvalidInput`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FileRefusal {
    /// A folder, FIFO, socket or device.
    #[error("it is {found}, not a regular file; replace it by one")]
    NotRegular {
        /// Kind of file, with its article: `a FIFO`.
        found: &'static str,
    },
    /// A symbolic link on the path inside a [`super::Folder`].
    #[error(
        "{} is a symbolic link, and links inside this folder are not followed; replace it by a copy of what it leads to \
         (`cp -rL`)",
        path.shown()
    )]
    Link {
        /// The link.
        path: PathBuf,
    },
    /// A path that leads out of a [`super::Folder`].
    #[error("'{name}' leads out of the folder; give a name inside it")]
    Outside {
        /// The path.
        name: String,
    },
    /// A file above the bound of its kind.
    #[error("it has {size} bytes, and {} may have at most {}; check that it is the right file", bound.kind, bound.bytes)]
    TooLarge {
        /// Size [bytes].
        size: u64,
        /// The bound.
        bound: Bound,
    },
}

impl FileRefusal {
    /// The refusal inside an error; `None` for an error of the operating system.
    pub fn find_in(error: &io::Error) -> Option<&Self> {
        error.get_ref()?.downcast_ref()
    }
}

impl From<FileRefusal> for io::Error {
    fn from(refusal: FileRefusal) -> Self {
        Self::new(io::ErrorKind::InvalidInput, refusal)
    }
}
