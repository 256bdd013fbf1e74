//! Reasons why a text states no camera.

use std::borrow::Cow;

/// Remedy for numbers on the command line.
pub(super) const NUMBERS: &str = "give fx,fy,cx,cy in pixels, as 615.2,615.4,320.1,239.7, or a file";

/// Why a text or a file states no camera.
#[derive(Debug, thiserror::Error)]
#[error("intrinsics {origin}: {problem}")]
pub struct CameraError {
    /// The file, or the text itself.
    pub origin: String,
    /// The fault in it.
    #[source]
    pub problem: CameraProblem,
}

/// A fault in a description of a camera.
#[derive(Debug, thiserror::Error)]
pub enum CameraProblem {
    /// The file cannot be read.
    #[error("{NUMBERS}: the file cannot be read")]
    Io(#[from] std::io::Error),
    /// The content is no camera's, or none that is understood.
    #[error("at {place}: {found}; {remedy}")]
    Content {
        /// Where in the text.
        place: String,
        /// Words or numbers found there.
        found: String,
        /// Remedy, as an instruction.
        remedy: Cow<'static, str>,
    },
}

impl CameraProblem {
    pub(super) fn content(place: impl ToString, found: impl ToString, remedy: impl Into<Cow<'static, str>>) -> Self {
        Self::Content { place: place.to_string(), found: found.to_string(), remedy: remedy.into() }
    }
}
