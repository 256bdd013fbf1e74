//! Descriptions of robots, hands and scenes as text: MJCF and URDF.
//!
//! A [`DescriptionText`] is every element of a description with its position, and the files that it names; a
//! [`Description`] is its content as one digest. Both refuse texts that are not XML, that include themselves, or that
//! are larger than any robot, hand or scene ([`BOUNDS`]). MuJoCo compiles descriptions; this module does not depend on
//! it.

mod bounds;
mod document;
mod error;
mod packages;
mod statement;
mod sums;
#[cfg(test)]
mod tests;
mod xml;

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

pub use bounds::{BOUNDS, ElementBound, MAX_BYTES, MAX_DEPTH, MAX_ELEMENTS, MAX_FILES_DEEP, Rule};
pub use document::Format;
pub use error::{DescriptionError, TooLarge, missing_remedy};
pub use statement::{Place, Statement, section_of};

use document::Document;
use error::TABLE;

use crate::{files, ids::Digest};

/// Contents of a description and of the files that it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// The name that the description gives itself; MuJoCo's own default for a model without one.
    pub name: String,
    /// Digest of its text and of all files that it includes or takes meshes, height fields and textures from, in the
    /// order in which they are named. File names count as they are written in the text; folders do not count.
    pub digest: Digest,
}

impl Description {
    /// Reads a description and the files that it names.
    ///
    /// # Errors
    /// When a file can't be read, is no XML, includes itself, or needs too much memory or time.
    pub fn read(path: &Path) -> Result<Self, DescriptionError> {
        let document = Document::read(path)?;
        sums::check(&document)?;
        let (mut seen, mut digests) = (BTreeSet::from([path.to_owned()]), Vec::new());
        add_digests(&document, &mut seen, &mut digests)?;
        let parts = digests.iter().map(|digest| digest.0.as_slice());
        let digest = Digest::hash_parts([b"graspmill description".as_slice()].into_iter().chain(parts));
        Ok(Self { name: document.name.clone().unwrap_or_else(|| "MuJoCo Model".to_owned()), digest })
    }

    /// Reads a hand's description and the files that it names, and the table in the same folder, which has the same
    /// name and ends in `.toml`.
    ///
    /// # Errors
    /// Errors of [`Description::read`], and when the table can't be read.
    pub fn of_hand(path: &Path) -> Result<Self, DescriptionError> {
        let Self { name, digest } = Self::read(path)?;
        let table = path.with_extension(TABLE);
        let unreadable = |source| DescriptionError::Unreadable { path: table.clone(), by: None, source };
        let bytes = files::read(&table, files::Bound::HAND_TABLE).map_err(unreadable)?;
        let digest = Digest::hash_parts([b"graspmill hand".as_slice(), &digest.0, &Digest::hash(&bytes).0]);
        Ok(Self { name, digest })
    }
}

/// Appends the digests of a document's texts and files in the order in which they are named, each file once.
fn add_digests(
    document: &Document,
    seen: &mut BTreeSet<PathBuf>,
    digests: &mut Vec<Digest>,
) -> Result<(), DescriptionError> {
    let (mut texts, mut files) = (document.texts.iter().peekable(), document.files.iter().peekable());
    for statement in 0..=document.statements.len() {
        while let Some(text) = texts.next_if(|text| text.before == statement) {
            digests.push(text.digest);
        }
        while let Some(file) = files.next_if(|file| file.statement == statement) {
            if seen.insert(file.path.clone()) {
                let place = &document.statements[statement].place;
                let unreadable =
                    |source| DescriptionError::Unreadable { path: file.path.clone(), by: Some(place.clone()), source };
                let content = files::open_bounded(&file.path, files::Bound::DESCRIPTION_DATA).map_err(&unreadable)?;
                digests.push(Digest::hash_reader(content).map_err(unreadable)?.0);
            }
        }
        if let Some(model) = document.model(statement)
            && model.texts.first().is_some_and(|text| seen.insert(text.path.clone()))
        {
            add_digests(model, seen, digests)?;
        }
    }
    Ok(())
}

/// The elements of a description and the files that it names.
#[derive(Clone, Debug)]
pub struct DescriptionText {
    /// Kind of the description.
    pub format: Format,
    /// Elements of the description with those of the texts that it includes, parents before their children; then those of the models that it
    /// attaches, each model once.
    pub statements: Vec<Statement>,
    /// Files that elements of the description itself name: as they are written, and where they are.
    pub files: Vec<(String, PathBuf)>,
}

impl DescriptionText {
    /// Reads the texts of a description, and opens the other files that it names.
    ///
    /// # Errors
    /// Errors of [`Description::read`].
    pub fn read(path: &Path) -> Result<Self, DescriptionError> {
        let document = Document::read(path)?;
        sums::check(&document)?;
        let mut statements = document.statements.clone();
        for model in document.all_models() {
            let first = statements.len();
            let moved = |statement: &Statement| Statement {
                parent: statement.parent.map(|parent| first + parent),
                ..statement.clone()
            };
            statements.extend(model.statements.iter().map(moved));
            open_files(&model)?;
        }
        open_files(&document)?;
        let files = document.files.iter().map(|file| (file.written.clone(), file.path.clone())).collect();
        Ok(Self { format: document.format, statements, files })
    }
}

/// Opens the files that a document names: something that is no regular file is refused before MuJoCo waits for it.
fn open_files(document: &Document) -> Result<(), DescriptionError> {
    for file in &document.files {
        let unreadable = |source| DescriptionError::Unreadable {
            path: file.path.clone(),
            by: Some(document.statements[file.statement].place.clone()),
            source,
        };
        files::open_bounded(&file.path, files::Bound::DESCRIPTION_DATA).map_err(unreadable)?;
    }
    Ok(())
}
