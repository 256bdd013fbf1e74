//! Meshes: built-in shapes, the YCB scans, and solids whose truth is known.

use std::{
    collections::HashMap,
    f64::consts::{PI, TAU},
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    assets::{MeshSource, built_in_source, list_folder, prepare},
    geom::TriMesh,
};

use super::files::{repository_path, stem};

/// A built-in shape as a job prepares it.
pub fn built_in_mesh(name: &str) -> TriMesh {
    prepare(&built_in_source(name)).expect("a built-in shape").mesh
}

/// The files of all 78 scans, sorted.
pub fn scan_files() -> Vec<PathBuf> {
    let folder = repository_path(".deps/ycb");
    let files = list_folder(&folder).unwrap_or_else(|error| panic!("{error}; `make setup` fetches the scans"));
    assert_eq!(files.len(), 78, "{}: run `make setup`", folder.display());
    files
}

/// The first scan whose name contains this.
pub fn scan_file(name: &str) -> PathBuf {
    let named = |file: &PathBuf| stem(file).contains(name);
    scan_files().into_iter().find(named).unwrap_or_else(|| panic!("no scan has {name} in its name"))
}

/// A scan as a job prepares it.
pub fn prepare_scan(file: &Path) -> TriMesh {
    prepare(&MeshSource::of_file(stem(file), file)).expect("a sound scan").mesh
}

/// Binary STL with equal positions merged. Does not use the library's reader, so that both can be compared.
pub fn read_stl(file: &Path) -> TriMesh {
    let bytes = fs::read(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let (mut mesh, mut known) = (TriMesh::default(), HashMap::new());
    for face in bytes[84..].chunks_exact(50) {
        // Adding zero makes -0 and 0 one number.
        let number = |at: usize| f32::from_le_bytes(face[at..at + 4].try_into().expect("four bytes")) + 0.0;
        let triangle: [u32; 3] = std::array::from_fn(|corner| {
            let position = [0, 4, 8].map(|offset| number(12 + 12 * corner + offset));
            *known.entry(position.map(f32::to_bits)).or_insert_with(|| {
                mesh.vertices.push(position);
                mesh.vertices.len() as u32 - 1
            })
        });
        mesh.triangles.push(triangle);
    }
    mesh
}

/// Writes a mesh as a binary STL.
pub fn write_stl(path: &Path, mesh: &TriMesh) {
    fs::write(path, stl_bytes(mesh)).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

/// A mesh as a binary STL.
pub fn stl_bytes(mesh: &TriMesh) -> Vec<u8> {
    let mut file = vec![0; 80];
    file.extend((mesh.triangles.len() as u32).to_le_bytes());
    for face in &mesh.triangles {
        file.extend([0; 12]);
        for vertex in face {
            file.extend(mesh.vertices[*vertex as usize].iter().flat_map(|part| part.to_le_bytes()));
        }
        file.extend([0; 2]);
    }
    file
}

/// A closed box wound outward.
pub fn block(low: [f32; 3], high: [f32; 3]) -> TriMesh {
    let corner =
        |corner: usize| std::array::from_fn(|axis| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriMesh { vertices: (0..8).map(corner).collect(), triangles }
}

/// A closed box about the origin, by its half sides.
pub fn centred_block(half: [f32; 3]) -> TriMesh {
    block(half.map(|side| -side), half)
}

/// A closed surface r(theta, phi) about the origin, wound outward: `rings` x `2 rings` quadrangles, so about 4 rings^2
/// triangles.
pub fn round(rings: usize, radius: impl Fn(f64, f64) -> f64) -> TriMesh {
    let around = 2 * rings;
    let point = |ring: usize, step: usize| {
        let (theta, phi) = (PI * ring as f64 / rings as f64, TAU * (step % around) as f64 / around as f64);
        let r = radius(theta, phi);
        [r * theta.sin() * phi.cos(), r * theta.sin() * phi.sin(), r * theta.cos()].map(|value| value as f32)
    };
    let mut vertices = vec![point(0, 0)];
    vertices.extend((1..rings).flat_map(|ring| (0..around).map(move |step| (ring, step))).map(|(r, s)| point(r, s)));
    vertices.push(point(rings, 0));
    let last = vertices.len() as u32 - 1;
    let vertex = |ring: usize, step: usize| (1 + (ring - 1) * around + step % around) as u32;
    let mut triangles = Vec::new();
    for step in 0..around {
        triangles.push([0, vertex(1, step), vertex(1, step + 1)]);
        triangles.push([last, vertex(rings - 1, step + 1), vertex(rings - 1, step)]);
        for ring in 1..rings - 1 {
            let (a, b) = (vertex(ring, step), vertex(ring, step + 1));
            let (c, d) = (vertex(ring + 1, step), vertex(ring + 1, step + 1));
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

/// An OFF file of a mesh [m].
pub fn off_of(mesh: &TriMesh) -> String {
    let corners = mesh.vertices.iter().map(|[x, y, z]| format!("{x} {y} {z}\n"));
    let triangles = mesh.triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n"));
    let rows: String = corners.chain(triangles).collect();
    format!("OFF\n{} {} 0\n{rows}", mesh.vertices.len(), mesh.triangles.len())
}

/// An OFF file of a tetrahedron with right angles at the origin [m].
pub fn tetrahedron_off(side: f64) -> String {
    format!("OFF\n4 4 6\n0 0 0\n{side} 0 0\n0 {side} 0\n0 0 {side}\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n")
}

/// An OFF file of a pyramid on a square of 0.1 m, with its top at these coordinates [m].
pub fn pyramid_off(top: [f64; 3]) -> String {
    let [x, y, z] = top;
    format!(
        "OFF\n5 6 0\n0 0 0\n.1 0 0\n.1 .1 0\n0 .1 0\n{x} {y} {z}\n3 0 2 1\n3 0 3 2\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n"
    )
}
