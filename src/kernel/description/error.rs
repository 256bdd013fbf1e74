//! Reasons why a description cannot be used.

use std::{
    fmt, io,
    path::{Path, PathBuf},
};

use super::{bounds::MAX_DEPTH, statement::Place};
use crate::{remedy, words::Show};

/// Reason why a description cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum DescriptionError {
    /// A file that cannot be read.
    #[error("{} ({source}){}", path.shown(), named_by(by.as_ref()))]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Where another file names it; `None` for the description itself.
        by: Option<Place>,
        /// Reason of the refusal.
        source: io::Error,
    },
    /// A text that is no XML.
    #[error("{place}: {problem}")]
    Malformed {
        /// Where.
        place: Place,
        /// Problem with the text.
        problem: String,
    },
    /// More than any robot, hand or scene needs.
    #[error("{place}: {excess}")]
    TooLarge {
        /// The element that is too much.
        place: Place,
        /// Count, value or size that is too large.
        excess: TooLarge,
    },
    /// A file that includes or attaches itself, directly or through others.
    #[error("{place}: {} leads back to itself: {}", file.shown(), chain(files))]
    Cycle {
        /// The element that closes the cycle.
        place: Place,
        /// The file.
        file: PathBuf,
        /// The files from it to the one that names it again.
        files: Vec<PathBuf>,
    },
    /// A file of a package that is nowhere.
    #[error(
        "{place}: no folder is the package {package:?} of {uri:?}; looked for one of that name, or with a package.xml of that name, in {}",
        list(looked_in)
    )]
    NoPackage {
        /// The element that names the file.
        place: Place,
        /// The file as the description has it.
        uri: String,
        /// Name of the package.
        package: String,
        /// Folders that were looked into.
        looked_in: Vec<PathBuf>,
    },
}

/// Count, value or size of a description that is too large.
#[derive(Clone, Debug, PartialEq)]
pub enum TooLarge {
    /// Elements, copies included.
    Elements {
        /// Number so far.
        elements: f64,
        /// Largest number.
        most: f64,
    },
    /// Elements of one kind, copies included.
    Count {
        /// The kind, as in [`ElementBound::element`](super::ElementBound::element).
        element: &'static str,
        /// Number so far.
        count: f64,
        /// Largest number.
        most: f64,
    },
    /// Copies that one element makes.
    Copies {
        /// The element.
        element: String,
        /// The attribute that sets their number.
        attribute: String,
        /// Number of copies.
        copies: f64,
        /// Largest number.
        most: f64,
    },
    /// A number out of range.
    Value {
        /// The element.
        element: String,
        /// The attribute.
        attribute: String,
        /// Text of the attribute.
        value: String,
        /// Smallest and largest number.
        range: [f64; 2],
    },
    /// Numbers in one attribute.
    Numbers {
        /// The element.
        element: String,
        /// The attribute.
        attribute: String,
        /// Number of numbers.
        count: usize,
        /// Largest number of numbers.
        most: usize,
    },
    /// Memory that sizes and counts require.
    Memory {
        /// Memory so far [bytes].
        bytes: f64,
        /// Largest memory [bytes].
        most: f64,
    },
    /// Elements within elements.
    Depth,
    /// Files that include or attach each other in a row.
    Files {
        /// Largest number.
        most: usize,
    },
}

impl TooLarge {
    pub(super) fn at(self, place: &Place) -> DescriptionError {
        DescriptionError::TooLarge { place: place.clone(), excess: self }
    }

    fn remedy(&self) -> &'static str {
        match self {
            Self::Elements { .. } | Self::Count { .. } => "take out what no job needs, and lower counts of copies",
            Self::Copies { .. } | Self::Value { .. } => "write a number within the bound",
            Self::Numbers { .. } => "write fewer numbers",
            Self::Memory { .. } => {
                "lower the sizes of textures, height fields and user data, or take them out: no job needs them"
            }
            Self::Depth => "write it with less nesting",
            Self::Files { .. } => "put the files into one another with fewer steps",
        }
    }
}

impl fmt::Display for TooLarge {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Elements { elements, most } => {
                write!(f, "{elements:.0} elements with all copies, {most:.0} at most are accepted")
            }
            Self::Count { element, count, most } => {
                write!(f, "{count:.0} elements {element} with all copies, {most:.0} at most are accepted")
            }
            Self::Copies { element, attribute, copies, most } => {
                write!(f, "`{attribute}` of <{element}> makes {copies:.0} copies, {most:.0} at most are accepted")
            }
            Self::Value { element, attribute, value, range: [least, most] } => {
                let value = shortened(value);
                write!(f, "`{attribute}` of <{element}> is {value}, ")?;
                match least.is_finite() {
                    true => write!(f, "{least} to {most} is accepted"),
                    false => write!(f, "{most} at most is accepted"),
                }
            }
            Self::Numbers { element, attribute, count, most } => {
                write!(f, "`{attribute}` of <{element}> has {count} numbers, {most} at most are accepted")
            }
            Self::Memory { bytes, most } => {
                let megabytes = [bytes, most].map(|bytes| bytes / (1024.0 * 1024.0));
                write!(
                    f,
                    "sizes that need {:.0} MiB of memory, {:.0} MiB at most are accepted",
                    megabytes[0], megabytes[1]
                )
            }
            Self::Depth => write!(f, "more than {MAX_DEPTH} elements within each other"),
            Self::Files { most } => write!(f, "more than {most} files that include or attach each other in a row"),
        }
    }
}

impl DescriptionError {
    /// Remedy for the error, as a sentence for the user.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Unreadable { path, by, source } => match (source.kind(), by) {
                (io::ErrorKind::NotFound, Some(_)) => missing_remedy(path),
                (io::ErrorKind::NotFound, None) if path.extension().is_some_and(|ending| ending == TABLE) => {
                    "the table of a hand has the name of its description and ends in .toml: docs/hands.md"
                }
                (io::ErrorKind::NotFound, None) => "check the path: it starts at the job file's folder",
                _ => remedy::for_reading(source),
            },
            Self::Malformed { .. } => "correct the XML there",
            Self::TooLarge { excess, .. } => excess.remedy(),
            Self::Cycle { .. } => "take the statement out, or let it name another file",
            Self::NoPackage { .. } => {
                "put the description into its package's folder, or write the path relative to the description's folder"
            }
        }
    }
}

/// Ending of a hand's table.
pub(super) const TABLE: &str = "toml";

/// Remedy for a missing file that a robot's description names.
pub fn missing_remedy(file: &Path) -> &'static str {
    let parts: Vec<_> = file.components().map(|part| part.as_os_str()).collect();
    let fetched =
        parts.windows(2).any(|pair| pair[0] == ".deps" && ["fetch", "panda"].iter().any(|name| pair[1] == *name));
    if fetched { "run `make robots`, which fetches it" } else { "check meshdir and the file's name" }
}

fn named_by(by: Option<&Place>) -> String {
    by.map(|by| format!(", named by {by}")).unwrap_or_default()
}

fn chain(files: &[PathBuf]) -> String {
    files.iter().map(|file| file.shown().to_string()).collect::<Vec<_>>().join(" -> ")
}

fn list(folders: &[PathBuf]) -> String {
    folders.iter().map(|folder| folder.shown().to_string()).collect::<Vec<_>>().join(", ")
}

/// The beginning of a text that may be long.
fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    match text.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text.to_owned(),
    }
}
