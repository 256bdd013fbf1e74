//! Meshes for the tests: the YCB scans and shapes whose truth is known.

use std::{collections::HashMap, fs, path::PathBuf};

use graspmill::geom::TriMesh;

/// Every `step`th scan with its name: equal positions merged, pairs of faces on the same three vertices dropped.
pub fn scans(step: usize) -> Vec<(String, TriMesh)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(".deps/ycb");
    let mut paths: Vec<_> = fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("{}: {error}; run `make setup`", folder.display()))
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "stl"))
        .collect();
    paths.sort();
    assert_eq!(paths.len(), 78, "{}: run `make setup`", folder.display());
    paths
        .into_iter()
        .step_by(step)
        .map(|path| (path.file_stem().unwrap().to_string_lossy().into(), scan(&path)))
        .collect()
}

fn scan(path: &PathBuf) -> TriMesh {
    let bytes = fs::read(path).expect("a scan");
    let mut places = HashMap::new();
    let mut mesh = TriMesh::default();
    for face in bytes[84..].chunks_exact(50) {
        let number = |at: usize| f32::from_le_bytes(face[at..at + 4].try_into().unwrap()) + 0.0;
        let triangle: [u32; 3] = std::array::from_fn(|corner| {
            let position = [0, 4, 8].map(|offset| number(12 + 12 * corner + offset));
            *places.entry(position.map(f32::to_bits)).or_insert_with(|| {
                mesh.vertices.push(position);
                mesh.vertices.len() as u32 - 1
            })
        });
        mesh.triangles.push(triangle);
    }
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

/// A closed box wound outward.
pub fn block(low: [f32; 3], high: [f32; 3]) -> TriMesh {
    let vertices = (0..8)
        .map(|corner| std::array::from_fn(|axis| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] }))
        .collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { vertices, triangles }
}

/// A closed surface r(theta, phi) about the origin, wound outward: `rings` x `2 rings` quadrangles, so about 4 rings^2
/// triangles.
pub fn round(rings: usize, radius: impl Fn(f64, f64) -> f64) -> TriMesh {
    let around = 2 * rings;
    let point = |ring: usize, step: usize| {
        let (theta, phi) = (
            std::f64::consts::PI * ring as f64 / rings as f64,
            std::f64::consts::TAU * (step % around) as f64 / around as f64,
        );
        let r = radius(theta, phi);
        [r * theta.sin() * phi.cos(), r * theta.sin() * phi.sin(), r * theta.cos()].map(|value| value as f32)
    };
    let mut vertices = vec![point(0, 0)];
    vertices.extend((1..rings).flat_map(|ring| (0..around).map(move |step| (ring, step))).map(|(r, s)| point(r, s)));
    vertices.push(point(rings, 0));
    let (last, place) =
        (vertices.len() as u32 - 1, |ring: usize, step: usize| (1 + (ring - 1) * around + step % around) as u32);
    let mut triangles = Vec::new();
    for step in 0..around {
        triangles.push([0, place(1, step), place(1, step + 1)]);
        triangles.push([last, place(rings - 1, step + 1), place(rings - 1, step)]);
        for ring in 1..rings - 1 {
            let (a, b) = (place(ring, step), place(ring, step + 1));
            let (c, d) = (place(ring + 1, step), place(ring + 1, step + 1));
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    TriMesh { vertices, triangles }
}

/// A bumpy, closed shape of about 13 x 10 x 19 cm.
pub fn bumpy(rings: usize) -> TriMesh {
    let mut mesh = round(rings, |theta, phi| {
        let [x, y, z] = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
        0.055 * (1.0 + 0.18 * (8.5 * x + 1.0).sin() * (6.0 * y).sin() + 0.12 * (9.0 * z + 3.0 * x).cos())
    });
    for vertex in &mut mesh.vertices {
        vertex[1] *= 0.8;
        vertex[2] *= 1.5;
    }
    mesh
}
