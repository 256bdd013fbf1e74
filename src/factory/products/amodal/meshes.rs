//! Objects of amodal pairs, out of the meshes beside the views, kept by all threads.

use std::{collections::BTreeMap, sync::Arc};

use serde::Deserialize;

use super::settings::{AmodalJob, AmodalSettings};
use crate::{ProduceError, products::pair::PairObject, recent::Recent};
use format::products::grasps::Shapes;
use kernel::{
    assets::{AssetRecord, PreparedMesh, object_id},
    geom::{RenderMesh, SimdLevel},
    ids::ObjectId,
    object::PreparedObject,
};

/// Objects that are kept, at most: about 5 MB each.
const KEPT: usize = 128;

/// An object, ready for pairs and for images of scenes.
pub(super) struct LoadedObject {
    /// Surface and solid.
    pub pair: PairObject,
    /// The surface with both its sides, as views are drawn.
    pub render: RenderMesh,
}

/// Objects of the views.
pub(super) struct LoadedObjects {
    shapes: Shapes,
    /// Index in the file of meshes of each object, and its row in the table of assets.
    rows: BTreeMap<ObjectId, (usize, AssetRecord)>,
    recent: Recent<LoadedObject>,
}

impl LoadedObjects {
    /// Opens the meshes beside the views.
    ///
    /// # Errors
    /// When they are missing, or a row of the table of assets is none.
    pub fn open(job: &AmodalJob) -> Result<Self, ProduceError> {
        let shapes = Shapes::open(&job.dataset)?;
        let mut records = Vec::new();
        for row in &job.views.assets {
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
            return Err(ProduceError::unusable(job.dataset.display().to_string(), cause));
        }
        let rows = records.into_iter().enumerate().map(|(index, record)| (record.object, (index, record))).collect();
        Ok(Self { shapes, rows, recent: Recent::new(KEPT) })
    }

    /// An object.
    ///
    /// # Errors
    /// When it is not among the meshes, or the mesh has another content.
    pub fn get(
        &self,
        object: ObjectId,
        settings: &AmodalSettings,
        level: SimdLevel,
    ) -> Result<Arc<LoadedObject>, ProduceError> {
        let unknown = || ProduceError::unusable(object.0.short(), "assets.json of the views does not name this object");
        let (index, record) = self.rows.get(&object).ok_or_else(unknown)?;
        self.recent.get(*index, || {
            let mesh = self.shapes.object(*index)?.mesh;
            let found = object_id(&mesh);
            if found != object {
                let (found, expected) = (found.0.short(), object.0.short());
                let cause =
                    format!("its mesh in shapes.mcap is of content {found}, not {expected}; make the views again");
                return Err(ProduceError::unusable(record.name.clone(), cause));
            }
            let render = RenderMesh::new(&mesh, false);
            let prepared = PreparedObject::from(PreparedMesh { mesh, record: record.clone() });
            let AmodalSettings { solid_with_surface, rules, channels, .. } = settings;
            Ok(LoadedObject {
                pair: PairObject::new(&prepared, *solid_with_surface, rules.truth, channels, level),
                render,
            })
        })
    }
}
