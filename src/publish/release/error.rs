//! Why a release was not made.

use std::{io, path::PathBuf};

use crate::preview::PreviewError;
use form::FormErrors;
use format::dataset::DatasetError;
use kernel::words::Show;

/// Reason why a release was not made; no files are left.
#[derive(Debug, thiserror::Error)]
pub enum ReleaseError {
    /// The dataset is not finished, the release's folder is not empty, or a file can't be read or written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The preview cannot be drawn.
    #[error(transparent)]
    Preview(#[from] PreviewError),
    /// The about file does not exist or can't be read.
    #[error("{}: {source}; give the file with title, licence and authors with `--about` (docs/releases.md)", path.shown())]
    NoAbout {
        /// The path given.
        path: PathBuf,
        /// Cause.
        source: io::Error,
    },
    /// The about file has mistakes.
    #[error("\n{}", _0.render().trim_end())]
    About(FormErrors),
    /// The dataset does not match its manifest.
    #[error("{}: not intact ({problems} problems): {first}", folder.shown())]
    NotIntact {
        /// The dataset's folder.
        folder: PathBuf,
        /// Count of problems.
        problems: usize,
        /// The first of them, with its remedy.
        first: String,
    },
    /// A part of the release may not be shared.
    #[error(
        "this release may not be shipped:\n{}\nstate the permissions in {}, section [licences] (docs/releases.md), or leave these files out with --recipe", assets.join("\n"), about.shown()
    )]
    MayNotShip {
        /// One line per asset, with its name and the reason.
        assets: Vec<String>,
        /// The about file.
        about: PathBuf,
    },
    /// A recipe was requested, but everything may be shipped.
    #[error("everything in {} may be shipped: leave out --recipe", folder.shown())]
    NothingToLeaveOut {
        /// The dataset's folder.
        folder: PathBuf,
    },
}
