//! A few pictures of a dataset as PNG files, from the report's own drawing code.

use crate::{picture::Picture, product::Survey};
use format::dataset::{DatasetError, DatasetReader};

/// A picture with its caption.
pub(super) struct Shown {
    /// Path in the release's folder.
    pub path: String,
    /// Caption in plain text.
    pub caption: String,
    /// The picture.
    pub picture: Picture,
}

/// The pictures of a dataset.
pub(super) fn pictures(reader: &DatasetReader, survey: &dyn Survey) -> Result<Vec<Shown>, DatasetError> {
    let named = survey.pictures(reader)?.into_iter().enumerate().map(|(index, (caption, picture))| {
        let path = format!("pictures/{}.png", index + 1);
        Shown { path, caption, picture }
    });
    Ok(named.collect())
}
