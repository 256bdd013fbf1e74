//! Faces of any number of corners: volumes and areas of prisms against what their rings tell.

use std::{fs, path::Path};

use graspmill::{
    assets::{AssetRecord, InsideMethod, Repair, prepare, read_triangles},
    files::Folder,
    format::{
        VoxelPair,
        dataset::{DatasetReader, Selection},
    },
    geom::TriMesh,
    seed::Stream,
    voxel::solid_occupancy,
};

use super::meshes::source;
use crate::support::{
    polygons::{Prism, Region, plate},
    program::Program,
    workspace::Workspace,
};

/// Polygons that are drawn.
const DRAWN: usize = 300;
/// Fewest and most corners.
const CORNERS: [f64; 2] = [10.0, 5000.0];

fn drawn(index: usize) -> (Region, Prism) {
    let mut draw = Stream::of_job(index as u64, b"", "polygons");
    let [fewest, most] = CORNERS.map(libm::log);
    let corners = libm::exp(draw.uniform(fewest, most)) as usize;
    let region = Region::drawn(index, corners, &mut draw);
    let (scale, height) = (draw.uniform(0.02, 0.2), draw.uniform(0.1, 1.0));
    let prism = Prism::over(&region, scale, height, &mut draw);
    (region, prism)
}

/// The prism in one of the formats that have polygons.
fn write(folder: &Path, index: usize, prism: &Prism) -> std::path::PathBuf {
    let (ending, text) = match index % 3 {
        0 => ("obj", prism.to_obj()),
        1 => ("off", prism.to_off()),
        _ => ("ply", prism.to_ply()),
    };
    let path = folder.join(format!("{index:03}.{ending}"));
    fs::write(&path, text).expect("a mesh file");
    path
}

/// Area of all triangles, whichever way they face.
fn surface_area(mesh: &TriMesh) -> f64 {
    let area = |face| {
        let [a, b, c] = mesh.corners(face);
        (b - a).cross(&(c - a)).norm() / 2.0
    };
    (0..mesh.triangles.len()).map(area).sum()
}

fn assert_fine(record: &AssetRecord, name: &str) {
    assert!(record.watertight && record.inside == InsideMethod::Crossings, "{name}: {record:#?}");
    assert!(record.repairs.is_empty() && record.warnings.is_empty(), "{name}: {record:#?}");
}

#[test]
fn prisms_over_three_hundred_polygons_have_the_volumes_and_areas_of_their_rings() {
    let folder = Workspace::new();
    let (mut fewest, mut most, mut worst) = (usize::MAX, 0, 0.0_f64);
    for index in 0..DRAWN {
        let (region, prism) = drawn(index);
        let name = format!("polygon {index}, {} of {} corners", region.kind, region.corners());
        let prepared = prepare(&source(&write(folder.folder(), index, &prism)))
            .unwrap_or_else(|refusal| panic!("{name}: {refusal}"));
        let record = &prepared.record;
        assert_fine(record, &name);
        // Two ends for each hole: a ball with as many handles.
        assert_eq!(record.euler, 2 - 2 * region.holes() as i64, "{name}");
        // By how much single precision moves a side.
        let longest = record.extents.into_iter().fold(0.0, f64::max);
        let slack = 1e-6 * longest * (prism.perimeter + longest);
        let area = surface_area(&prepared.mesh);
        assert!((area - prism.area).abs() < slack, "{name}: {area} m2, not {}", prism.area);
        let off = (record.volume - prism.volume).abs();
        assert!(off < slack * longest, "{name}: {} m3, not {}", record.volume, prism.volume);
        worst = worst.max(off / prism.volume);
        (fewest, most) = (fewest.min(region.corners()), most.max(region.corners()));
    }
    println!("{DRAWN} polygons of {fewest} to {most} corners: volumes within {worst:.1e} of themselves, 0 refused");
    assert!(fewest < 20 && most > 4500, "{fewest} {most}");
}

/// The plates and the washer of a report, as outlines that pass the corners of a bridge twice, and as triangles.
#[test]
fn faces_with_holes_on_a_bridge_are_what_their_triangles_are() {
    let folder = Workspace::new();
    let half_diagonal = 0.5 * 2.0_f64.sqrt();
    let square_hole = plate((4, half_diagonal), (4, 0.4 * half_diagonal));
    let round_hole = plate((4, half_diagonal), (16, 0.3));
    let washer = plate((24, 0.5), (24, 0.25));
    for (name, region) in [("plate_square_hole", &square_hole), ("plate_round_hole", &round_hole), ("washer", &washer)]
    {
        let prism = Prism::upright(region, 0.1, 0.1);
        folder.write(format!("{name}.obj"), prism.to_obj());
        folder.write(format!("{name}.off"), prism.to_off());
        folder.write(format!("{name}.ply"), prism.to_ply());
    }
    // Cut by hand: between the corners of the two rings.
    let mut triangles = Prism::upright(&washer, 0.1, 0.1);
    let strip = (0..24).flat_map(|corner| {
        let next = (corner + 1) % 24;
        [[corner, next, 24 + next], [corner, 24 + next, 24 + corner]]
    });
    let strip: Vec<[usize; 3]> = strip.collect();
    let top = strip.iter().map(|face| face.map(|corner| 48 + corner).to_vec());
    let bottom = strip.iter().map(|[a, b, c]| vec![*a, *c, *b]);
    triangles.faces.splice(..2, top.chain(bottom));
    folder.write("washer_triangles.obj", triangles.to_obj());

    let text = Program::on("meshes", "check").arg(folder.folder()).expect_code(0).stdout;
    let rows: Vec<&str> = text.lines().filter(|line| line.ends_with("fine")).collect();
    assert_eq!(rows.len(), 10, "{text}");
    for row in rows {
        let volume = [("square", "84.00"), ("round", "72.45"), ("washer", "58.23")];
        let wanted = volume.iter().find(|(name, _)| row.contains(name)).expect("one of them").1;
        assert_eq!(row.split_whitespace().rev().nth(1), Some(wanted), "{row}");
    }
    assert!(!text.contains("note") && text.contains("10 fine, 0 repaired, 0 refused"), "{text}");

    let solid = |name: &str| {
        let prepared = prepare(&source(&folder.path(name))).expect("a usable mesh");
        solid_occupancy(&prepared.mesh, prepared.record.inside.test(), false)
    };
    assert_eq!(solid("washer.obj"), solid("washer_triangles.obj"));

    let complete = |name: &str| {
        let objects =
            format!("[[objects]]\nlist = [\"{name}.obj\"]\n[split]\nvalidation_objects = 0\ntest_objects = 0\n");
        let job = format!("name = \"{name}\"\nseed = 1\nviews = {{ even = 12 }}\n{objects}");
        let reader = DatasetReader::open(&Folder::at(folder.make_dataset(name, &job, &[]))).expect("a dataset");
        let samples = reader.iter(Selection::default());
        samples.map(|sample| sample.expect("a sample").read::<VoxelPair>().expect("a pair")).collect::<Vec<VoxelPair>>()
    };
    let (polygons, triangles) = (complete("washer"), complete("washer_triangles"));
    assert_eq!(polygons.len(), 12);
    for (one, other) in polygons.iter().zip(&triangles) {
        assert_eq!((&one.complete, &one.partial), (&other.complete, &other.partial));
    }
}

/// A cube of 100 mm of quads, with other faces in place of its top.
fn cube_with_top(top: &[&[u32]]) -> String {
    let vertices = (0..8).map(|corner| {
        let [x, y, z] = [0, 1, 2].map(|axis| 0.1 * f64::from(corner >> axis & 1));
        format!("v {x} {y} {z}\n")
    });
    let others: [&[u32]; 5] = [&[0, 2, 3, 1], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]];
    let faces = others.iter().chain(top).map(|face| {
        let corners: Vec<String> = face.iter().map(|corner| (corner + 1).to_string()).collect();
        format!("f {}\n", corners.join(" "))
    });
    vertices.chain(faces).collect()
}

#[test]
fn a_face_that_crosses_itself_is_left_out_counted_and_located() {
    let folder = Workspace::new();
    let check = |name: &str, text: String, code: i32| {
        let path = folder.write(name, text);
        (Program::on("meshes", "check").arg(&path).expect_code(code).stdout, path)
    };
    // A bow tie: as much area one way round as the other.
    let (text, path) = check("bow.obj", cube_with_top(&[&[4, 7, 5, 6]]), 0);
    for part in
        ["repaired, open", "1 face without an inside left out", "at line 14: its outline runs around as much area"]
    {
        assert!(text.replace("\n             ", " ").contains(part), "{part}\n{text}");
    }
    let record = prepare(&source(&path)).expect("a cube without its top").record;
    assert_eq!(record.repairs, [Repair::CrossingFaces { count: 1 }]);
    // The solid under the missing face is whole: its outline gives its position.
    let prepared = prepare(&source(&path)).expect("a cube without its top");
    let cells = solid_occupancy(&prepared.mesh, prepared.record.inside.test(), false).count();
    assert!(cells as f64 > 0.99 * f64::from(1 << 24), "{cells}");

    // Parts of robots need all of their faces.
    let refusal = read_triangles(&path).expect_err("a robot without one of its faces").to_string();
    assert!(refusal.contains("a face has no inside") && refusal.contains("(line 14)"), "{refusal}");

    // The remedy: cut into triangles.
    let (text, path) = check("cut.obj", cube_with_top(&[&[4, 5, 7], &[4, 7, 6]]), 0);
    assert!(text.contains("  fine\n"), "{text}");
    assert!(read_triangles(&path).is_ok());

    // A mesh that is refused without it: the refusal tells of the face.
    let sheet = "v 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nf 1 2 3 4\nf 1 3 2 4\n".to_owned();
    let (text, _) = check("sheet.obj", sheet, 3);
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("a flat sheet") && text.contains("1 face is left out, the first one at line 6"), "{text}");

    let alone = "v 0 0 0\nv 0.1 0.1 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 2 3 4\n".to_owned();
    let (text, _) = check("alone.obj", alone, 3);
    assert!(
        text.contains("problem  a face has no inside") && text.contains("remedy   cut it into triangles"),
        "{text}"
    );
}
