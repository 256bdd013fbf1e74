//! Objects of the scenes of a dataset, for inspections and pages.

use std::fmt;

use serde::{Deserialize, Serialize};

use format::dataset::{DatasetError, DatasetReader};
use kernel::{
    ids::ObjectId,
    words::{Show, Split},
};

/// An object of the scenes of a dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScenesObject {
    /// Name in the job of the scenes.
    pub name: String,
    /// The object by content.
    pub object: ObjectId,
    /// Split of its scenes.
    pub split: Option<Split>,
}

impl ScenesObject {
    /// The objects of a dataset, sorted by name.
    pub(crate) fn all(reader: &DatasetReader) -> Result<Vec<Self>, DatasetError> {
        let objects = reader.assets()?.objects.into_iter().map(|row| Self {
            split: reader.splits().object(&row.object).map(|split| split.split),
            name: row.name,
            object: row.object,
        });
        let mut objects: Vec<Self> = objects.collect();
        objects.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(objects)
    }

    /// The name of one of these objects.
    pub(crate) fn name_of(objects: &[Self], object: ObjectId) -> &str {
        objects.iter().find(|row| row.object == object).map_or("?", |row| row.name.as_str())
    }

    /// Writes a table of these objects: name and split.
    pub(crate) fn write_all(objects: &[Self], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wide = objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        writeln!(f, "\n{:<wide$}  split", "object")?;
        for Self { name, split, .. } in objects {
            writeln!(f, "{:<wide$}  {}", name.shown(), split.map_or("", Split::name))?;
        }
        Ok(())
    }

    /// Rows of a page: name and split.
    pub(crate) fn rows(objects: &[Self]) -> Vec<[String; 2]> {
        let row = |object: &Self| [object.name.clone(), object.split.map_or("", Split::name).to_owned()];
        objects.iter().map(row).collect()
    }
}
