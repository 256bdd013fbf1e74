//! Why a release was not made.

use std::{io, path::PathBuf};

use crate::preview::PreviewError;
use form::FormErrors;
use format::dataset::DatasetError;
use kernel::words::Show;

/// Why a release was not made; nothing is left of it.
#[derive(Debug, thiserror::Error)]
pub enum ReleaseError {
    /// The dataset is not finished, the release's folder holds something, or a file can't be read or written.
    #[error(transparent)]
    Dataset(#[from] DatasetError),
    /// The preview cannot be drawn.
    #[error(transparent)]
    Preview(#[from] PreviewError),
    /// There is no about file, or it can't be read.
    #[error("{}: {source}; `--about` names the file that says title, licence and authors (docs/releases.md)", path.shown())]
    NoAbout {
        /// The path given.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The about file has mistakes.
    #[error("\n{}", _0.render().trim_end())]
    About(FormErrors),
    /// The dataset is not what its manifest says.
    #[error("{}: not intact ({problems} problems): {first}", folder.shown())]
    NotIntact {
        /// The dataset's folder.
        folder: PathBuf,
        /// Count of problems.
        problems: usize,
        /// The first of them, with its remedy.
        first: String,
    },
    /// Something may not be given on.
    #[error(
        "this release may not be shipped:\n{}\nstate what holds in {}, section [licences] (docs/releases.md), \
         or leave out what may not be shipped with --recipe", assets.join("\n"), about.shown()
    )]
    MayNotShip {
        /// One line an asset: its name and why not.
        assets: Vec<String>,
        /// The about file.
        about: PathBuf,
    },
    /// A recipe was asked for, and everything may be shipped.
    #[error("everything in {} may be shipped: leave --recipe away", folder.shown())]
    NothingToLeaveOut {
        /// The dataset's folder.
        folder: PathBuf,
    },
}
