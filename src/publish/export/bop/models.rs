//! Models of BOP: meshes in millimetres about the centre of their box, with sizes and symmetries.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Point3, Vector3};
use serde_json::{Map, Value, json};

use super::text::{MM, pretty};
use crate::export::{error::ExportError, target::Target};
use format::{
    dataset::{AssetRow, DatasetError, DatasetReader},
    extras::Shapes,
};
use kernel::{
    geom::{TriMesh, convex_hull_corners},
    ids::ObjectId,
};

/// Edges of an evaluation model are at most this share of its diameter, so that its vertices spread over its surface.
const LONGEST_EDGE: f64 = 0.02;

/// Maximum number of triangles of an evaluation model, unless the model itself has more.
const MAX_TRIANGLES: usize = 1 << 16;

/// A model of an object.
pub(super) struct Model {
    /// Number of the object, from 1.
    pub number: u32,
    /// Centre of the object's box in its own frame [m]: the origin of the model.
    pub centre: Vector3<f64>,
}

/// Writes the models; they are numbered in the order of the asset table.
///
/// # Errors
/// When a mesh or the symmetries of an object can't be read, or a file can't be written.
pub(super) fn write_models(
    reader: &DatasetReader,
    assets: &[AssetRow],
    target: &mut Target,
) -> Result<BTreeMap<ObjectId, Model>, ExportError> {
    let shapes = Shapes::open(reader.folder())?;
    let (mut models, mut infos, mut objects) = (BTreeMap::new(), Map::new(), Map::new());
    for (number, (index, row)) in (1..).zip(assets.iter().enumerate()) {
        let mesh = shapes.object(index)?.mesh;
        let Some(bounds) = mesh.aabb() else { continue };
        let (centre, diameter) = (bounds.centre().coords, diameter(&mesh));
        let fine = mesh.with_short_edges(LONGEST_EDGE * diameter, MAX_TRIANGLES.max(mesh.triangles.len()));
        for (folder, mesh) in [("models", &mesh), ("models_eval", &fine)] {
            target.write(&format!("{folder}/obj_{number:06}.ply"), &model_file(mesh, &centre))?;
        }
        let size = bounds.extents().map(|side| MM * side);
        let mut info = json!({
            "diameter": MM * diameter,
            "min_x": -size[0] / 2.0, "min_y": -size[1] / 2.0, "min_z": -size[2] / 2.0,
            "size_x": size[0], "size_y": size[1], "size_z": size[2],
        });
        let symmetries = symmetries(row, &centre).ok_or_else(|| invalid(reader, row))?;
        info.as_object_mut().expect("a table").extend(symmetries);
        infos.insert(number.to_string(), info);
        objects.insert(
            number.to_string(),
            json!({ "name": row.name, "object": row.object.to_string(), "centre": [centre.x, centre.y, centre.z] }),
        );
        models.insert(row.object, Model { number, centre });
    }
    for folder in ["models", "models_eval"] {
        target.write(&format!("{folder}/models_info.json"), pretty(&infos.clone().into()).as_bytes())?;
    }
    target.write("objects.json", pretty(&objects.into()).as_bytes())?;
    Ok(models)
}

/// Error for a row of the asset table with invalid symmetries.
fn invalid(reader: &DatasetReader, row: &AssetRow) -> ExportError {
    let path = reader.folder().path_of("assets.json");
    let problem = format!("the symmetries of {} are not rotations and axes", row.name);
    DatasetError::Invalid { path, problem, remedy: "`verify` the dataset" }.into()
}

/// Symmetries of an object about the centre of its box, in millimetres; empty for an object without symmetries, and `None` if its
/// row is invalid.
fn symmetries(row: &AssetRow, centre: &Vector3<f64>) -> Option<Map<String, Value>> {
    let mut found = Map::new();
    let Some(listed) = row.facts.get("symmetry") else { return Some(found) };
    let discrete = listed.get("symmetries_discrete")?.as_array()?.iter().map(|matrix| moved(matrix, centre));
    let discrete: Vec<Value> = discrete.collect::<Option<_>>()?;
    let continuous = listed.get("symmetries_continuous")?.as_array()?.iter().map(|axis| {
        let offset = (Vector3::from(numbers::<3>(axis.get("offset")?)?) - centre) * MM;
        Some(json!({ "axis": numbers::<3>(axis.get("axis")?)?, "offset": offset.as_slice() }))
    });
    let continuous: Vec<Value> = continuous.collect::<Option<_>>()?;
    for (key, list) in [("symmetries_discrete", discrete), ("symmetries_continuous", continuous)] {
        if !list.is_empty() {
            found.insert(key.to_owned(), list.into());
        }
    }
    Some(found)
}

/// Converts a motion of an object in its own frame [m], given as 16 numbers row by row, to another origin and millimetres.
fn moved(matrix: &Value, centre: &Vector3<f64>) -> Option<Value> {
    let rows = numbers::<16>(matrix)?;
    let rotation = Matrix3::new(rows[0], rows[1], rows[2], rows[4], rows[5], rows[6], rows[8], rows[9], rows[10]);
    let shift = Vector3::new(rows[3], rows[7], rows[11]);
    // q = p - c maps to R p + t - c = R q + (R c + t - c).
    let shift = (rotation * centre + shift - centre) * MM;
    let mut moved = rows;
    (moved[3], moved[7], moved[11]) = (shift.x, shift.y, shift.z);
    Some(json!(moved))
}

/// A list of finite numbers.
fn numbers<const N: usize>(value: &Value) -> Option<[f64; N]> {
    let read: Vec<f64> = value.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
    read.try_into().ok()
}

/// A mesh around its centre in millimetres, as binary PLY with vertex normals.
fn model_file(mesh: &TriMesh, centre: &Vector3<f64>) -> Vec<u8> {
    let mut normals = vec![Vector3::<f64>::zeros(); mesh.vertices.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(index);
        let normal = (b - a).cross(&(c - a));
        triangle.iter().for_each(|vertex| normals[*vertex as usize] += normal);
    }
    let mut text = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\n{}element face {}\nproperty list uchar int \
         vertex_indices\nend_header\n",
        mesh.vertices.len(),
        ["x", "y", "z", "nx", "ny", "nz"].map(|name| format!("property float {name}\n")).concat(),
        mesh.triangles.len()
    )
    .into_bytes();
    for (vertex, normal) in mesh.vertices.iter().zip(&normals) {
        let normal = normal.try_normalize(0.0).unwrap_or_else(Vector3::zeros);
        let moved = (0..3).map(|axis| MM * (f64::from(vertex[axis]) - centre[axis]));
        text.extend(moved.chain(normal.iter().copied()).flat_map(|value| (value as f32).to_le_bytes()));
    }
    for triangle in &mesh.triangles {
        text.push(3);
        text.extend(triangle.iter().flat_map(|vertex| (*vertex as i32).to_le_bytes()));
    }
    text
}

/// Largest distance between two vertices [m], found among the corners of the convex hull.
fn diameter(mesh: &TriMesh) -> f64 {
    let points: Vec<Point3<f64>> = mesh.vertices.iter().map(|vertex| vertex.map(f64::from).into()).collect();
    // A flat mesh has no hull.
    let corners = convex_hull_corners(&points).unwrap_or(points);
    let mut largest = 0.0f64;
    for (index, one) in corners.iter().enumerate() {
        for other in &corners[index + 1..] {
            largest = largest.max((one - other).norm_squared());
        }
    }
    largest.sqrt()
}
