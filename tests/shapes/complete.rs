//! `graspmill complete` on a scene whose truth is known, by files alone, as a user calls it.

use std::{fs, path::Path};

use graspmill::{
    geom::TriMesh,
    runtime::completion::{CameraDescription, Completer, CompletionModel, Detail, FrameRule, SceneRule, read_frame},
};
use serde_json::Value;

use super::{network::MODEL, segment::read_ply, table::STANDING};
use crate::support::{
    files::{list_names, number_at, read_json, repository_path},
    program::Program,
    workspace::Workspace,
};

const PICTURE: &str = "scenes/table.png";
const CAMERA_FILE: &str = "scenes/table.json";

fn complete(out: &Path) -> Program {
    let run = Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE);
    run.option("--model", MODEL).option("--out", out)
}

/// Every edge is used once in each sense.
fn is_closed(mesh: &TriMesh) -> bool {
    let mut edges = std::collections::BTreeSet::new();
    let sides = mesh.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
    sides.into_iter().all(|edge| edges.insert(edge)) && edges.iter().all(|[a, b]| edges.contains(&[*b, *a]))
}

#[test]
fn every_object_becomes_a_closed_mesh_that_holds_what_was_seen() {
    let workspace = Workspace::new();
    let out = workspace.path("completed");
    let said = complete(&out).option("--target", "all").succeed().stdout;
    assert!(said.contains("object-5: target") && said.contains("T = segment"), "{said}");
    let report = read_json(out.join("scene.json"));
    let objects = report["objects"].as_array().expect("objects");
    assert_eq!(objects.len(), STANDING.len());
    for object in objects {
        let completed = &object["completed"];
        let mesh = read_ply(&out.join(completed["mesh"].as_str().expect("a mesh")));
        assert!(is_closed(&mesh), "{object}");
        assert!(mesh.signed_volume() > 0.0, "faces are wound outward");
        assert!((mesh.signed_volume() - number_at(completed, "/volume")).abs() < 1e-9);
        // Seen cells are filled, so that nothing reaches far into what the camera saw through; the shapes are no deeper
        // than they are.
        assert!(number_at(completed, "/free_space_violation") < 0.03, "{object}");
        assert!(number_at(completed, "/partial_cells") > 50.0, "{object}");
        let cell = number_at(completed, "/cell_size");
        for axis in 0..3 {
            let side =
                number_at(completed, &format!("/bounds/1/{axis}")) - number_at(completed, &format!("/bounds/0/{axis}"));
            assert!(side > 4.0 * cell && side < 40.0 * cell, "{object}");
        }
    }
    let names = list_names(&out);
    let meshes: Vec<String> = (1..=5).map(|number| format!("object-{number}.ply")).collect();
    let wanted: Vec<String> = meshes.into_iter().chain(["overlay.png", "scene.json"].map(str::to_owned)).collect();
    assert_eq!(names, wanted);
    // The same bytes by one thread and by two.
    for threads in ["1", "2"] {
        let again = workspace.path(threads);
        complete(&again).args(["--target", "all", "--threads", threads]).succeed();
        for name in names.iter().filter(|name| *name != "scene.json") {
            assert!(fs::read(out.join(name)).expect("a file") == fs::read(again.join(name)).expect("a file"), "{name}");
        }
    }
}

#[test]
fn targets_are_chosen_by_number_and_pixel_and_others_are_obstacles() {
    let workspace = Workspace::new();
    let target_of = |name: &str, target: &str| -> Vec<usize> {
        let out = workspace.path(name);
        let report: Value = complete(&out).args(["--target", target, "--json"]).succeed().json();
        let roles = report["objects"].as_array().expect("objects").iter().map(|object| object["role"].as_str());
        let roles: Vec<&str> = roles.map(|role| role.expect("a role")).collect();
        assert!(roles.iter().all(|role| ["target", "obstacle"].contains(role)));
        (1..).zip(roles).filter(|(_, role)| *role == "target").map(|(number, _)| number).collect()
    };
    assert_eq!(target_of("number", "3"), [3]);
    // The can stands alone, nearest to the picture's middle.
    let automatic = target_of("auto", "auto");
    assert_eq!(automatic.len(), 1);
    let report = read_json(workspace.path("auto/scene.json"));
    let centre = format!("/objects/{}/completed/grid_centre/0", automatic[0] - 1);
    assert!((number_at(&report, &centre) - STANDING[3].1[0]).abs() < 0.03, "{report}");
    assert_eq!(target_of("pixel", "172,147"), automatic);
    for (target, says) in [
        ("6", "the picture has 5 objects"),
        ("0", "the picture has 5 objects"),
        ("5,5", "no object is at that pixel"),
        ("320,5", "320 x 240 pixels"),
        ("cup", "it is none of those"),
    ] {
        let said = complete(&workspace.path("none")).option("--target", target).expect_code(2).stderr;
        assert!(said.contains(says) && said.contains("give auto, all"), "{says}: {said}");
    }
}

#[test]
fn meshes_come_in_every_form_and_mujoco_takes_the_scene() {
    let workspace = Workspace::new();
    for (to, endings) in [("obj", ["obj", "obj"]), ("stl", ["stl", "stl"]), ("mjcf", ["obj", "xml"])] {
        let out = workspace.path(to);
        complete(&out).args(["--to", to, "--detail", "thesis"]).succeed();
        let names = list_names(&out);
        let is_there = |ending: &str| names.iter().any(|name| name.ends_with(&format!(".{ending}")));
        assert!(endings.into_iter().all(is_there), "{to}: {names:?}");
    }
    // Five free bodies with masses of their own, which simulation leaves finite. Completions reach a little into the table, so how
    // far they move is no measure.
    let said = Program::python_lines(
        "import sys, mujoco, numpy\nmodel = mujoco.MjModel.from_xml_path(sys.argv[1])\ndata = mujoco.MjData(model)\n\
         for _ in range(300):\n    mujoco.mj_step(model, data)\n\
         print(model.nbody - 1, model.body_mass[1:].min(), numpy.isfinite(data.qpos).all())\n",
    );
    let said = said.arg(workspace.path("mjcf/scene.xml")).succeed().stdout;
    let words: Vec<&str> = said.split_whitespace().collect();
    assert!(words[0] == "5" && words[2] == "True", "{said}");
    assert!(words[1].parse::<f64>().expect("a mass") > 0.01, "{said}");
}

#[test]
fn refused_objects_mean_three_and_refused_models_two() {
    let workspace = Workspace::new();
    let out = workspace.path("high");
    let said = complete(&out).option("--min-height", "0.5").expect_code(3).stdout;
    assert!(said.contains("no object stands on it"), "{said}");
    let run = Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE);
    let said = run.option("--model", workspace.folder()).option("--out", workspace.path("x")).expect_code(2).stderr;
    assert!(said.contains("model.json") && said.contains("is it a model's folder"), "{said}");
    assert!(!workspace.path("x").exists());
}

#[test]
fn the_library_completes_without_the_program() {
    let camera = CameraDescription::read(&repository_path(CAMERA_FILE)).expect("a camera");
    let rule = FrameRule { camera: Some(camera), ..FrameRule::default() };
    let frame = read_frame(&repository_path(PICTURE), &rule).expect("a picture").frame;
    let model = CompletionModel::open(&repository_path(MODEL)).expect("a model");
    let completer = Completer::new(model, Detail::Surface);
    let scene = completer.segment(frame, &SceneRule::default());
    let cluster = &scene.clusters[0];
    let target = completer.complete(&scene, cluster).expect("a mesh");
    let obstacle = completer.complete_obstacle(&scene, cluster).expect("a mesh");
    assert_eq!(target.prediction, obstacle.prediction);
    assert!(is_closed(&target.mesh) && is_closed(&obstacle.mesh));
    assert!(target.timings.total() >= target.timings.network);
}
