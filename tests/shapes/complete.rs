//! `graspmill complete` on a scene whose truth is known, by files alone, as a user calls it.

use std::{fs, path::Path};

use graspmill::{
    geom::TriMesh,
    runtime::completion::{
        CameraDescription, Completer, CompletionModel, Detail, FrameRule, SceneRule, SegmentedScene, read_frame,
    },
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
        assert!(number_at(completed, "/free_space_violation") < 0.002, "{object}");
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
    // The can is alone, nearest to the picture's middle.
    let automatic = target_of("auto", "auto");
    assert_eq!(automatic.len(), 1);
    let report = read_json(workspace.path("auto/scene.json"));
    let centre = format!("/objects/{}/completed/grid_centre/0", automatic[0] - 1);
    assert!((number_at(&report, &centre) - STANDING[3].1[0]).abs() < 0.03, "{report}");
    assert_eq!(target_of("pixel", "172,147"), automatic);
    for (target, says) in [
        ("6", "the picture has 5 objects"),
        ("0", "the picture has 5 objects"),
        ("5,5", "the pixel shows the table, not an object"),
        ("320,5", "320 x 240 pixels"),
        ("cup", "not a valid target"),
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
    // Five free bodies with their own masses, which simulation leaves finite. Completions reach a little into the
    // table, so their motion is no measure.
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
#[ignore = "slow: every detail and baseline"]
fn every_detail_and_every_baseline_makes_closed_meshes_that_stay_out_of_seen_space() {
    let workspace = Workspace::new();
    let run = |name: &str, options: &[&str]| -> Value {
        let out = workspace.path(name);
        let run = Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE).args(options.iter().copied());
        let report: Value = run.option("--out", &out).arg("--json").succeed().json();
        for object in report["objects"].as_array().expect("objects") {
            let mesh = read_ply(&out.join(object["completed"]["mesh"].as_str().expect("a mesh")));
            assert!(is_closed(&mesh) && mesh.signed_volume() > 0.0, "{object}");
        }
        report
    };
    let worst = |report: &Value| {
        let objects = report["objects"].as_array().expect("objects").iter();
        objects.map(|object| number_at(object, "/completed/free_space_violation")).fold(0.0, f64::max)
    };
    let details = ["coverage", "thesis", "joined"];
    let reports = details.map(|detail| run(detail, &["--model", MODEL, "--target", "all", "--detail", detail]));
    for (report, detail) in reports.iter().zip(details) {
        assert_eq!(report["detail"], detail);
        assert!(worst(report) <= 0.03, "{report}");
    }
    assert!(worst(&reports[2]) <= worst(&reports[0]));
    // Obstacles do not reach into space that the camera sees through, for any method of filling cells.
    for method in ["hull", "hull-to-table", "extrude-to-table", "mirror", "mirror-shell", "extrude", "hull+smooth"] {
        let report = run(method, &["--method", method, "--target", "1"]);
        assert!(report["model"].is_null() && report["method"] == method);
        assert!(worst(&report) <= 0.03, "{report}");
    }
    // Some objects are no ball, cylinder or box: that is reported, and no sheet of the visible surface replaces a body.
    let out = workspace.path("primitive");
    let run = Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE).args(["--method", "primitive"]);
    let said = run.args(["--target", "all", "--json"]).option("--out", &out).expect_code(3).stdout;
    let report: Value = serde_json::from_str(&said).expect("JSON");
    let objects = report["objects"].as_array().expect("objects");
    let refusals = objects.iter().filter_map(|object| object["refusal"].as_str());
    assert!(refusals.clone().all(|words| words.contains("no occupied cell was found")), "{report}");
    assert!((1..objects.len()).contains(&refusals.count()), "{report}");
    for object in objects.iter().filter(|object| object["refusal"].is_null()) {
        let mesh = read_ply(&out.join(object["completed"]["mesh"].as_str().expect("a mesh")));
        assert!(is_closed(&mesh) && mesh.signed_volume() > 5e-5, "{object}");
        assert!(number_at(object, "/completed/free_space_violation") <= 0.03, "{object}");
    }
}

#[test]
fn without_a_model_the_network_in_the_program_completes() {
    let workspace = Workspace::new();
    let run = |out: &str| {
        let run = Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE).args(["--target", "all"]);
        run.option("--out", workspace.path(out))
    };
    let said = run("text").succeed().stdout;
    assert!(said.contains("model: bundled, the network in this program"), "{said}");
    let report: Value = run("json").args(["--json", "--loose", "drop"]).succeed().json();
    assert_eq!(report["model"]["folder"], "bundled");
    let named: Value = run("named").args(["--json", "--loose", "drop", "--method", "bundled"]).succeed().json();
    assert_eq!(report["model"], named["model"]);
    for object in report["objects"].as_array().expect("objects") {
        assert_eq!(object["completed"]["bodies"], 1, "{object}");
        assert_eq!(object["completed"]["loose_volume"], 0.0, "{object}");
        // The five shapes are convex or hollow bodies on a table: nothing of them is deep below it.
        assert!(number_at(object, "/completed/below_plane") <= 0.2, "{object}");
    }
    let checked: Value = Program::new("model").args(["check", "--json"]).succeed().json();
    assert_eq!(checked["digest"], report["model"]["digest"]);
    let said = run("flat").args(["--method", "hull-to-table", "--no-plane"]).expect_code(3).stdout;
    assert!(said.contains("hull-to-table needs the table: pass --plane, or leave out --no-plane"), "{said}");
}

#[test]
fn masks_contacts_and_the_world_are_taken_or_refused_with_the_remedy() {
    let workspace = Workspace::new();
    // The can's pixels by a mask, out of the clusters that the program finds itself.
    let rule = FrameRule {
        camera: Some(CameraDescription::read(&repository_path(CAMERA_FILE)).expect("a camera")),
        ..FrameRule::default()
    };
    let frame = read_frame(&repository_path(PICTURE), &rule).expect("a picture").frame;
    let scene = SegmentedScene::segment(frame, &SceneRule::default());
    let can = scene.clusters.last().expect("clusters");
    let mut mask = vec![0; 320 * 240];
    can.pixels.iter().for_each(|pixel| mask[*pixel as usize] = 255);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 320, 240);
    encoder.set_color(png::ColorType::Grayscale);
    let mut writer = encoder.write_header().expect("a head");
    writer.write_image_data(&mask).expect("pixels");
    writer.finish().expect("an end");
    let mask = workspace.write("mask.png", bytes);
    let base = |out: &str| {
        let run = Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE).option("--method", "hull");
        run.option("--out", workspace.path(out))
    };
    let by_mask: Value = base("mask").option("--target", &mask).arg("--json").succeed().json();
    let by_number: Value = base("number").args(["--target", "5", "--json"]).succeed().json();
    assert_eq!(by_mask["objects"].as_array().map(Vec::len), Some(5));
    assert_eq!(by_mask["objects"][0]["role"], "target");
    assert_eq!(by_mask["objects"][0]["completed"]["volume"], by_number["objects"][4]["completed"]["volume"]);
    // Behind the can: the hull grows.
    let centre = ["0", "1", "2"].map(|axis| number_at(&by_number, &format!("/objects/4/completed/grid_centre/{axis}")));
    let contact = format!("x,y,z\n{},{},{}\n", centre[0], centre[1], centre[2] + 0.03);
    let contacts = workspace.write("contacts.csv", &contact);
    let pose = "1,2,3,0,1,0,0";
    let run = base("touched").option("--target", "5").option("--touch", &contacts).args([
        "--camera-pose",
        pose,
        "--to",
        "mjcf",
    ]);
    let touched: Value = run.arg("--json").succeed().json();
    assert_eq!(touched["objects"][4]["completed"]["touched_cells"], 1);
    let volume = |report: &Value| number_at(report, "/objects/4/completed/volume");
    assert!(volume(&touched) > 1.05 * volume(&by_number), "{} {}", volume(&touched), volume(&by_number));
    assert_eq!(touched["objects"][4]["completed"]["contacts_outside"], 0);
    // The same contact and one in millimetres, then that one alone.
    let millimetres = "34,-4,726\n";
    let mixed = workspace.write("mixed.csv", format!("{contact}{millimetres}"));
    let said = base("mixed").option("--target", "5").option("--touch", &mixed).succeed().stdout;
    assert!(said.contains("object-5: ignored contacts outside its grid: 1"), "{said}");
    base("one").option("--target", "5").option("--touch", &contacts).succeed();
    let mesh = |out: &str| fs::read(workspace.path(out).join("object-5.ply")).expect("a mesh");
    assert_eq!(mesh("mixed"), mesh("one"));
    let elsewhere = workspace.write("elsewhere.csv", format!("x,y,z\n{millimetres}"));
    let said = base("elsewhere").option("--target", "5").option("--touch", &elsewhere).expect_code(2).stderr;
    assert!(said.contains("elsewhere.csv: none of the contacts (1) is in the object's grid"), "{said}");
    assert!(!workspace.path("elsewhere").exists());
    // Half a turn about x: the camera's z is the world's -z.
    let rows: Vec<Vec<f64>> = serde_json::from_value(touched["world_from_camera"].clone()).expect("rows");
    assert_eq!(rows[0], [1.0, 0.0, 0.0, 1.0]);
    assert!((rows[2][2] + 1.0).abs() < 1e-12 && rows[2][3] == 3.0, "{rows:?}");
    let scene = fs::read_to_string(workspace.path("touched/scene.xml")).expect("a scene");
    assert!(scene.contains("pos=\"1 2 3\" quat=\"0 1 0 0\"") && scene.contains("gravity=\"0 0 -9.81\""), "{scene}");
    let small = workspace.write("small.csv", "1,2\n");
    for (options, says) in [
        (["--target", "no.png"], "no.png: it cannot be read"),
        (["--touch", small.to_str().expect("a path")], "line 1: '1,2'; each line must contain three numbers"),
        (["--camera-pose", "1,2,3"], "give seven numbers"),
        (["--camera-pose", "0,0,0,2,0,0,0"], "a unit quaternion"),
        (["--method", "knn"], "use it on a dataset"),
    ] {
        let run = if options[0] == "--method" {
            Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE).option("--out", workspace.path("x"))
        } else {
            base("x")
        };
        let said = run.args(options).expect_code(2).stderr;
        assert!(said.contains(says), "{says}: {said}");
    }
    // Contacts of several objects, and a model without an input for them.
    let run = || complete(&workspace.path("y")).option("--touch", &contacts);
    assert!(run().args(["--target", "all"]).expect_code(2).stderr.contains("contacts belong to one object"));
    assert!(run().expect_code(2).stderr.contains("the model has no input for contacts"));
}

#[test]
fn refused_objects_mean_three_and_refused_models_two() {
    let workspace = Workspace::new();
    let out = workspace.path("high");
    let said = complete(&out).option("--min-height", "0.5").expect_code(3).stdout;
    assert!(said.contains("no objects found"), "{said}");
    let run = Program::on("complete", PICTURE).option("--intrinsics", CAMERA_FILE);
    let said = run.option("--model", workspace.folder()).option("--out", workspace.path("x")).expect_code(2).stderr;
    assert!(said.contains("model.json") && said.contains("a model folder must contain"), "{said}");
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
