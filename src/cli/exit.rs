//! Exit codes, and the mapping from errors to exit codes.

use std::{fmt, io, process::ExitCode};

use rustix::io::Errno;

use format::dataset::{DatasetError, without_manifest};
use kernel::files::{FileRefusal, Folder};

/// Exit codes of the program: a contract with scripts and schedulers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// The requested result is complete.
    Complete = 0,
    /// A failure without a code of its own.
    Failed = 1,
    /// The job file or the arguments are wrong.
    BadSpec = 2,
    /// The result is complete, but meshes or objects were refused, or no sample was kept.
    Refused = 3,
    /// A check found a difference.
    Mismatch = 4,
    /// The disk is full, read-only, or failed: fix it and run again.
    InputOutput = 74,
    /// Stopped on request; run again to resume.
    Interrupted = 75,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// An error with the exit code of the program.
#[derive(Debug)]
pub struct Failure {
    /// The exit code.
    pub exit: Exit,
    /// Error that made the program fail; the chain of causes is printed.
    pub error: anyhow::Error,
}

impl Failure {
    /// Creates an error with this exit code, or with 74 if its cause is a disk failure.
    pub fn new(exit: Exit, error: impl Into<anyhow::Error>) -> Self {
        let error = error.into();
        let exit = if io_causes(&error).any(is_disk_failure) { Exit::InputOutput } else { exit };
        Self { exit, error }
    }

    /// Error for a folder without a dataset.
    pub fn no_dataset(folder: &Folder) -> Self {
        Self::from(without_manifest(folder))
    }

    /// The error with its causes. Many messages already include their cause, before the remedy.
    pub fn text(&self) -> String {
        let mut text = self.error.to_string();
        for cause in self.error.chain().skip(1).map(ToString::to_string) {
            if !text.contains(&cause) {
                text = format!("{text}: {cause}");
            }
        }
        text
    }

    /// Maps a missing or invalid input file to 2 and a disk failure to 74.
    pub fn of_input(error: impl Into<anyhow::Error>) -> Self {
        let error = error.into();
        let is_wrong =
            |kind| matches!(kind, io::ErrorKind::NotFound | io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData);
        let is_disk = io_causes(&error).next().is_some_and(|cause| !is_wrong(cause.kind()));
        Self::new(if is_disk { Exit::InputOutput } else { Exit::BadSpec }, error)
    }

    /// Creates an error from a message with this exit code.
    pub fn message(exit: Exit, message: impl fmt::Display) -> Self {
        Self { exit, error: anyhow::anyhow!("{message}") }
    }
}

impl<E: Into<anyhow::Error>> From<E> for Failure {
    /// Maps input/output errors anywhere in the chain to 74, refused files and folders of the wrong kind to 2, all others to 1.
    fn from(error: E) -> Self {
        let error = error.into();
        let is_foreign =
            |cause: &(dyn std::error::Error + 'static)| cause.downcast_ref().is_some_and(DatasetError::is_foreign);
        let exit = match io_causes(&error).next() {
            Some(cause) if FileRefusal::find_in(cause).is_some() => Exit::BadSpec,
            Some(_) => Exit::InputOutput,
            None if error.chain().any(is_foreign) => Exit::BadSpec,
            None => Exit::Failed,
        };
        Self::new(exit, error)
    }
}

/// Operating-system errors among the causes of an error.
fn io_causes(error: &anyhow::Error) -> impl Iterator<Item = &io::Error> {
    error.chain().filter_map(|cause| cause.downcast_ref())
}

/// Whether a disk is full, over a quota or a limit, read-only or broken.
fn is_disk_failure(error: &io::Error) -> bool {
    const CODES: [Errno; 7] =
        [Errno::NOSPC, Errno::DQUOT, Errno::FBIG, Errno::ROFS, Errno::IO, Errno::STALE, Errno::NODEV];
    let is_code = |code| CODES.iter().any(|known| known.raw_os_error() == code);
    // Libraries that wrap an error may keep only its kind.
    error.raw_os_error().is_some_and(is_code)
        || matches!(
            error.kind(),
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::ReadOnlyFilesystem
        )
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use factory::{ProduceError, RunError};

    use super::*;
    use crate::jobs::run_failure;

    fn stored(error: io::Error) -> RunError {
        RunError::Produce(ProduceError::Store(DatasetError::io("writing", Path::new("shard"))(error)))
    }

    #[test]
    fn a_disk_that_fails_means_74_wherever_it_is_met() {
        for errno in [Errno::NOSPC, Errno::DQUOT, Errno::FBIG, Errno::ROFS, Errno::IO] {
            let error = || io::Error::from(errno);
            let gone = ProduceError::gone(DatasetError::io("reading", Path::new("mesh"))(error()));
            let mcap = DatasetError::mcap("writing", Path::new("shapes.mcap"));
            for failure in [
                run_failure(stored(error())),
                run_failure(RunError::Produce(gone)),
                run_failure(RunError::Dataset(mcap(error().into()))),
                Failure::new(Exit::BadSpec, error()),
                Failure::of_input(anyhow::Error::new(error()).context("job.toml")),
                Failure::from(io::Error::new(error().kind(), error())),
            ] {
                assert_eq!(failure.exit, Exit::InputOutput, "{errno:?}: {:?}", failure.error);
            }
        }
    }

    #[test]
    fn other_errors_keep_their_code() {
        let denied = || io::Error::from(io::ErrorKind::PermissionDenied);
        let absent = || io::Error::from(io::ErrorKind::NotFound);
        let link = || io::Error::from(FileRefusal::Link { path: "report.html".into() });
        for (failure, exit) in [
            (run_failure(stored(denied())), Exit::InputOutput),
            (run_failure(stored(absent())), Exit::InputOutput),
            (run_failure(stored(link())), Exit::BadSpec),
            (run_failure(RunError::Produce(ProduceError::gone(absent()))), Exit::Failed),
            (run_failure(RunError::Interrupted), Exit::Interrupted),
            (Failure::new(Exit::BadSpec, denied()), Exit::BadSpec),
            (Failure::of_input(absent()), Exit::BadSpec),
            (Failure::of_input(denied()), Exit::InputOutput),
        ] {
            assert_eq!(failure.exit, exit, "{:?}", failure.error);
        }
    }
}
