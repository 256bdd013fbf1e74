//! Meshes of views, by object.

use std::{collections::BTreeMap, path::Path};

use serde::Deserialize;

use super::found::FoundViews;
use crate::ProduceError;
use assets::{AssetRecord, PreparedMesh, object::PreparedObject, object_id};
use format::extras::Shapes;
use kernel::{files::Folder, ids::ObjectId};

/// Meshes of views.
pub struct ViewMeshes {
    shapes: Shapes,
    /// Index in the file of meshes of each object, and its row in the table of assets.
    rows: BTreeMap<ObjectId, (usize, AssetRecord)>,
}

impl ViewMeshes {
    /// Opens the meshes of the views in a folder.
    ///
    /// # Errors
    /// When they are missing, or a row of the table of assets is invalid.
    pub fn open(dataset: &Path, views: &FoundViews) -> Result<Self, ProduceError> {
        let shapes = Shapes::open(&Folder::at(dataset))?;
        let mut records = Vec::new();
        for row in &views.assets {
            let name = row["name"].as_str().unwrap_or_default();
            let record = AssetRecord::deserialize(row).map_err(|error| ProduceError::unusable(name, error))?;
            records.push(record);
        }
        records.sort_by_key(|record| record.object);
        if shapes.objects() != records.len() {
            let cause = format!(
                "shapes.mcap has {} meshes, assets.json names {}; `verify` the dataset, and make it again",
                shapes.objects(),
                records.len()
            );
            return Err(ProduceError::unusable(dataset.display().to_string(), cause));
        }
        let rows = records.into_iter().enumerate().map(|(index, record)| (record.object, (index, record))).collect();
        Ok(Self { shapes, rows })
    }

    /// Index of an object among the meshes.
    ///
    /// # Errors
    /// When it is not among them.
    pub fn index_of(&self, object: ObjectId) -> Result<usize, ProduceError> {
        let unknown = || ProduceError::unusable(object.0.short(), "assets.json of the views does not name this object");
        self.rows.get(&object).map(|(index, _)| *index).ok_or_else(unknown)
    }

    /// An object with its mesh.
    ///
    /// # Errors
    /// When it is not among the meshes, or the mesh has another content.
    pub fn prepared(&self, object: ObjectId) -> Result<PreparedObject, ProduceError> {
        let index = self.index_of(object)?;
        let (_, record) = &self.rows[&object];
        let mesh = self.shapes.object(index)?.mesh;
        let found = object_id(&mesh);
        if found != object {
            let (found, expected) = (found.0.short(), object.0.short());
            let cause = format!("its mesh in shapes.mcap is of content {found}, not {expected}; make the views again");
            return Err(ProduceError::unusable(record.name.clone(), cause));
        }
        Ok(PreparedObject::from(PreparedMesh { mesh, record: record.clone() }))
    }
}
