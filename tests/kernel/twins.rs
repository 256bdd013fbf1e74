//! Twins among scans: noise, pose and scale make no other shape, solid or thin-walled, and other shapes are no twins.

use graspmill::{
    geom::{TriMesh, rotation_from_rpy},
    seed::Stream,
    voxel::{InsideTest, ShapeDescriptor, twins},
};
use nalgebra::Vector3;

use crate::support::{
    files::stem,
    meshes::{built_in_mesh, prepare_scan, scan_file, scan_files},
};

/// Thin-walled: scans by a part of their names, and a goblet of our own, since no scan is a wine glass.
const THIN: [&str; 5] = ["024_bowl", "025_mug", "028_skillet_lid", "029_plate", "goblet-01"];

/// Solid; the scan of the pitcher is one, too.
const SOLID: [&str; 10] = [
    "003_cracker",
    "004_sugar",
    "006_mustard",
    "011_banana",
    "013_apple",
    "019_pitcher",
    "021_bleach",
    "035_power",
    "036_wood",
    "061_foam",
];

/// Standard deviations of the noise of each coordinate [m].
const NOISE: [f64; 5] = [2e-4, 4e-4, 6e-4, 8e-4, 1e-3];

fn mesh(name: &str) -> TriMesh {
    if name.starts_with(char::is_numeric) { prepare_scan(&scan_file(name)) } else { built_in_mesh(name) }
}

fn shape(mesh: &TriMesh) -> ShapeDescriptor {
    ShapeDescriptor::from_mesh(mesh, InsideTest::Crossings)
}

/// A copy whose vertices are moved by noise (sums of twelve uniform draws), turned, scaled and mirrored.
fn copy(mesh: &TriMesh, noise: f64, scale: f64, mirror: bool) -> TriMesh {
    let mut draw = Stream::of_job(3, b"", "noise of twins");
    let mut normal = || (0..12).map(|_| draw.unit()).sum::<f64>() - 6.0;
    let rotation = rotation_from_rpy(0.4, 1.1, -2.0);
    let mut copy = mesh.clone();
    for vertex in &mut copy.vertices {
        let mut point = Vector3::from(vertex.map(f64::from)).map(|part| part + noise * normal());
        point.x *= if mirror { -1.0 } else { 1.0 };
        *vertex = (rotation * point * scale + Vector3::new(0.3, -0.1, 0.0)).map(|part| part as f32).into();
    }
    if mirror {
        copy.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
    }
    copy
}

fn are_twins(a: &ShapeDescriptor, b: &ShapeDescriptor) -> bool {
    !twins(&[a.clone(), b.clone()], 0.85).is_empty()
}

#[test]
fn a_noisy_copy_is_a_twin() {
    for name in THIN.into_iter().chain(SOLID) {
        let mesh = mesh(name);
        let own = shape(&mesh);
        for noise in NOISE {
            let other = shape(&copy(&mesh, noise, 1.0, false));
            println!("{name}, noise of {:.1} mm: likeness {:.2}", 1e3 * noise, own.likeness(&other));
            assert!(are_twins(&own, &other), "{name} with noise of {noise} m");
        }
        assert!(are_twins(&own, &shape(&copy(&mesh, 0.0, 0.3, false))), "{name} turned and scaled");
    }
    // A mug has a plane of symmetry, so that its mirror image is the same mug.
    let mug = mesh("025_mug");
    assert!(are_twins(&shape(&mug), &shape(&copy(&mug, 8e-4, 1.0, true))), "the mirrored mug");
}

#[test]
fn noise_and_thin_walls_join_no_other_scans() {
    let paths = scan_files();
    let meshes: Vec<TriMesh> = paths.iter().map(|path| prepare_scan(path)).collect();
    let shapes: Vec<ShapeDescriptor> = meshes.iter().map(shape).collect();
    let groups = |shapes: &[ShapeDescriptor]| -> Vec<Vec<String>> {
        let names =
            |group: Vec<usize>| group.iter().map(|index| stem(&paths[index % paths.len()]).to_owned()).collect();
        twins(shapes, 0.85).into_iter().map(names).collect()
    };
    let own = groups(&shapes);
    // Groups of the 78 scans before skins were compared; ten nested cups of ten sizes are in none.
    let sizes: Vec<usize> = own.iter().map(Vec::len).collect();
    assert_eq!(sizes, [2, 3, 11, 2, 2, 2, 2], "{own:?}");
    assert!(!own.iter().flatten().any(|name| name.starts_with("065")), "{own:?}");
    // With a noisy copy of each thin scan added, the copies join their originals and nothing else.
    let thin: Vec<usize> =
        THIN.iter().filter_map(|name| paths.iter().position(|path| stem(path).starts_with(name))).collect();
    assert_eq!(thin.len(), 4);
    let mut more = shapes.clone();
    more.extend(thin.iter().map(|index| shape(&copy(&meshes[*index], 8e-4, 1.0, false))));
    let joined = twins(&more, 0.85);
    for (number, index) in thin.iter().enumerate() {
        assert!(joined.contains(&vec![*index, paths.len() + number]), "{}: {joined:?}", stem(&paths[*index]));
    }
    assert_eq!(joined.len(), own.len() + thin.len());
}
