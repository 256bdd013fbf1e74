//! The per-view chain against rays in double precision, closed forms and brute force, on real scans and made shapes, at
//! every SIMD level.

mod depth;
mod grids;
mod thesis;

use std::{collections::HashMap, path::Path};

use graspmill::geom::{CameraCv, Object, Pose, TriMesh, rotation_from_rpy};
use nalgebra::{Point3, Vector3};

use crate::support::{
    files::stem,
    meshes::{read_stl, scan_files},
};

/// View `index` of a fixed list that begins with the six head-on views: the object rotated about `centre`, which lies
/// `distance` metres away on the optical axis.
fn pose(index: usize, centre: Point3<f64>, distance: f64) -> Pose<CameraCv, Object> {
    let quarter = std::f64::consts::FRAC_PI_2;
    let k = index as f64;
    let (roll, pitch, yaw) = match index {
        0..4 => (0.0, k * quarter, 0.0),
        4 | 5 => (quarter * (2.0 * k - 9.0), 0.0, 0.0),
        _ => (k * 2.399, (k * 0.754).sin() * 1.3, k * 1.117),
    };
    let rotation = rotation_from_rpy(roll, pitch, yaw);
    Pose::new(rotation, Vector3::new(0.0, 0.0, distance) - rotation * centre.coords)
}

/// Every `step`th scan with its name.
fn read_scans(step: usize) -> Vec<(String, TriMesh)> {
    scan_files().iter().step_by(step).map(|file| (stem(file), read_scan(file))).collect()
}

/// A scan without the pairs of faces on the same three vertices.
fn read_scan(file: &Path) -> TriMesh {
    let mut mesh = read_stl(file);
    let key = |triangle: &[u32; 3]| {
        let mut key = *triangle;
        key.sort_unstable();
        key
    };
    let mut counts: HashMap<[u32; 3], usize> = HashMap::new();
    for triangle in &mesh.triangles {
        *counts.entry(key(triangle)).or_default() += 1;
    }
    mesh.triangles.retain(|triangle| counts[&key(triangle)] == 1);
    mesh
}
