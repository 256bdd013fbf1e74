//! Exit codes, and which error means which.

use std::{fmt, io, path::Path, process::ExitCode};

use format::dataset::{DatasetError, without_manifest};

/// Exit codes of the program: a contract with scripts and schedulers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Everything asked for is there.
    Complete = 0,
    /// Something failed that no other code names.
    Failed = 1,
    /// The job file or the arguments are wrong.
    BadSpec = 2,
    /// The result is complete, but meshes or objects were refused, or no sample was kept.
    Refused = 3,
    /// A check found a difference.
    Mismatch = 4,
    /// The disk is full, read-only, or failed: mend it and run again.
    InputOutput = 74,
    /// Stopped on request; run again to resume.
    Interrupted = 75,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// An error that knows how the program should end.
#[derive(Debug)]
pub struct Failure {
    /// The exit code.
    pub exit: Exit,
    /// Error that made the program fail; the chain of causes is printed.
    pub error: anyhow::Error,
}

impl Failure {
    /// An error with this exit code.
    pub fn new(exit: Exit, error: impl Into<anyhow::Error>) -> Self {
        Self { exit, error: error.into() }
    }

    /// A folder in which no dataset was begun.
    pub fn no_dataset(folder: &Path) -> Self {
        Self::from(without_manifest(folder))
    }

    /// A file of input that is none, or is not there, means 2; what the disk refuses means 74.
    pub fn of_input(error: impl Into<anyhow::Error>) -> Self {
        let error = error.into();
        let is_disk =
            |kind| !matches!(kind, io::ErrorKind::NotFound | io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData);
        let cause = error.chain().find_map(|cause| cause.downcast_ref::<io::Error>());
        let exit = if cause.is_some_and(|cause| is_disk(cause.kind())) { Exit::InputOutput } else { Exit::BadSpec };
        Self { exit, error }
    }

    /// A message with this exit code.
    pub fn message(exit: Exit, message: impl fmt::Display) -> Self {
        Self { exit, error: anyhow::anyhow!("{message}") }
    }
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    /// Input/output errors anywhere in the chain mean 74, a folder of another kind than the verb wants 2, all others 1.
    fn from(error: E) -> Self {
        let error = error.into();
        let is_foreign =
            |cause: &(dyn std::error::Error + 'static)| cause.downcast_ref().is_some_and(DatasetError::is_foreign);
        let exit = if error.chain().any(|cause| cause.is::<io::Error>()) {
            Exit::InputOutput
        } else if error.chain().any(is_foreign) {
            Exit::BadSpec
        } else {
            Exit::Failed
        };
        Self { exit, error }
    }
}
