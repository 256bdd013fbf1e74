//! The asset table of a finished dataset, and its job, as stored on disk.

use serde::Deserialize;

use super::{
    DatasetError, DatasetReader,
    layout::{ASSETS, JOB},
};
use kernel::{files::Bound, ids::ObjectId};

/// `assets.json`: the objects, sorted by id, the hands that touched, and the meshes that could not be used.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct AssetTable {
    /// One row per object.
    pub objects: Vec<AssetRow>,
    /// One row per subject that is not an object, such as the scenes of a split; empty where the objects are the subjects.
    #[serde(default)]
    pub subjects: Vec<AssetRow>,
    /// One row per hand; empty without touch by hands.
    #[serde(default)]
    pub hands: Vec<AssetRow>,
    /// One row per container of scenes that is a mesh; may be empty.
    #[serde(default)]
    pub containers: Vec<AssetRow>,
    /// Refused meshes, in any form.
    pub refused: Vec<serde_json::Value>,
}

/// One object, hand or container: the fields that every row has, and further fields.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct AssetRow {
    /// Digest of the object, hand or container.
    pub object: ObjectId,
    /// Name in the job.
    pub name: String,
    /// Further fields, by name; they depend on the program that wrote the dataset.
    #[serde(flatten)]
    pub facts: serde_json::Map<String, serde_json::Value>,
}

impl AssetRow {
    /// The row as it is in the file.
    pub fn whole(&self) -> serde_json::Value {
        let mut row = self.facts.clone();
        row.insert("object".to_owned(), self.object.to_string().into());
        row.insert("name".to_owned(), self.name.clone().into());
        row.into()
    }
}

impl DatasetReader {
    /// Reads the asset table.
    ///
    /// # Errors
    /// When it is missing or damaged.
    pub fn assets(&self) -> Result<AssetTable, DatasetError> {
        let path = self.folder().path_of(ASSETS);
        let text = self.folder().read(ASSETS, Bound::DATASET_TABLE).map_err(DatasetError::io("reading", &path))?;
        serde_json::from_slice(&text).map_err(|error| DatasetError::Invalid {
            path,
            problem: error.to_string(),
            remedy: "delete manifest.json and `run` the job again: the shards are kept",
        })
    }

    /// Reads the resolved job, as text.
    ///
    /// # Errors
    /// When it is missing or not text.
    pub fn job_text(&self) -> Result<String, DatasetError> {
        let text = self.folder().read_text(JOB, Bound::JOB);
        text.map_err(DatasetError::io("reading", &self.folder().path_of(JOB)))
    }
}
