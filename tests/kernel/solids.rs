//! Solid grids, binvox files and mesh queries against closed forms, trimesh and libigl.

#![expect(clippy::print_stdout, reason = "figures to read with --nocapture")]

use std::{f64::consts::PI, fs, path::PathBuf};

use graspmill::{
    geom::{MassProperties, MeshQuery, OccupancyGrid, RestingPose, SolidGrid, TriMesh, every_resting_pose},
    voxel::{Binvox, InsideTest, ShapeDescriptor, solid_occupancy, solid_to_binvox, twins},
};
use nalgebra::{Point3, Vector3};
use serde::{Deserialize, de::DeserializeOwned};
use serde_json::json;

use crate::support::{
    files::stem,
    meshes::{centred_block, prepare_scan, scan_file, scan_files},
    program::Program,
    workspace::Workspace,
};

/// A scan as a job prepares it, by a part of its name.
fn scan(name: &str) -> TriMesh {
    prepare_scan(&scan_file(name))
}

/// A folder of cases for tests/peers/solid.py.
struct Cases {
    folder: Workspace,
    listed: Vec<serde_json::Value>,
}

impl Cases {
    fn new() -> Self {
        Self { folder: Workspace::new(), listed: Vec::new() }
    }

    fn file(&self, name: &str, ending: &str) -> PathBuf {
        self.folder.path(format!("{name}.{ending}"))
    }

    fn add(&mut self, name: &str, mesh: &TriMesh, grid: &SolidGrid) {
        let bytes = |words: &mut dyn Iterator<Item = [u8; 4]>| words.flatten().collect::<Vec<u8>>();
        let vertices = bytes(&mut mesh.vertices.iter().flatten().map(|value| value.to_le_bytes()));
        let triangles = bytes(&mut mesh.triangles.iter().flatten().map(|value| value.to_le_bytes()));
        fs::write(self.file(name, "vertices"), vertices).unwrap();
        fs::write(self.file(name, "triangles"), triangles).unwrap();
        let words: Vec<u8> = grid.words.iter().flat_map(|word| word.to_le_bytes()).collect();
        fs::write(self.file(name, "words"), words).unwrap();
        let origin: [f64; 3] = grid.origin.into();
        self.listed.push(json!({ "name": name, "origin": origin, "pitch": grid.pitch }));
    }

    fn ask<T: DeserializeOwned>(&self, what: &str, more: &[&str]) -> Vec<T> {
        self.folder.write("cases.json", serde_json::to_vec(&self.listed).unwrap());
        ask_peer(what).arg(self.folder.folder()).args(more).succeed().json_lines()
    }
}

fn ask_peer(what: &str) -> Program {
    Program::python().args(["tests/peers/solid.py", what])
}

// Closed forms.

/// A closed surface over a periodic grid of points; `at(i, j)` with i, j in 0..1, outward when di x dj is.
fn closed_surface(n: usize, at: impl Fn(f64, f64) -> [f64; 3]) -> TriMesh {
    let vertices = (0..n * n).map(|i| at((i / n) as f64 / n as f64, (i % n) as f64 / n as f64).map(|v| v as f32));
    let index = |i: usize, j: usize| (i % n * n + j % n) as u32;
    let squares = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let triangles = squares.flat_map(|(i, j)| {
        let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh { vertices: vertices.collect(), triangles: triangles.collect() }
}

/// A torus about the z axis.
fn torus(ring: f64, tube: f64) -> TriMesh {
    closed_surface(384, |i, j| {
        let (around, across) = (2.0 * PI * i, 2.0 * PI * j);
        let radius = ring + tube * across.cos();
        [radius * around.cos(), radius * around.sin(), tube * across.sin()]
    })
}

/// A ball of radius 1 from a box of 6 x n x n squares, put on the sphere.
fn ball(n: usize) -> TriMesh {
    let mut mesh = TriMesh::default();
    for face in 0..6 {
        let first = mesh.vertices.len() as u32;
        for i in 0..=n {
            for j in 0..=n {
                // Equal angles, so that the squares are of one size.
                let [u, v] = [i, j].map(|step| ((step as f64 / n as f64 - 0.5) * PI / 2.0).tan());
                let w = if face < 3 { 1.0 } else { -1.0 };
                let mut point = [0.0; 3];
                point[face % 3] = w;
                point[(face + 1) % 3] = u * w;
                point[(face + 2) % 3] = v;
                let norm = (1.0 + u * u + v * v).sqrt();
                mesh.vertices.push(point.map(|value| (value / norm) as f32));
            }
        }
        let index = |i: usize, j: usize| first + (i * (n + 1) + j) as u32;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// A box of sides 1 x 0.8 x 0.6, turned.
fn rotated_box() -> TriMesh {
    let rotation = graspmill::geom::rotation_from_rpy(0.3, -0.7, 1.9);
    let mut mesh = centred_block([0.5, 0.4, 0.3]);
    for vertex in &mut mesh.vertices {
        *vertex = (rotation * Point3::from(vertex.map(f64::from))).coords.map(|value| value as f32).into();
    }
    mesh
}

#[test]
fn volumes_of_ball_box_and_torus_converge_as_the_pitch_falls() {
    let bodies = [
        ("ball", ball(200), 4.0 / 3.0 * PI),
        ("box", rotated_box(), 0.48),
        ("torus", torus(1.0, 0.4), 2.0 * PI * PI * 0.16),
    ];
    for (name, mesh, exact) in bodies {
        let side = mesh.aabb().unwrap().longest_side();
        for (times, bound) in [(8.0, 0.01), (4.0, 0.003), (2.0, 0.0015), (1.0, 0.0005)] {
            // A loose vertex widens the box, and with it the pitch.
            let mut widened = mesh.clone();
            let low = mesh.aabb().unwrap().min;
            widened.vertices.push([low.x as f32, low.y as f32, (low.z + times * side) as f32]);
            let grid = solid_occupancy(&widened, InsideTest::Crossings, false);
            let error = grid.volume() / exact - 1.0;
            println!("{name}, pitch {:.4}: volume off by {error:+.1e}", grid.pitch);
            assert!(error.abs() < bound, "{name}, pitch {}: {error}", grid.pitch);
        }
    }
}

// Volumes of scans.

#[derive(Deserialize)]
struct Volume {
    name: String,
    watertight: bool,
    volume: f64,
    area: f64,
}

/// Centre sampling holds the volume to 0.1 % where the body is thick. Flat bodies whose large faces lie along the axes
/// can lose or win a part of one layer of cells, at 256 cells per side: `ALONG_AXES`.
fn check_volumes(paths: &[PathBuf]) {
    const ALONG_AXES: [&str; 2] = ["009_gelatin_box", "071_nine_hole_peg_test"];
    let mut cases = Cases::new();
    let mut grids = Vec::new();
    for path in paths {
        let mesh = prepare_scan(path);
        let grid = solid_occupancy(&mesh, InsideTest::Crossings, false);
        cases.add(&stem(path), &mesh, &grid);
        grids.push(grid);
    }
    let mut worst = [0.0f64; 2];
    for (theirs, grid) in cases.ask::<Volume>("volume", &[]).iter().zip(&grids) {
        assert!(theirs.watertight, "{}", theirs.name);
        let error = grid.volume() / theirs.volume - 1.0;
        // The mean thickness of a sheet of this volume and area.
        let thickness = 2.0 * theirs.volume / theirs.area / grid.pitch;
        let thin = thickness < 16.0;
        let bound = if thin {
            0.01
        } else if ALONG_AXES.contains(&&*theirs.name) {
            0.002
        } else {
            0.001
        };
        if error.abs() > 0.0005 {
            println!("{}: volume off by {:+.3} %, {thickness:.0} cells thick", theirs.name, 100.0 * error);
        }
        assert!(error.abs() < bound, "{}: off by {error:+.2e}, {thickness:.1} cells thick", theirs.name);
        worst[usize::from(thin)] = worst[usize::from(thin)].max(error.abs());
    }
    println!("worst: {:.4} % thick, {:.3} % thin", 100.0 * worst[0], 100.0 * worst[1]);
}

#[test]
fn volumes_of_scans_are_those_of_trimesh() {
    check_volumes(&scan_files().into_iter().step_by(5).collect::<Vec<_>>());
}

#[test]
#[ignore = "slow"]
fn volumes_of_all_scans_are_those_of_trimesh() {
    check_volumes(&scan_files());
}

// Surfaces with holes.

/// A number in 0..1 that depends on `index` alone (SplitMix64's mixing).
fn share(index: usize) -> f64 {
    let mut mixed = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

fn with_faces(mesh: &TriMesh, keep: impl Fn(usize) -> bool) -> TriMesh {
    let kept = (0..mesh.triangles.len()).filter(|face| keep(*face)).map(|face| mesh.triangles[face]).collect();
    TriMesh { vertices: mesh.vertices.clone(), triangles: kept }
}

fn without_random(mesh: &TriMesh, lost: f64) -> TriMesh {
    with_faces(mesh, |face| share(face) >= lost)
}

/// Without the `lost` share of the faces that lie highest along an axis.
fn without_cap(mesh: &TriMesh, axis: usize, lost: f64) -> TriMesh {
    let height = |face: usize| mesh.corners(face).iter().map(|corner| corner[axis]).sum::<f64>();
    let mut heights: Vec<f64> = (0..mesh.triangles.len()).map(height).collect();
    heights.sort_by(f64::total_cmp);
    let limit = heights[((1.0 - lost) * heights.len() as f64) as usize];
    with_faces(mesh, |face| height(face) < limit)
}

fn soup(mesh: &TriMesh) -> TriMesh {
    let vertices = mesh.triangles.iter().flatten().map(|vertex| mesh.vertices[*vertex as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
    TriMesh { vertices, triangles }
}

fn with_reversed_faces(mesh: &TriMesh, share_reversed: f64) -> TriMesh {
    let mut mesh = mesh.clone();
    let faces = mesh.triangles.iter_mut().enumerate().filter(|(face, _)| share(*face) < share_reversed);
    faces.for_each(|(_, triangle)| triangle.swap(0, 1));
    mesh
}

fn two_balls() -> TriMesh {
    let mut mesh = ball(40);
    let count = mesh.vertices.len() as u32;
    let second = ball(30);
    mesh.vertices.extend(second.vertices.iter().map(|[x, y, z]| [0.8 * x + 1.1, 0.8 * y + 0.2, 0.8 * z]));
    mesh.triangles.extend(second.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + count)));
    mesh
}

#[derive(Debug, Deserialize)]
struct Agreement {
    name: String,
    outside_band: Overlap,
    band: Overlap,
    /// Largest distance of the winding number from one half in a cell outside the band where the two differ.
    doubt: f64,
}

#[derive(Debug, Deserialize)]
struct Overlap {
    cells: u64,
    both: u64,
    either: u64,
}

impl Overlap {
    fn iou(&self) -> f64 {
        if self.either == 0 { 1.0 } else { self.both as f64 / self.either as f64 }
    }
}

fn check_insides(meshes: Vec<(String, TriMesh)>, step: usize) {
    let mut cases = Cases::new();
    for (name, mesh) in &meshes {
        cases.add(name, mesh, &solid_occupancy(mesh, InsideTest::WindingNumber, false));
    }
    let mut inside = 0;
    for agreement in cases.ask::<Agreement>("winding", &[&step.to_string()]) {
        let Agreement { name, outside_band, band, doubt } = &agreement;
        println!(
            "{name}: IoU {:.5} of {} cells, winding number within {doubt:.1e} of 1/2 where they differ; band {:.4} of {}",
            outside_band.iou(),
            outside_band.either,
            band.iou(),
            band.cells
        );
        assert!(outside_band.iou() >= 0.995, "{agreement:?}");
        assert!(band.iou() >= 0.98, "{agreement:?}");
        assert!(*doubt < 1e-6, "{agreement:?}");
        inside += outside_band.both + band.both;
    }
    assert!(inside > 1000 * meshes.len() as u64 * 8 / (step * step) as u64, "too few cells to compare: {inside}");
}

#[test]
fn insides_of_surfaces_with_holes_are_those_of_libigl() {
    let (mug, banana, cups) = (scan("025_mug"), scan("011_banana"), scan("065-a_cups"));
    let mut lidless = rotated_box();
    lidless.triangles.truncate(10);
    check_insides(
        vec![
            ("mug_1_percent".into(), without_random(&mug, 0.01)),
            ("mug_10_percent".into(), without_random(&mug, 0.1)),
            ("mug_cap".into(), without_cap(&mug, 0, 0.1)),
            ("banana_5_percent".into(), without_random(&banana, 0.05)),
            ("banana_cap".into(), without_cap(&banana, 2, 0.05)),
            ("banana_turned".into(), with_reversed_faces(&banana, 0.1)),
            ("cups_cap".into(), without_cap(&cups, 1, 0.05)),
            ("lidless_box".into(), lidless),
            ("two_balls".into(), two_balls()),
            ("two_balls_soup".into(), soup(&two_balls())),
            ("two_balls_5_percent".into(), without_random(&two_balls(), 0.05)),
        ],
        8,
    );
}

#[test]
#[ignore = "slow"]
fn insides_of_many_surfaces_with_holes_are_those_of_libigl() {
    for name in ["003_cracker", "013_apple", "024_bowl", "025_mug", "029_plate", "035_power", "037_scissors", "065-a"] {
        let mesh = scan(name);
        let mut meshes = vec![("soup".to_owned(), soup(&mesh)), ("turned".to_owned(), with_reversed_faces(&mesh, 0.1))];
        for percent in [1, 5, 10] {
            let lost = f64::from(percent) / 100.0;
            meshes.push((format!("{percent}_percent"), without_random(&mesh, lost)));
            meshes.extend((0..3).map(|axis| (format!("cap_{axis}_{percent}"), without_cap(&mesh, axis, lost))));
        }
        println!("{name}");
        check_insides(meshes, 4);
    }
}

// binvox and queries.

#[derive(Deserialize)]
struct AsRead {
    shape: [usize; 3],
    translation: [f64; 3],
}

#[test]
fn binvox_files_are_read_alike_by_trimesh() {
    let solid = solid_occupancy(&scan("025_mug"), InsideTest::Crossings, true);
    let mut grid = OccupancyGrid::new(40);
    for cell in 0..64_000u32 {
        if share(cell as usize) < 0.3 {
            grid.set([cell / 1600, cell / 40 % 40, cell % 40]);
        }
    }
    let partial = Binvox { grid, translate: [-0.125, 0.25, 0.75], scale: 0.2 };
    let folder = Workspace::new();
    let files = [("solid.binvox", solid_to_binvox(&solid)), ("partial.binvox", partial.to_bytes())];
    let paths = files.map(|(name, bytes)| folder.write(name, bytes));
    let read: Vec<AsRead> = ask_peer("binvox").args(&paths).succeed().json_lines();
    let bits = paths.map(|path| fs::read(format!("{}.bits", path.display())).unwrap());
    assert_eq!((read[0].shape, read[1].shape), ([256; 3], [40; 3]));
    assert_eq!(bits[0], solid.words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>());
    assert_eq!(bits[1], partial.grid.bytes());
    // trimesh puts the centre of the first cell at `translate`, its corner for us and for binvox: the same number.
    assert_eq!(read[1].translation, partial.translate);
}

#[derive(Deserialize)]
struct Distances {
    distances: Vec<f64>,
}

#[test]
fn distances_are_those_of_libigl() {
    let mesh = scan("025_mug");
    let query = MeshQuery::new(&mesh).unwrap();
    let grid = SolidGrid::new(mesh.aabb().unwrap().min, mesh.aabb().unwrap().longest_side());
    let points: Vec<Point3<f64>> = (0..2000)
        .map(|i| {
            grid.origin + nalgebra::Vector3::from_fn(|axis, _| share(3 * i + axis) * 1.2 - 0.1) * grid.pitch * 256.0
        })
        .collect();
    let mut cases = Cases::new();
    cases.add("mug", &mesh, &grid);
    let bytes: Vec<u8> = points
        .iter()
        .flat_map(|point| point.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())
        .collect();
    fs::write(cases.file("mug", "points"), bytes).unwrap();
    let theirs = &cases.ask::<Distances>("distance", &[])[0].distances;
    for (point, theirs) in points.iter().zip(theirs) {
        let ours = query.distance(point);
        assert!((ours - theirs).abs() < 1e-9, "{point}: {ours}, libigl {theirs}");
    }
}

// Twins.

#[derive(Deserialize)]
struct Rests {
    name: String,
    probabilities: Vec<f64>,
    ups: Vec<[f64; 3]>,
}

/// The share of random drops with a result other than trimesh's; rotations of less than 2 degrees are the same.
fn drops_apart(ours: &[([f64; 3], f64)], theirs: &[([f64; 3], f64)]) -> f64 {
    let mut left: Vec<([f64; 3], f64)> = theirs.to_vec();
    let mut apart = 0.0;
    for (up, probability) in ours {
        let mut rest = *probability;
        for (other, theirs) in &mut left {
            if Vector3::from(*up).dot(&Vector3::from(*other)) > 2.0_f64.to_radians().cos() {
                let shared = rest.min(*theirs);
                rest -= shared;
                *theirs -= shared;
            }
        }
        apart += rest;
    }
    apart
}

fn check_rests(scans: &[PathBuf]) {
    let mut cases = Cases::new();
    let mut ours = Vec::new();
    for path in scans {
        let (name, mesh) = (stem(path), prepare_scan(path));
        let solid = solid_occupancy(&mesh, InsideTest::WindingNumber, false);
        let centre = MassProperties::of_solid(&solid).unwrap().centre;
        let bytes: Vec<u8> = centre.coords.iter().flat_map(|part| part.to_le_bytes()).collect();
        cases.add(&name, &mesh, &solid);
        fs::write(cases.file(&name, "points"), bytes).unwrap();
        let poses = every_resting_pose(&mesh, &centre);
        let sum: f64 = poses.iter().map(|pose| pose.probability).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{name}: {sum}");
        for pose in &poses {
            let heights =
                mesh.vertices.iter().map(|vertex| pose.world_from_object.point(&Point3::from(vertex.map(f64::from))).z);
            let low = heights.fold(f64::INFINITY, f64::min);
            assert!(low.abs() < 1e-7, "{name}: {low} m over the table");
        }
        let up = |pose: &RestingPose| pose.up().into();
        ours.push(poses.iter().map(|pose| (up(pose), pose.probability)).collect::<Vec<_>>());
    }
    let mut all = Vec::new();
    for (theirs, ours) in cases.ask::<Rests>("rest", &[]).iter().zip(&ours) {
        let theirs_all: Vec<([f64; 3], f64)> = theirs.ups.iter().copied().zip(theirs.probabilities.clone()).collect();
        let apart = drops_apart(ours, &theirs_all);
        println!("{}: {} poses, trimesh {}, {:.4} apart", theirs.name, ours.len(), theirs.ups.len(), apart);
        all.push(apart);
    }
    all.sort_by(f64::total_cmp);
    println!("apart: median {:.4}, worst {:.4}", all[all.len() / 2], all[all.len() - 1]);
    assert!(all[all.len() / 2] < 0.02 && all[all.len() - 1] < 0.15);
}

#[test]
fn scans_rest_as_trimesh_says() {
    check_rests(&scan_files().into_iter().step_by(12).collect::<Vec<_>>());
}

#[test]
#[ignore = "slow"]
fn all_scans_rest_as_trimesh_says() {
    check_rests(&scan_files());
}

#[test]
fn the_scans_hold_twins() {
    let paths = scan_files();
    let shapes: Vec<ShapeDescriptor> =
        paths.iter().map(|path| ShapeDescriptor::from_mesh(&prepare_scan(path), InsideTest::Crossings)).collect();
    let groups = twins(&shapes, 0.85);
    let names: Vec<Vec<String>> =
        groups.iter().map(|group| group.iter().map(|shape| stem(&paths[*shape])).collect()).collect();
    names.iter().for_each(|group| println!("{}", group.join(", ")));
    let together = |a: &str, b: &str| {
        let has = |group: &[String], start: &str| group.iter().any(|name| name.starts_with(start));
        names.iter().any(|group| has(group, a) && has(group, b))
    };
    for (a, b) in [("054", "058"), ("017", "056"), ("002", "005"), ("008", "009"), ("070-b", "077"), ("043", "044")] {
        assert!(together(a, b), "{a} and {b} have one shape: {names:?}");
    }
    for (a, b) in [("011", "025"), ("003", "077"), ("024", "029"), ("054", "077"), ("030", "031"), ("005", "054")] {
        assert!(!together(a, b), "{a} and {b} differ: {names:?}");
    }
    let count: usize = groups.iter().map(Vec::len).sum();
    assert!((18..=28).contains(&count), "{count} scans with a twin: {names:?}");
}
