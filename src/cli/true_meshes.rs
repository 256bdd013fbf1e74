//! Meshes of the objects as the true surfaces.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use super::{
    exit::{Exit, Failure},
    stored_samples::{StoredSample, listed},
};
use assets::{MeshSource, built_in_source, list_folder, prepare};
use format::dataset::{AssetRow, DatasetReader};
use kernel::{
    geom::TriMesh,
    ids::{ObjectId, SampleIndex},
    words::Show,
};
use nalgebra::Point3;

/// Meshes by object.
pub struct TrueMeshes(BTreeMap<ObjectId, TriMesh>);

impl TrueMeshes {
    /// Finds the mesh of every object of these samples: a built-in shape, or a file with the object's name in the folder. Its
    /// content is compared with the dataset's.
    pub fn new(folder: &Path, reader: &DatasetReader, chosen: &[SampleIndex]) -> Result<Self, Failure> {
        let objects = chosen.iter().map(|index| Ok::<_, Failure>(listed(reader, *index)?.object()?));
        let wanted = objects.collect::<Result<BTreeSet<ObjectId>, Failure>>()?;
        let files = list_folder(folder).map_err(Failure::of_input)?;
        let mut meshes = BTreeMap::new();
        for row in reader.assets()?.objects.iter().filter(|row| wanted.contains(&row.object)) {
            let source = source_of(row, &files).ok_or_else(|| {
                let (folder, name) = (folder.shown(), &row.name);
                Failure::message(
                    Exit::BadSpec,
                    format!("--truth {folder}: no file has the name of the dataset's object {name}"),
                )
            })?;
            let prepared = prepare(&source).map_err(|refusal| Failure::of_input(anyhow::anyhow!("{refusal}")))?;
            if prepared.record.object != row.object {
                let message = format!(
                    "--truth {}: the mesh is {}, but the dataset's object {} is {}: give the meshes from which the dataset was made",
                    source.origin, prepared.record.object, row.name, row.object
                );
                return Err(Failure::message(Exit::BadSpec, message));
            }
            meshes.insert(row.object, prepared.mesh);
        }
        Ok(Self(meshes))
    }

    /// Mesh of a sample's object in the camera's frame.
    pub fn in_camera(&self, sample: &StoredSample) -> TriMesh {
        let pose = &sample.pair.camera_from_object;
        let mesh = &self.0[&sample.object];
        let place = |vertex: &[f32; 3]| {
            let point = pose.point(&Point3::from(vertex.map(f64::from)));
            [point.x as f32, point.y as f32, point.z as f32]
        };
        TriMesh { vertices: mesh.vertices.iter().map(place).collect(), triangles: mesh.triangles.clone() }
    }
}

fn source_of(row: &AssetRow, files: &[std::path::PathBuf]) -> Option<MeshSource> {
    // Built-in shapes have no file.
    if row.facts.get("file").is_some_and(serde_json::Value::is_null) {
        return Some(built_in_source(&row.name));
    }
    let file = files.iter().find(|file| file.file_stem().is_some_and(|stem| *stem == *row.name))?;
    Some(MeshSource::of_file(row.name.clone(), file))
}
