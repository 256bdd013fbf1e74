//! `graspmill segment` on a scene whose truth is known, by files alone, as a user calls it.

use std::{env, fs, path::Path};

use graspmill::{
    geom::{Intrinsics, Object, TriMesh},
    perception::{CameraDescription, FrameRule, read_frame},
};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use super::table::{CAMERA, STANDING, camera_from_table, png_of, render, scene_depth, standing, table_top};
use crate::support::{
    files::{list_names, number_at, read_json, repository_path},
    program::Program,
    workspace::Workspace,
};

const PICTURE: &str = "scenes/table.png";
const CAMERA_FILE: &str = "scenes/table.json";

fn camera_json() -> String {
    let Intrinsics { width, height, fx, fy, cx, cy, .. } = CAMERA;
    let camera = json!({"width": width, "height": height, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "pixel_centre": 0.5});
    serde_json::to_string_pretty(&camera).expect("JSON") + "\n"
}

fn segment(picture: impl AsRef<Path>, out: &Path) -> Program {
    Program::on("segment", picture.as_ref()).option("--out", out)
}

#[test]
fn the_example_is_what_the_renderer_sees() {
    let depth = scene_depth();
    if env::var_os("GRASPMILL_WRITE_SCENE").is_some() {
        fs::write(repository_path(PICTURE), png_of(&depth, &CAMERA)).expect("a picture");
        fs::write(repository_path(CAMERA_FILE), camera_json()).expect("a camera");
    }
    let camera = CameraDescription::read(&repository_path(CAMERA_FILE)).expect("a camera");
    let rule = FrameRule { camera: Some(camera), ..FrameRule::default() };
    let frame = read_frame(&repository_path(PICTURE), &rule).expect("a picture").frame;
    assert_eq!(frame.camera, CAMERA);
    for (found, wanted) in frame.depth.iter().zip(&depth) {
        assert!((found - wanted).abs() < 0.00051 || found.is_nan() && wanted.is_nan(), "{found} {wanted}");
    }
}

#[test]
fn every_object_on_the_table_has_its_visible_surface() {
    let workspace = Workspace::new();
    let out = workspace.path("scene");
    let done = segment(PICTURE, &out).option("--intrinsics", CAMERA_FILE).succeed();
    assert!(done.stdout.contains("plane: normal") && done.stdout.contains("object-5: "), "{}", done.stdout);
    let report = read_json(out.join("scene.json"));
    // The table: its normal within half a degree, its distance within 2 mm.
    let up = camera_from_table().rotation() * Vector3::z();
    let normal: Vec<f64> = (0..3).map(|axis| number_at(&report, &format!("/plane/normal/{axis}"))).collect();
    let cosine = up.dot(&Vector3::new(normal[0], normal[1], normal[2]));
    assert!(cosine > 0.99996, "{normal:?}, not {up:?}");
    let height = camera_from_table().inverse().translation().z;
    assert!((number_at(&report, "/plane/offset") - height).abs() < 0.002);
    // The plane's frame has its normal as z, and its origin on it.
    assert_eq!(report["container"], Value::Null);
    let numbers = |value: &Value| -> Vec<f64> { value.as_array().expect("a list").iter().map(number).collect() };
    let position = numbers(&report["plane"]["position"]);
    assert!((0..3).all(|axis| (position[axis] + normal[axis] * height).abs() < 0.002), "{position:?}");
    let [w, x, y, z] = numbers(&report["plane"]["quaternion"]).try_into().expect("four numbers");
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    assert!((rotation * Vector3::z()).dot(&up) > 0.99996);
    // Boxes are upright and around the visible part of a shape; each object rests on the table, apart from the others.
    for object in report["objects"].as_array().expect("objects") {
        let size = numbers(&object["box"]["size"]);
        let axes: Vec<Vec<f64>> = object["box"]["axes"].as_array().expect("axes").iter().map(numbers).collect();
        assert!(size[0] >= size[1] && size[2] > 0.02 && size[0] < 0.3, "{object}");
        assert!(axes[2].iter().zip(&normal).all(|(axis, normal)| (axis - normal).abs() < 1e-12), "{object}");
        assert!(size[2] < number_at(object, "/height") + 0.001, "{object}");
        assert!((0.5..=1.0).contains(&number_at(object, "/confidence")), "{object}");
        let names: Vec<&Value> = object["leans_on"].as_array().expect("a list").iter().map(|row| &row["on"]).collect();
        assert_eq!(names, ["ground"], "{object}");
    }
    // Each mesh lies on one shape and in front of it, and none is left without.
    let objects = report["objects"].as_array().expect("objects");
    let mut found = Vec::new();
    for object in objects {
        assert_eq!(object["refusal"], Value::Null);
        let mesh = read_ply(&out.join(object["surface"].as_str().expect("a file")));
        assert_eq!(mesh.triangles.len() as u64, object["triangles"].as_u64().expect("a count"));
        let nearest = |index: usize| mean_distance(&mesh, &standing(index));
        let best = (0..STANDING.len()).min_by(|a, b| nearest(*a).total_cmp(&nearest(*b))).expect("a shape");
        assert!(nearest(best) < 0.004, "{}: {}", STANDING[best].0, nearest(best));
        found.push(best);
    }
    found.sort_unstable();
    assert_eq!(found, [0, 1, 2, 3, 4]);
    let wanted = [
        "labels.png",
        "object-1.ply",
        "object-2.ply",
        "object-3.ply",
        "object-4.ply",
        "object-5.ply",
        "outlines.png",
        "scene.json",
    ];
    assert_eq!(list_names(&out), wanted);
    // A second run writes the same files, except times; a folder that is not empty is not changed.
    segment(PICTURE, &out).option("--intrinsics", CAMERA_FILE).expect_code(2);
    let again = workspace.path("again");
    segment(PICTURE, &again).option("--intrinsics", CAMERA_FILE).arg("--json").succeed().json::<Value>();
    for name in wanted.into_iter().filter(|name| *name != "scene.json") {
        assert!(fs::read(out.join(name)).expect("a file") == fs::read(again.join(name)).expect("a file"), "{name}");
    }
}

#[test]
fn python_runs_the_program_and_reads_its_files() {
    const LINES: &str = "
import json, sys
import numpy as np
from graspmill.errors import DatasetError
from graspmill.segmenting import PLANE_LABEL, SegmentationFailed, read_segmentation, segment

program, folder, other = sys.argv[1:]
scene = read_segmentation(folder)
report = json.load(open(folder + '/scene.json'))
for found, row in zip(scene.objects, report['objects'], strict=True):
    assert (scene.labels == found.label).sum() == row['pixels'] and len(found.triangles) == row['triangles']
    left, top, right, bottom = row['pixel_box']
    rows, columns = np.nonzero(scene.labels == found.label)
    assert [columns.min(), rows.min(), columns.max(), rows.max()] == [left, top, right, bottom]
    assert found.triangles.max() == len(found.vertices) - 1 and abs(found.vertices.mean(axis=0) - found.centre).max() < 0.01
assert (scene.labels == PLANE_LABEL).any() and scene.container is None and len(scene.objects) == 5

depth = np.full((240, 320), 1.0)
depth[80:155, 100:220] = 0.9
for array in (depth, (1000 * depth).astype(np.uint16)):
    scene = segment(array, (270.0, 270.0, 160.0, 120.0), pixel_centre=0.5, program=program)
    (box,) = [found.box for found in scene.objects]
    assert abs(box.size - (0.397, 0.247, 0.0)).max() < 0.002 and abs(scene.plane.offset - 1.0) < 1e-6, box
    wanted = np.where(depth < 1.0, 1, PLANE_LABEL)
    assert (scene.labels == wanted).all()
try:
    segment(np.full((240, 320), np.nan), (270.0, 270.0, 160.0, 120.0), program=program)
    raise SystemExit('no error')
except SegmentationFailed as error:
    assert 'no pixel has a depth' in str(error), error
try:
    read_segmentation(other)
    raise SystemExit('no error')
except DatasetError as error:
    assert 'scene.json' in str(error), error
";
    let workspace = Workspace::new();
    let out = workspace.path("scene");
    segment(PICTURE, &out).option("--intrinsics", CAMERA_FILE).succeed();
    let python = Program::python_lines(LINES).env("PYTHONPATH", repository_path("python"));
    python.arg(env!("CARGO_BIN_EXE_graspmill")).arg(&out).arg(workspace.path("nowhere")).succeed();
}

#[test]
fn half_a_pixel_is_half_a_pixel() {
    // A slanted table: a shift of half a pixel shows in the plane's distance.
    let workspace = Workspace::new();
    let depth = render(&[table_top()], &CAMERA);
    let picture = workspace.write("plane.png", png_of(&depth, &CAMERA));
    let Intrinsics { fx, fy, cx, cy, .. } = CAMERA;
    let offset = |name: &str, intrinsics: &str, centre: &str| {
        let out = workspace.path(name);
        // The table is empty.
        let run = segment(&picture, &out).option("--intrinsics", intrinsics).option("--pixel-centre", centre);
        let said = run.expect_code(3).stdout;
        assert!(said.contains("no object"), "{said}");
        number_at(&read_json(out.join("scene.json")), "/plane/offset")
    };
    let ours = offset("ours", &format!("{fx},{fy},{cx},{cy}"), "0.5");
    let theirs = offset("theirs", &format!("{fx},{fy},{},{}", cx - 0.5, cy - 0.5), "0");
    let mixed = offset("mixed", &format!("{fx},{fy},{cx},{cy}"), "0");
    let height = camera_from_table().inverse().translation().z;
    assert!((ours - height).abs() < 1e-4, "{ours}, not {height}");
    assert_eq!(ours, theirs);
    // Half a pixel is 1.2 mm at that distance, part of which the slope of the plane absorbs.
    assert!((mixed - height).abs() > 3e-4, "{mixed}, {height}");
}

#[test]
fn wrong_pictures_and_cameras_mean_two_and_name_the_remedy() {
    let workspace = Workspace::new();
    let out = workspace.path("scene");
    let metres = png_of(&scene_depth().iter().map(|depth| depth * 0.001).collect::<Vec<f32>>(), &CAMERA);
    let dark = png_of(&[f32::NAN; 320 * 240], &CAMERA);
    let camera = workspace.write("large.json", camera_json().replace("320", "640"));
    let camera = camera.display().to_string();
    for (picture, intrinsics, says) in [
        (PICTURE.into(), "300,300,159", "3 numbers; give fx,fy,cx,cy"),
        (PICTURE.into(), "300,300,500,120", "another image size"),
        (PICTURE.into(), "nowhere.json", "nowhere.json"),
        (PICTURE.into(), &camera, "640 x 240 px"),
        (workspace.write("metres.png", &metres), CAMERA_FILE, "it would fit"),
        (workspace.write("dark.png", &dark), CAMERA_FILE, "no pixel has a depth"),
        (workspace.write("cut.png", &metres[..500]), CAMERA_FILE, "save the picture again"),
        (workspace.path("nowhere.png"), CAMERA_FILE, "nowhere.png"),
        (repository_path("docs/pictures/objects.png"), CAMERA_FILE, "16 bits"),
    ] {
        let said = segment(&picture, &out).option("--intrinsics", intrinsics).expect_code(2).stderr;
        assert!(said.contains(says), "{says}: {said}");
        assert!(!out.exists(), "nothing is left of it");
    }
    let said = segment(PICTURE, &out).expect_code(2).stderr;
    assert!(said.contains("give its intrinsics"), "{said}");
    let said =
        segment(PICTURE, &out).option("--intrinsics", CAMERA_FILE).option("--plane", "0,0,0,1").expect_code(2).stderr;
    assert!(said.contains("--plane 0,0,0,1: give four numbers"), "{said}");
    for (options, says) in [
        (&["--container", "0.4x0.3"][..], "three lengths in metres such as 0.45x0.35x0.2"),
        (&["--container", "0.4x0.3x0.2"][..], "also needs --container-pose X,Y,Z,QW,QX,QY,QZ"),
        (
            &["--container-pose", "0,0,1,0,1,0,0"][..],
            "also needs the size of the box, such as --container 0.45x0.35x0.2",
        ),
        (
            &["--container", "0.4x0.3x0.2", "--container-pose", "0,0,1"][..],
            "--container-pose 0,0,1: give seven numbers",
        ),
    ] {
        let run = segment(PICTURE, &out).option("--intrinsics", CAMERA_FILE).args(options.iter().copied());
        let said = run.expect_code(2).stderr;
        assert!(said.contains(says), "{says}: {said}");
    }
    // The disk's own troubles are 74.
    let said = segment(PICTURE, Path::new("/proc/scene")).option("--intrinsics", CAMERA_FILE).expect_code(74).stderr;
    assert!(said.contains("/proc/scene"), "{said}");
}

#[test]
fn an_object_at_the_border_is_refused_and_its_surface_written() {
    // The same scene through a camera that sees less of it.
    let workspace = Workspace::new();
    let small = Intrinsics { width: 160, cx: CAMERA.cx - 80.0, ..CAMERA };
    let mut meshes: Vec<TriMesh> = (0..STANDING.len()).map(standing).collect();
    meshes.push(table_top());
    let picture = workspace.write("small.png", png_of(&render(&meshes, &small), &small));
    let out = workspace.path("scene");
    let intrinsics = format!("{},{},{},{}", small.fx, small.fy, small.cx, small.cy);
    let run = segment(picture, &out).option("--intrinsics", intrinsics).option("--pixel-centre", "0.5");
    let said = run.expect_code(3).stdout;
    assert!(said.contains("refused: the picture's border cuts it"), "{said}");
    let report = read_json(out.join("scene.json"));
    let refused = report["objects"].as_array().expect("objects").iter().filter(|object| !object["refusal"].is_null());
    for object in refused {
        assert!(out.join(object["surface"].as_str().expect("a surface")).exists());
    }
}

#[test]
fn several_pictures_get_a_subfolder_each_and_the_rest_is_refused() {
    let workspace = Workspace::new();
    let [one, out] = ["one", "frames"].map(|name| workspace.path(name));
    segment(PICTURE, &one).option("--intrinsics", CAMERA_FILE).succeed();
    let second = workspace.write("second.png", fs::read(repository_path(PICTURE)).expect("a picture"));
    let dark = workspace.write("dark.png", png_of(&[f32::NAN; 320 * 240], &CAMERA));
    let several = |more: &[&Path], out: &Path| {
        segment(PICTURE, out)
            .args(more.iter().map(|path| path.display().to_string()))
            .option("--intrinsics", CAMERA_FILE)
    };
    let said = several(&[&dark, &second], &out).expect_code(3).stdout;
    assert!(said.contains("dark.png: refused: ") && said.contains("second: 5 objects"), "{said}");
    assert_eq!(list_names(&out), ["frames.json", "second", "table"]);
    for name in list_names(&one).into_iter().filter(|name| name != "scene.json") {
        for folder in ["second", "table"] {
            let file = out.join(folder).join(&name);
            assert!(
                fs::read(&file).expect("a file") == fs::read(one.join(&name)).expect("a file"),
                "{}",
                file.display()
            );
        }
    }
    let frames = read_json(out.join("frames.json"))["frames"].clone();
    let facts = |index: usize| (frames[index]["folder"].clone(), frames[index]["objects"].clone());
    assert_eq!(
        [0, 1, 2].map(facts),
        [(json!("table"), json!(5)), (Value::Null, json!(0)), (json!("second"), json!(5))]
    );
    assert!(frames[1]["refusal"].as_str().expect("a reason").contains("no pixel has a depth"), "{frames}");
    // All whole: 0. Wrong settings, and two pictures of one name: 2, and nothing is written.
    several(&[&second], &workspace.path("whole")).succeed();
    let none = workspace.path("none");
    let said = several(&[&second], &none).option("--plane", "0,0,0,1").expect_code(2).stderr;
    assert!(said.contains("--plane 0,0,0,1"), "{said}");
    let same = workspace.write("other/table.png", fs::read(repository_path(PICTURE)).expect("a picture"));
    let said = several(&[&same], &none).expect_code(2).stderr;
    assert!(said.contains("both would be written to table; rename one of them") && !none.exists(), "{said}");
}

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// A mesh of `write_ply`, read by its own rules: little-endian, triangles alone.
pub fn read_ply(path: &Path) -> TriMesh {
    let bytes = fs::read(path).expect("a file");
    let end = bytes.windows(11).position(|window| window == b"end_header\n").expect("a head") + 11;
    let head = String::from_utf8_lossy(&bytes[..end]).into_owned();
    let count = |element: &str| -> usize {
        let line = head.lines().find_map(|line| line.strip_prefix(&format!("element {element} "))).expect("a count");
        line.parse().expect("a count")
    };
    let (vertices, triangles) = (count("vertex"), count("face"));
    let number = |at: usize| f32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let index = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let faces = end + 12 * vertices;
    TriMesh {
        vertices: (0..vertices).map(|vertex| [0, 4, 8].map(|axis| number(end + 12 * vertex + axis))).collect(),
        triangles: (0..triangles).map(|face| [1, 5, 9].map(|corner| index(faces + 13 * face + corner))).collect(),
    }
}

/// Mean distance [m] from the vertices of a mesh in the camera's frame to the nearest vertex of one in the table's.
fn mean_distance(seen: &TriMesh, truth: &TriMesh) -> f64 {
    let points: Vec<Point3<f64>> = truth.vertices.iter().map(in_camera).collect();
    let distance = |vertex: &[f32; 3]| {
        let point = Point3::from(vertex.map(f64::from));
        points.iter().map(|other| (other - point).norm_squared()).fold(f64::INFINITY, f64::min).sqrt()
    };
    let some: Vec<f64> = seen.vertices.iter().step_by(7).map(distance).collect();
    some.iter().sum::<f64>() / some.len() as f64
}

fn in_camera(vertex: &[f32; 3]) -> Point3<f64> {
    let pose: graspmill::geom::Pose<graspmill::geom::CameraCv, Object> = camera_from_table();
    pose.point(&Point3::from(vertex.map(f64::from)))
}
