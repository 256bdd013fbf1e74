//! A hand's table: TOML in the same folder as its description, with the motors of the joints and the contacts of the
//! hand.

mod fit;
mod spec;

use std::{
    path::{Path, PathBuf},
    sync::LazyLock,
};

use self::spec::HandTableSpec;
use super::{Hand, Skeleton};
use form::{Checker, FormErrors, Schema, decode, schema_of};
use kernel::{
    files::{self, Bound},
    words::Show,
};

static SCHEMA: LazyLock<Schema> = LazyLock::new(|| schema_of::<HandTableSpec>("table of a graspmill hand"));

/// A table as written, not yet compared with its description.
#[derive(Clone, Debug)]
pub struct HandTable {
    spec: HandTableSpec,
    checker: Checker,
}

/// Why a table makes no hand.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HandTableError {
    /// The file can't be read.
    #[error(
        "{}: {message}; a hand is an MJCF or URDF file and a table of the same name that ends in .toml (docs/hands.md)",
        file.shown()
    )]
    Unreadable {
        /// The table.
        file: PathBuf,
        /// The system's words.
        message: String,
    },
    /// Every mistake of the table, each with its location.
    #[error(transparent)]
    Mistakes(#[from] FormErrors),
}

impl HandTable {
    /// Path of a description's table: the same folder and name.
    pub fn beside(description: &Path) -> PathBuf {
        description.with_extension("toml")
    }

    /// Reads a table; its mistakes are reported together with those that only the description shows, by [`HandTable::hand`].
    ///
    /// # Errors
    /// When it can't be read.
    pub fn read(file: &Path) -> Result<Self, HandTableError> {
        let unreadable =
            |error: std::io::Error| HandTableError::Unreadable { file: file.to_owned(), message: error.to_string() };
        Self::parse(file, &files::read_text(file, Bound::HAND_TABLE).map_err(unreadable)?)
    }

    /// Parses a table from text; `file` is its name in messages.
    ///
    /// # Errors
    /// Its mistakes, where they leave nothing to compare with a description.
    pub fn parse(file: &Path, text: &str) -> Result<Self, HandTableError> {
        let (spec, checker) = decode(&file.display().to_string(), text, &[], &SCHEMA, &())?;
        Ok(Self { spec, checker })
    }

    /// The hand that table and description make.
    ///
    /// # Errors
    /// Every mistake of the table, when it has some or the two do not fit.
    pub fn hand(self, skeleton: Skeleton) -> Result<Hand, HandTableError> {
        Ok(fit::hand(&self.spec, self.checker, skeleton)?)
    }
}
