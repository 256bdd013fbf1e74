//! Mesh preparation against meshes and figures that are not ours, and every defect of a long list.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use graspmill::{
    assets::{AssetRecord, InsideMethod, MeshRefusal, MeshSource, Repair, duplicates, list_folder, prepare},
    geom::TriMesh,
    object::PreparedObject,
    words::is_note,
};
use serde::Deserialize;

use crate::support::{
    meshes::{block, built_in_mesh, scan_files, write_stl},
    program::Program,
    workspace::Workspace,
};

pub(crate) fn source(path: &Path) -> MeshSource {
    MeshSource::of_file(path.file_name().unwrap().to_string_lossy(), path)
}

/// Facts by trimesh (tests/fixtures/meshes/oracle.py).
#[derive(Debug, Deserialize)]
struct Facts {
    watertight_as_found: bool,
    collapsed: u32,
    on_the_same_vertices: u32,
    watertight: bool,
    volume: f64,
    euler: i64,
    bodies: u32,
    triangles: u32,
    vertices: u32,
    extents: [f64; 3],
}

fn trimesh_facts(paths: &[PathBuf]) -> Vec<Facts> {
    Program::python().arg("tests/fixtures/meshes/oracle.py").args(paths).succeed().json_lines()
}

fn assert_agrees(record: &AssetRecord, facts: &Facts) {
    let name = &record.name;
    assert_eq!(record.watertight, facts.watertight, "{name}");
    assert!((record.volume / facts.volume - 1.0).abs() < 1e-6, "{name}: {} {}", record.volume, facts.volume);
    assert_eq!((record.euler, record.bodies), (facts.euler, facts.bodies), "{name}");
    assert_eq!((record.triangles, record.vertices), (facts.triangles, facts.vertices), "{name}");
    for axis in 0..3 {
        assert!((record.extents[axis] - facts.extents[axis]).abs() < 1e-7, "{name}");
    }
}

#[test]
fn the_ycb_scans_are_what_trimesh_says_they_are() {
    let paths = scan_files();
    let facts = trimesh_facts(&paths);
    let (mut as_found, mut mended) = (0, 0);
    for (path, facts) in paths.iter().zip(&facts) {
        let record = prepare(&source(path)).unwrap().record;
        assert_agrees(&record, facts);
        assert!(record.watertight && record.inside == InsideMethod::Crossings, "{record:#?}");
        if facts.watertight_as_found {
            as_found += 1;
            assert_eq!(record.repairs, [], "{}", record.name);
        } else {
            mended += 1;
            assert!([2, 4, 6].contains(&facts.on_the_same_vertices));
            let wanted = [
                Repair::ZeroAreaFaces { count: facts.collapsed },
                Repair::DuplicateFaces { count: facts.on_the_same_vertices },
            ];
            assert_eq!(record.repairs, wanted, "{}", record.name);
        }
    }
    assert_eq!((as_found, mended), (58, 20));
}

/// Preparing one scan in every format, by hand of trimesh, gives the same triangles.
#[test]
fn all_formats_agree_on_a_scan() {
    let folder = Workspace::new();
    let stl = Path::new(".deps/ycb/011_banana.stl");
    let script = "import sys, trimesh\nmesh = trimesh.load(sys.argv[1])\nfor path in sys.argv[2:]:\n    \
        ascii = {'encoding': 'ascii'} if path.endswith('-text.ply') else {}\n    \
        kind = {'file_type': 'stl_ascii'} if path.endswith('.stl') else {}\n    \
        digits = {'digits': 12} if path.endswith(('.obj', '.off')) else {}\n    \
        mesh.export(path, **ascii, **kind, **digits)\n";
    let paths = ["a.ply", "a-text.ply", "a.obj", "a.off", "a.stl"].map(|name| folder.path(name));
    Program::python_lines(script).arg(stl).args(&paths).succeed();
    let wanted = prepare(&source(stl)).unwrap().record;
    for path in paths {
        let record = prepare(&source(&path)).unwrap().record;
        // trimesh writes some text with eight decimals, which moves positions; counts stay.
        let exact = path.ends_with("a.ply");
        assert!(!exact || record.geometry == wanted.geometry, "{}", path.display());
        assert_eq!((record.watertight, record.euler), (wanted.watertight, wanted.euler), "{}", path.display());
        assert_eq!((record.triangles, record.bodies), (wanted.triangles, wanted.bodies), "{}", path.display());
        assert!((record.volume / wanted.volume - 1.0).abs() < 1e-4, "{}", path.display());
    }
}

/// The remedy that refusals of other formats name works, and moves nothing.
#[test]
fn a_converted_glb_has_the_same_triangles() {
    let folder = Workspace::new();
    let (stl, glb) = (Path::new(".deps/ycb/011_banana.stl"), folder.path("a.glb"));
    let ply = folder.path("a.ply");
    let export = "import sys, trimesh; trimesh.load(sys.argv[1]).export(sys.argv[2])";
    Program::python_lines(export).args([stl, &glb]).succeed();
    Program::python().arg("scripts/convert_mesh.py").args([&glb, &ply]).succeed();
    let [wanted, record] = [stl, &ply].map(|path| prepare(&source(path)).unwrap().record);
    assert_eq!(record.geometry, wanted.geometry);
}

/// Indexed, with every vertex on its own line, which STL cannot hold.
fn write_obj(path: &Path, mesh: &TriMesh) {
    let vertices = mesh.vertices.iter().map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n"));
    let faces = mesh.triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    fs::write(path, vertices.chain(faces).collect::<String>()).unwrap();
}

pub(crate) fn join(parts: &[TriMesh]) -> TriMesh {
    let mut all = TriMesh::default();
    for part in parts {
        let first = all.vertices.len() as u32;
        all.vertices.extend(&part.vertices);
        all.triangles.extend(part.triangles.iter().map(|face| face.map(|vertex| vertex + first)));
    }
    all
}

pub(crate) fn reversed(mut mesh: TriMesh, chosen: impl Fn(usize) -> bool) -> TriMesh {
    let faces = mesh.triangles.iter_mut().enumerate();
    faces.filter(|(index, _)| chosen(*index)).for_each(|(_, face)| face.swap(0, 1));
    mesh
}

pub(crate) fn scaled(mut mesh: TriMesh, factor: f32) -> TriMesh {
    mesh.vertices.iter_mut().flatten().for_each(|coordinate| *coordinate *= factor);
    mesh
}

/// A sheet of 16 x 16 squares, bent by `height(x, y)`, 0.1 m wide.
pub(crate) fn sheet(height: fn(f32, f32) -> f32) -> TriMesh {
    let coordinate = |i: u32| (i % 17) as f32 / 160.0;
    let vertices =
        (0..289).map(|i| [coordinate(i), coordinate(i / 17), height(coordinate(i), coordinate(i / 17))]).collect();
    let square = |i: u32| (i / 16) * 17 + i % 16;
    let triangles = (0..256).map(square).flat_map(|a| [[a, a + 1, a + 18], [a, a + 18, a + 17]]).collect();
    TriMesh { vertices, triangles }
}

/// No two faces share a corner: every triangle shrinks a little towards its middle.
pub(crate) fn shrunk(mesh: &TriMesh) -> TriMesh {
    let mut soup = TriMesh::default();
    for face in &mesh.triangles {
        let corners = face.map(|vertex| mesh.vertices[vertex as usize]);
        let middle: [f32; 3] = std::array::from_fn(|axis| corners.iter().map(|corner| corner[axis]).sum::<f32>() / 3.0);
        let first = soup.vertices.len() as u32;
        soup.vertices.extend(corners.map(|c| std::array::from_fn(|axis| c[axis] + 1e-3 * (middle[axis] - c[axis]))));
        soup.triangles.push([first, first + 1, first + 2]);
    }
    soup
}

/// Surfaces that are wrong in themselves.
fn write_broken_surfaces(folder: &Path) {
    let bottle = built_in_mesh("bottle-01@2k");
    let stl = |name: &str, mesh: &TriMesh| write_stl(&folder.join(name), mesh);
    let obj = |name: &str, mesh: &TriMesh| write_obj(&folder.join(name), mesh);
    stl("fine.stl", &bottle);
    stl("mug in mm.stl", &scaled(built_in_mesh("cup-01@2k"), 1000.0));
    stl("bolt in km.stl", &scaled(bottle.clone(), 1e-3));
    stl("inside out.stl", &reversed(bottle.clone(), |_| true));
    stl("part flipped.stl", &reversed(bottle.clone(), |face| face % 7 == 3));
    let mut holed = bottle.clone();
    holed.triangles.retain(|face| !face.contains(&0));
    stl("hole.stl", &holed);
    stl("soup.stl", &shrunk(&bottle));
    stl("soup inside out.stl", &shrunk(&reversed(bottle.clone(), |_| true)));
    stl("soup without sense.stl", &shrunk(&reversed(bottle.clone(), |face| face * 7919 % 97 % 2 == 0)));
    stl("two-sided.stl", &join(&[bottle.clone(), reversed(bottle.clone(), |_| true)]));
    let mut doubled = bottle.clone();
    doubled.triangles.extend_from_within(10..15);
    stl("duplicate faces.stl", &doubled);
    let mut pair = bottle.clone();
    let [a, b, c] = pair.triangles[20];
    let d = (0..pair.vertices.len() as u32).find(|d| ![a, b, c].contains(d)).unwrap();
    pair.triangles.extend([[a, b, d], [b, a, d]]);
    stl("opposite pair.stl", &pair);
    // One face is split at the middle of an edge, its neighbour is not; a face in a line closes the slit.
    let mut line = block([0.0; 3], [0.1; 3]);
    let [a, b, c] = line.triangles[0];
    let [p, q] = [a, b].map(|corner| line.vertices[corner as usize]);
    line.vertices.push(std::array::from_fn(|axis| (p[axis] + q[axis]) / 2.0));
    line.triangles[0] = [a, 8, c];
    line.triangles.extend([[8, b, c], [a, b, 8]]);
    obj("zero area.obj", &line);
    let mut collapsed = bottle.clone();
    collapsed.triangles.extend([[4, 4, 9], [7, 7, 7]]);
    obj("collapsed.obj", &collapsed);
    let mut unused = bottle.clone();
    unused.vertices.extend([[5.0, 0.0, 0.0], [f32::NAN; 3]]);
    obj("unused.obj", &unused);
    stl("flat.stl", &sheet(|_, _| 0.03));
    stl("flat two-sided.stl", &join(&[sheet(|x, y| x + 2.0 * y), reversed(sheet(|x, y| x + 2.0 * y), |_| true)]));
    stl("bent sheet.stl", &sheet(|x, _| 0.5 * x * x));
}

/// Files that hold no mesh, or not all of one.
fn write_broken_files(folder: &Path) {
    let bottle = built_in_mesh("bottle-01@2k");
    let stl = |name: &str, mesh: &TriMesh| write_stl(&folder.join(name), mesh);
    let obj = |name: &str, mesh: &TriMesh| write_obj(&folder.join(name), mesh);
    stl("three corners.stl", &TriMesh { vertices: bottle.vertices.clone(), triangles: vec![bottle.triangles[50]] });
    let mut broken = bottle.clone();
    broken.vertices[17][1] = f32::NAN;
    stl("nan.stl", &broken);
    obj("nan.obj", &broken);
    broken.vertices[17][1] = f32::INFINITY;
    obj("infinite.obj", &broken);
    let whole = fs::read(folder.join("fine.stl")).unwrap();
    fs::write(folder.join("cut.stl"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.join("longer.stl"), [whole.as_slice(), b"end"].concat()).unwrap();
    let mut solid = whole.clone();
    solid[..5].copy_from_slice(b"solid");
    fs::write(folder.join("says solid.stl"), solid).unwrap();
    fs::write(folder.join("cut.ply"), "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n").unwrap();
    let mut beyond = bottle.clone();
    beyond.triangles[3][1] = 1_000_000;
    obj("beyond.obj", &beyond);
    for name in ["empty.stl", "empty.obj", "empty.ply", "empty.off"] {
        fs::write(folder.join(name), "").unwrap();
    }
    fs::write(folder.join("points.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n").unwrap();
    fs::write(folder.join("text.stl"), "this is no mesh, but long enough to be taken for the header of one ..........")
        .unwrap();
    fs::write(folder.join("pointer.stl"), "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n")
        .unwrap();
    fs::write(folder.join("scene.glb"), "glTF").unwrap();
    let mut shuffled = bottle.clone();
    shuffled.triangles.reverse();
    shuffled.triangles.iter_mut().for_each(|face| face.rotate_left(1));
    obj("Kopie für Jörg.obj", &shuffled);
}

/// Several bodies in one file.
fn write_bodies(folder: &Path) {
    let obj = |name: &str, mesh: &TriMesh| write_obj(&folder.join(name), mesh);
    let (outer, inner) = (block([0.0; 3], [0.1; 3]), block([0.03; 3], [0.07; 3]));
    let hollow = join(&[outer.clone(), reversed(inner.clone(), |_| true)]);
    obj("cavity.obj", &hollow);
    obj("cavity inside out.obj", &reversed(hollow, |_| true));
    obj("solid in solid.obj", &join(&[outer.clone(), inner]));
    obj("bodies of both windings.obj", &join(&[outer.clone(), reversed(block([0.2; 3], [0.3; 3]), |_| true)]));
    obj("overlap.obj", &join(&[outer.clone(), block([0.05; 3], [0.15; 3])]));
    let pinch = join(&[outer, block([0.1; 3], [0.2; 3])]);
    obj("touching corners.obj", &pinch);
}

fn outcomes(folder: &Path) -> BTreeMap<String, Result<AssetRecord, MeshRefusal>> {
    let name = |path: &Path| path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
    let list = list_folder(folder).unwrap();
    list.iter().map(|path| (name(path), prepare(&source(path)).map(|prepared| prepared.record))).collect()
}

#[test]
fn every_defect_is_mended_and_said_or_refused_with_place_and_remedy() {
    let workspace = Workspace::new();
    let folder = workspace.make_folder("Ordner mit Lücken");
    write_broken_surfaces(&folder);
    write_broken_files(&folder);
    write_bodies(&folder);
    let mut outcomes = outcomes(&folder);
    let fine = outcomes.remove("fine.stl").unwrap().unwrap();
    assert!(fine.watertight && fine.repairs.is_empty() && fine.warnings.is_empty() && fine.volume > 0.0);
    check_mended(&mut outcomes, &fine);
    check_bodies(&mut outcomes);
    check_refused(&mut outcomes);
    assert!(outcomes.is_empty(), "not looked at: {:?}", outcomes.keys());
}

type Outcomes = BTreeMap<String, Result<AssetRecord, MeshRefusal>>;

fn take(outcomes: &mut Outcomes, name: &str) -> AssetRecord {
    outcomes.remove(name).unwrap_or_else(|| panic!("no file {name}")).unwrap_or_else(|refusal| panic!("{refusal}"))
}

fn check_mended(outcomes: &mut Outcomes, fine: &AssetRecord) {
    // Repaired to the very same triangles.
    for (name, repairs) in [
        ("inside out.stl", vec![Repair::InsideOut { count: fine.triangles }]),
        (
            "part flipped.stl",
            vec![Repair::FlippedFaces { count: (0..fine.triangles).filter(|f| f % 7 == 3).count() as u32 }],
        ),
        ("two-sided.stl", vec![Repair::TwoSidedShell { count: fine.triangles }]),
        ("duplicate faces.stl", vec![Repair::DuplicateFaces { count: 5 }]),
        ("opposite pair.stl", vec![Repair::DuplicateFaces { count: 2 }]),
        ("collapsed.obj", vec![Repair::ZeroAreaFaces { count: 2 }]),
        ("unused.obj", vec![Repair::UnusedVertices { count: 2 }]),
        ("says solid.stl", vec![]),
        ("longer.stl", vec![]),
        ("Kopie für Jörg.obj", vec![]),
    ] {
        let record = take(outcomes, name);
        assert_eq!((record.geometry, &record.repairs), (fine.geometry, &repairs), "{name}");
        assert_eq!(record.warnings.is_empty(), name != "longer.stl", "{record:#?}");
    }

    let line = take(outcomes, "zero area.obj");
    assert_eq!(line.repairs, [Repair::ZeroAreaFaces { count: 1 }]);
    assert!(line.watertight && (line.volume - 1e-3).abs() < 1e-9, "{line:#?}");

    let hole = take(outcomes, "hole.stl");
    assert!(!hole.watertight && hole.inside == InsideMethod::WindingNumber);
    assert!(hole.warnings[0].starts_with("1 hole: ") && hole.warnings[0].contains(" wide at ("), "{:?}", hole.warnings);
    for name in ["soup.stl", "soup inside out.stl"] {
        let soup = take(outcomes, name);
        assert!(soup.inside == InsideMethod::WindingNumber && !soup.watertight);
        assert!((soup.volume / fine.volume - 1.0).abs() < 0.01 && soup.warnings.len() >= 2, "{soup:#?}");
        assert_eq!(soup.repairs.is_empty(), name == "soup.stl");
    }
}

fn check_bodies(outcomes: &mut Outcomes) {
    let hollow = 1e-3 - 0.04f64.powi(3);
    for (name, volume, warning) in [
        ("cavity.obj", hollow, "1 cavity inside, kept hollow"),
        ("cavity inside out.obj", hollow, "1 cavity inside, kept hollow"),
        ("solid in solid.obj", 1e-3 + 0.04f64.powi(3), "1 part inside another and wound like it"),
        ("bodies of both windings.obj", 2e-3, "2 separate bodies"),
        ("overlap.obj", 2e-3, "parts may overlap"),
        ("touching corners.obj", 2e-3, "touches itself in 1 point"),
    ] {
        let record = take(outcomes, name);
        assert!(record.watertight && record.inside == InsideMethod::Crossings, "{record:#?}");
        assert!((record.volume - volume).abs() < 1e-8, "{name}: {}", record.volume);
        assert!(record.warnings.iter().any(|text| text.starts_with(warning)), "{name}: {:?}", record.warnings);
        let is_sound = ["bodies of both windings.obj", "overlap.obj"].contains(&name);
        let is_found = |text: &&String| text.starts_with(warning);
        let remark = record.warnings.iter().find(is_found).expect("the remark");
        assert_eq!(is_note(&format!("{name}: {remark}")), is_sound, "{remark}");
        let reversed: &[Repair] = match name {
            "cavity inside out.obj" => &[Repair::InsideOut { count: 24 }],
            "bodies of both windings.obj" => &[Repair::InsideOut { count: 12 }],
            _ => &[],
        };
        assert_eq!(record.repairs, reversed, "{name}");
    }
}

fn check_refused(outcomes: &mut Outcomes) {
    for (name, reason, says) in [
        ("mug in mm.stl", "too_large", "the file is probably in millimetres: set unit = \"mm\""),
        ("bolt in km.stl", "too_small", "outside 5.000 mm to 2.000 m"),
        ("soup without sense.stl", "no_volume", "encloses no volume"),
        ("flat.stl", "flat", "a flat sheet"),
        ("flat two-sided.stl", "flat", "a flat sheet"),
        ("bent sheet.stl", "open_sheet", "of its area faces one way"),
        ("three corners.stl", "too_few_vertices", "3 distinct vertices"),
        ("nan.stl", "not_finite", "byte "),
        ("nan.obj", "not_finite", "(line 18)"),
        ("infinite.obj", "not_finite", "inf"),
        ("cut.stl", "truncated", "copy or export it again"),
        ("cut.ply", "truncated", "(line 4)"),
        ("beyond.obj", "index_out_of_range", "a face names vertex 1000000"),
        ("empty.stl", "empty_file", "the file is empty"),
        ("empty.obj", "empty_file", "the file is empty"),
        ("empty.ply", "empty_file", "the file is empty"),
        ("empty.off", "empty_file", "the file is empty"),
        ("points.obj", "no_faces", "4 points, but no faces"),
        ("text.stl", "truncated", "a binary STL starts with a header"),
        ("pointer.stl", "lfs_pointer", "git lfs pull"),
        ("scene.glb", "format", "trimesh.load_mesh"),
    ] {
        let refusal = outcomes.remove(name).unwrap_or_else(|| panic!("no file {name}")).expect_err(name);
        let text = refusal.to_string();
        assert_eq!(refusal.reason, reason, "{text}");
        assert!(text.contains(says) && text.contains(name) && !refusal.remedy.is_empty(), "{text}");
    }
}

#[test]
fn the_same_geometry_under_two_names_is_found() {
    let folder = Workspace::new();
    let mesh = built_in_mesh("bottle-01@2k");
    write_stl(&folder.path("a.stl"), &mesh);
    write_stl(&folder.path("b.stl"), &built_in_mesh("bottle-02@2k"));
    let mut other = mesh;
    other.triangles.reverse();
    write_obj(&folder.path("c.obj"), &other);
    let records: Vec<AssetRecord> = outcomes(folder.folder()).into_values().map(Result::unwrap).collect();
    let found: Vec<(usize, usize)> = duplicates(&records).iter().map(|copy| (copy.index, copy.of)).collect();
    assert_eq!(found, [(2, 0)]);
}

#[test]
fn preparing_does_not_depend_on_the_path() {
    let folder = Workspace::new();
    let copy = folder.path("other name.stl");
    fs::copy(".deps/ycb/025_mug.stl", &copy).unwrap();
    let [a, b] = [Path::new(".deps/ycb/025_mug.stl"), &copy].map(|path| prepare(&source(path)).unwrap());
    assert_eq!(a.mesh, b.mesh);
    assert_eq!(AssetRecord { name: String::new(), ..a.record }, AssetRecord { name: String::new(), ..b.record });
}

#[test]
fn a_scan_of_a_million_triangles_is_no_trouble() {
    let folder = Workspace::new();
    let path = folder.path("million.stl");
    write_stl(&path, &built_in_mesh("vase-01@1000k"));
    let start = Instant::now();
    let record = prepare(&source(&path)).unwrap().record;
    let seconds = start.elapsed().as_secs_f64();
    println!("{} triangles: {seconds:.2} s", record.triangles);
    assert!(record.watertight && record.triangles >= 1_000_000 && record.bodies == 1);
    assert!(seconds < 10.0, "{seconds} s is far beyond the second that it should take");
}

#[test]
#[ignore = "a timing; run by hand with --ignored --nocapture"]
fn time_to_prepare() {
    for name in ["048_hammer", "025_mug", "003_cracker_box"] {
        let source = source(Path::new(&format!(".deps/ycb/{name}.stl")));
        let times: Vec<f64> = (0..200)
            .map(|_| {
                let start = Instant::now();
                let prepared = prepare(&source).unwrap();
                assert_eq!(prepared.record.bodies, 1);
                start.elapsed().as_secs_f64()
            })
            .collect();
        println!("{name}: {:.3} ms", 1e3 * times.iter().copied().fold(f64::INFINITY, f64::min));
    }
}

#[test]
fn our_own_meshes_come_out_again_and_are_what_trimesh_says() {
    let workspace = Workspace::new();
    let again = workspace.path("meshes");
    fs::create_dir(&again).expect("a folder");
    Program::python().arg("meshes/make.py").arg(&again).succeed();
    let names = ["bottle.stl", "bowl.ply", "bracket.obj", "wedge.off", "../scenes/tote.stl"];
    let paths = names.map(|name| Path::new("meshes").join(name));
    for (facts, (path, name)) in trimesh_facts(&paths).iter().zip(paths.iter().zip(names)) {
        let made = fs::read(again.join(name)).expect("a mesh made again");
        assert_eq!(made, fs::read(path).expect("a mesh"), "{}", path.display());
        let object = PreparedObject::prepare(&source(path)).expect("a usable mesh");
        assert!(object.record().warnings.is_empty(), "{:?}", object.record().warnings);
        assert_agrees(object.record(), facts);
    }
    Program::new("meshes").arg("check").arg("meshes").expect_code(0);
}

#[test]
fn the_list_of_sources_names_the_hashes_that_are_checked() {
    let (list, program) = ("meshes/README.md", "scripts/fetch.py");
    let read = |path| fs::read_to_string(path).expect("a text");
    let (list, program) = (read(list), read(program));
    let hashes = list.split('`').filter(|word| word.len() == 64);
    assert_eq!(hashes.clone().count(), 5);
    for hash in hashes {
        assert!(program.contains(hash), "{hash} is not checked by scripts/fetch.py");
    }
}
