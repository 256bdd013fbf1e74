//! Scenes from the job file to the reader: equal on any number of threads, one more mesh changes only the scenes that
//! draw it, mistakes are reported with their keys.

mod alike;
mod amodal;
mod amodal_touch;
mod exported;
mod heatmaps;
mod imported;
mod modes;
mod pick_trials;
mod picks;
mod scene_picks;
mod segmenting;
mod sets;
mod suction;
mod tables;
mod tilted;
mod verbs;
mod vessels;
mod views;
mod volumes;

use std::path::Path;

use crate::support::{
    files::{FULL_CHECK, assert_intact, read_json, repository_path},
    jobs::NO_SPLIT,
    meshes::{centred_block, round, write_stl},
    program::Program,
    workspace::Workspace,
};
use alike::make_alike;
use graspmill::{
    files::Folder,
    format::{
        Scene,
        dataset::{DatasetReader, Fate},
    },
    geom::TriMesh,
    words::Split,
};

/// Shapes of every job here.
const SHAPES: [&str; 6] = ["bottle-01", "box-01", "can-01", "cup-01", "cup-02", "mug-01"];

/// Drawn by about half of the scenes of three bodies.
const ONE_MORE: &str = "bowl-01";

/// A job of these shapes without a split, with more top-level keys.
fn job(shapes: &[&str], keys: &str) -> String {
    format!(
        "product = \"scenes\"\nseed = 5\n{keys}\n[[objects]]\nbuilt_in = {shapes:?}\n[shards]\nscenes = 3\n{NO_SPLIT}"
    )
}

const BINS: &str =
    "mode = \"bin\"\ncount = 3\ncontainer = { inner_size = [0.3, 0.3, 0.15] }\nscenes = { training = 6, holdout = 2 }";

/// Outcome of each scene: its record, or the reason of its reject.
fn scenes(folder: &Path) -> Vec<Result<Scene, String>> {
    let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
    let mut found = Vec::new();
    for shard in 0..reader.manifest().shards.len() {
        for row in reader.ledger(shard).expect("a ledger").rows {
            found.push(match row.fate {
                Fate::Kept(_) => {
                    let sample = reader.sample(row.index).expect("readable").expect("stored");
                    Ok(sample.read::<Scene>().expect("a scene"))
                }
                Fate::Rejected { reason, .. } => Err(reason),
            });
        }
    }
    found
}

/// Prints what the Python package reads of the first scene, and the splits.
const READ: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.SceneSample)
scene = data[0]
carried = [sum(share for by, body, share in scene.supports if body == number + 1) for number in range(len(scene.objects))]
names = {row['object'] for row in data.folder.objects()}
print(json.dumps([scene.scene_id, scene.mode, scene.container[0], len(scene.contacts.pairs), min(carried),
    float(np.abs(np.linalg.det(scene.world_from_object[:, :3, :3]) - 1).max()), set(scene.objects) <= names,
    sorted(set(data.column('split').tolist())), int(scene.overview.instances.max()), len(data)]))
";

/// Prints the largest residual of force and of torque of any body, by the law of docs/format.md: shares of the weight, and of the weight
/// times half the longest side of the object's box; last the largest torque that torsion and rolling friction leave out.
const BALANCE: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.SceneSample)
extents = {row['object']: max(row['extents']) for row in data.folder.objects()}
worst = np.zeros(3)
for scene in data:
    contacts = scene.contacts
    for body, (mass, centre, name) in enumerate(zip(scene.masses, scene.centres_of_mass, scene.objects), 1):
        sign = (contacts.pairs[:, 1] == body).astype(float) - (contacts.pairs[:, 0] == body)
        weight = np.array([0, 0, 9.81 * mass])
        arms = sign @ np.cross(contacts.points - centre, contacts.forces)
        residuals = [sign @ contacts.forces - weight, arms + sign @ contacts.torques, arms]
        scales = 9.81 * mass * np.array([1, extents[name] / 2, extents[name] / 2])
        worst = np.maximum(worst, np.linalg.norm(residuals, axis=1) / scales)
print(json.dumps(worst.tolist()))
";

#[test]
fn threads_and_tasks_change_nothing_and_one_more_mesh_changes_the_scenes_that_draw_it() {
    let workspace = Workspace::new();
    let two = make_alike(&workspace, &job(&SHAPES, BINS), "3");

    // One more mesh: every scene without it keeps its bytes.
    let more = [&SHAPES[..], &[ONE_MORE]].concat();
    let more = workspace.make_dataset("more", &job(&more, BINS), &[]);
    let assets = read_json(more.join("assets.json"));
    let rows = assets["objects"].as_array().expect("objects");
    let added =
        rows.iter().find(|row| row["name"] == ONE_MORE).expect("the mesh")["object"].as_str().expect("a digest");
    let (before, after) = (scenes(&two), scenes(&more));
    assert_eq!((before.len(), after.len()), (8, 8));
    let mut drawn = 0;
    for (before, after) in before.iter().zip(&after) {
        let draws = |scene: &Scene| scene.bodies.iter().any(|body| body.object.to_string() == added);
        match (before, after) {
            (Ok(before), Ok(after)) => {
                drawn += usize::from(draws(after));
                assert_eq!(before == after, !draws(after));
                assert_eq!(before.id() == after.id(), !draws(after));
            }
            (before, after) => panic!("a scene was rejected: {before:?} {after:?}"),
        }
    }
    assert!((1..8).contains(&drawn), "{drawn}");

    // Something carries each body in a container, according to the reader.
    let read: (String, String, String, usize, f64, f64, bool, Vec<String>, u8, usize) =
        Program::python_lines(READ).arg(&two).env("PYTHONPATH", repository_path("python")).succeed().json();
    let Ok(first) = &before[0] else { panic!("the first scene was kept") };
    assert_eq!(read.0, first.id().to_string());
    assert_eq!((read.1.as_str(), read.2.as_str(), read.3), ("bin", "bin", first.contacts.len()));
    assert!(read.4 > 0.5, "a body carried by {} of its weight", read.4);
    assert!(read.5 < 1e-9 && read.6);
    // Forces carry the weights, and torques balance where torsion and rolling friction count.
    let [force, torque, without]: [f64; 3] =
        Program::python_lines(BALANCE).arg(&two).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert!(force < 0.02 && torque < 0.01 && without > 0.02, "{force} {torque} {without}");
    assert_eq!((read.7, read.8, read.9), (vec!["holdout".to_owned(), "training".to_owned()], 255, 8));
}

/// Bodies dropped from a height, in steps that are too long for their walls.
#[test]
#[ignore = "slow: settles many bodies"]
fn bodies_in_one_another_settle_once_more_in_shorter_steps() {
    let workspace = Workspace::new();
    let shapes = [&SHAPES[..], &[ONE_MORE]].concat();
    let text = |finer: u32| {
        let bin = "container = { inner_size = [0.3, 0.25, 0.5] }\nscenes = { training = 6 }\nmode = \"bin\"\ncount = 5";
        job(&shapes, &format!("{bin}\nphysics = {{ timestep = 0.004, release_height = 0.7, substeps = {finer} }}"))
    };
    let [once, again] =
        [("once", 1), ("again", 4)].map(|(name, finer)| scenes(&workspace.make_dataset(name, &text(finer), &[])));
    let mut mended = 0;
    for (once, again) in once.iter().zip(&again) {
        match once {
            Err(reason) if reason == "too_deep" || reason == "crossed" => mended += usize::from(again.is_ok()),
            once => assert_eq!(once, again),
        }
    }
    assert!(mended > 0, "{:?}", once.iter().map(|scene| scene.as_ref().err()).collect::<Vec<_>>());
    assert!(again.iter().flatten().all(|scene| scene.depths[0] <= 5e-4 && scene.depths[1] <= 1e-3));
}

/// By a lax rule bodies rest while they still fall: what the check by further stepping moves settles on.
#[test]
#[ignore = "slow: settles many bodies"]
fn bodies_that_the_check_moves_settle_on_from_there() {
    let workspace = Workspace::new();
    let lax = "mode = \"bin\"\ncount = 4\nscenes = { training = 6 }\nphysics = { rest_speed = 0.1, rest_time = 0.05 }";
    let data = workspace.make_dataset("lax", &job(&SHAPES, lax), &[]);
    assert_intact(&data, FULL_CHECK);
    Program::on("verify", &data).option("--regenerate", "2").succeed();
    let found = scenes(&data);
    let kept: Vec<&Scene> = found.iter().flatten().collect();
    assert!(kept.len() >= 5, "{:?}", found.iter().map(|scene| scene.as_ref().err()).collect::<Vec<_>>());
    for scene in &kept {
        assert!(scene.bodies.len() == 4 && scene.bodies.iter().all(|body| body.drift < 2e-3 && body.turn < 0.035));
    }
    // Two seconds of the check count as time to rest.
    let again = kept.iter().filter(|scene| scene.rest_time > 2.0).count();
    assert!(again > 0, "{:?}", kept.iter().map(|scene| scene.rest_time).collect::<Vec<_>>());
}

/// Heaps on tables so small that balls and cans roll off.
#[test]
fn bodies_that_leave_the_container_are_put_back() {
    let workspace = Workspace::new();
    let text = |put_back: u32| {
        let heap = "mode = \"heap\"\ntable = { size = [0.3, 0.3] }\ncount = 5\nscenes = { training = 8 }";
        job(&SHAPES, &format!("{heap}\nphysics = {{ max_redrops = {put_back} }}"))
    };
    let [once, again] =
        [("once", 0), ("again", 3)].map(|(name, times)| scenes(&workspace.make_dataset(name, &text(times), &[])));
    let mut mended = 0;
    for (once, again) in once.iter().zip(&again) {
        match (once, again) {
            (Err(reason), Ok(scene)) => {
                assert_eq!(reason, "gone");
                mended += 1;
                assert_eq!((scene.bodies.len(), scene.gone), (5, 0));
                // Somebody was let go after the last of the first releases.
                let released = scene.bodies.iter().map(|body| body.released_at);
                assert!(released.clone().fold(0.0, f64::max) > 4.0 * 0.3 + 0.25, "{:?}", released.collect::<Vec<_>>());
            }
            (once, again) => assert_eq!(once.as_ref().ok(), again.as_ref().ok()),
        }
    }
    assert!(mended > 0, "{:?}", once.iter().map(|scene| scene.as_ref().err()).collect::<Vec<_>>());
}

#[test]
fn every_body_is_carried_and_stands_still_on_a_table() {
    let workspace = Workspace::new();
    let keys = "mode = \"table\"\ncount = { min = 2, max = 4 }\nscenes = { training = 4 }\nphysics = { friction = [0.3, 0.9] }";
    let data = workspace.make_dataset("tables", &job(&SHAPES, keys), &[]);
    assert_intact(&data, FULL_CHECK);
    let mut kept = 0;
    for scene in scenes(&data).into_iter().flatten() {
        kept += 1;
        assert!((2..=4).contains(&scene.bodies.len()));
        for (number, body) in (1..).zip(&scene.bodies) {
            let supports = scene.supports.iter().filter(|support| support.body == number);
            let carried: f64 = supports.map(|support| support.share).sum();
            assert!((carried - 1.0).abs() < 0.1, "body {number} is carried by {carried} of its weight");
            // In the resting pose that it was put in, or one near to it.
            let (_, angle) = body.resting.expect("a resting pose");
            assert!(angle < 0.2, "body {number} leans by {angle}");
            assert!((0.3..0.9).contains(&body.friction) && body.drift < 2e-3 && body.released_at == 0.0);
        }
    }
    assert!(kept >= 3, "{kept}");
    Program::on("report", &data).succeed();
    let page = workspace.read("tables/report.html");
    assert!(page.contains("bodies at rest on their true meshes") && page.contains("resting pose"));
    let facts = Program::on("inspect", &data).read_json();
    assert_eq!(facts["samples"], 4);
}

/// Asserts that a job of [`SHAPES`] with these keys is refused with these words, and that nothing is written.
fn assert_refused(workspace: &Workspace, keys: &str, expected: &str) {
    let file = workspace.write("job.toml", job(&SHAPES, keys));
    let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
    assert!(said.contains(expected), "{keys}\n{said}");
    assert!(!workspace.path("none").exists(), "{keys}");
}

#[test]
fn mistakes_are_said_with_key_and_remedy() {
    let workspace = Workspace::new();
    let scenes = "scenes = { training = 2 }";
    for (keys, expected) in [
        (format!("count = 0\n{scenes}"), "count"),
        (format!("count = 21\n{scenes}"), "count"),
        (format!("count = {{ min = 5, max = 2 }}\n{scenes}"), "count.min"),
        ("count = 2".to_owned(), "set their number"),
        (format!("mode = \"table\"\ncontainer = {{ wall = 0.02 }}\n{scenes}"), "a bin has a container"),
        (format!("mode = \"bin\"\ntable = {{ size = [1.0, 1.0] }}\n{scenes}"), "table"),
        (format!("mode = \"heaps\"\n{scenes}"), "mode"),
        (format!("physics = {{ friction = [0.9, 0.3] }}\n{scenes}"), "the lower number first"),
        (format!("physics = {{ friction = 0.0 }}\n{scenes}"), "physics.friction"),
        (format!("physics = {{ friction = 10.0 }}\n{scenes}"), "physics.friction"),
        (format!("physics = {{ release_height = 0.3 }}\n{scenes}"), "2 mm above it"),
        (format!("physics = {{ rest_time = 5.0 }}\n{scenes}"), "physics.rest_time"),
        (format!("container = {{ inner_size = [0.4, 0.3, -0.2] }}\nmode = \"bin\"\n{scenes}"), "container.inner_size"),
        (format!("bodies = 4\n{scenes}"), "`count` sets the number of bodies"),
    ] {
        assert_refused(&workspace, &keys, expected);
    }
    // More bodies than objects: known once the objects are split.
    let file = workspace.write("job.toml", job(&SHAPES, &format!("count = 7\n{scenes}")));
    let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
    assert!(
        said.contains("scenes.training") && said.contains("no object twice") && said.contains("lower `count`"),
        "{said}"
    );
    assert!(!workspace.path("none").exists(), "the folder is free for the corrected job");
}

#[test]
fn an_object_larger_than_its_bin_is_announced_and_its_scenes_rejected() {
    let workspace = Workspace::new();
    let keys = "mode = \"bin\"\ncount = 1\ncontainer = { inner_size = [0.06, 0.06, 0.05] }\nscenes = { training = 2 }";
    let file = workspace.write("job.toml", job(&["bottle-01", "bowl-01"], keys));
    let out = workspace.path("out");
    let said = Program::run_job(&file, &out).finish();
    assert!(said.text().contains("do not fit into the container"), "{}", said.text());
    let fates = scenes(&out);
    assert!(fates.contains(&Err("too_large".to_owned())), "{fates:?}");
    let reader = DatasetReader::open(&Folder::at(&out)).expect("a dataset");
    assert!(reader.splits().objects.iter().all(|row| row.split == Split::Training));
}

/// A folder of files that are invalid or incomplete: each refused one is named with its remedy, and scenes have the
/// others.
#[test]
fn unusable_meshes_are_refused_by_name_and_an_open_one_may_be_weighed() {
    let workspace = Workspace::new();
    std::fs::create_dir(workspace.path("meshes")).expect("a folder");
    let write = |name: &str, mesh: &TriMesh| write_stl(&workspace.path(format!("meshes/{name}.stl")), mesh);
    write("millimetres", &centred_block([40.0, 30.0, 25.0]));
    // A box without its lid, and a sheet bent about one edge.
    let mut open = centred_block([0.04, 0.03, 0.025]);
    open.triangles.retain(|face| face.iter().any(|&corner| open.vertices[corner as usize][2] < 0.0));
    assert_eq!(open.triangles.len(), 10);
    write("open", &open);
    let corners =
        [[0.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.05, 0.0, 0.0], [0.05, 0.1, 0.0], [0.05, 0.0, 0.06], [0.05, 0.1, 0.06]];
    write(
        "sheet",
        &TriMesh { vertices: corners.to_vec(), triangles: vec![[0, 2, 1], [1, 2, 3], [2, 4, 3], [3, 4, 5]] },
    );
    let keys = "mode = \"heap\"\ncount = 1\nscenes = { training = 2 }\n[[objects]]\nfolder = \"meshes\"\n";
    let job = |masses: &str| format!("product = \"scenes\"\nseed = 5\n{keys}{masses}{NO_SPLIT}");
    let mut weighed = Vec::new();
    for (name, masses) in [("plain", ""), ("known", "meshes = { open = { mass = 0.05 }, sheet = { mass = 0.05 } }\n")] {
        let file = workspace.write("job.toml", job(masses));
        let out = workspace.path(name);
        let said = Program::run_job(file, &out).expect_code(3).text();
        for expected in
            ["millimetres.stl: longest side 80.000 m", "set unit = \"mm\"", "sheet.stl: no inside", "close the surface"]
        {
            assert!(said.contains(expected), "{expected}\n{said}");
        }
        assert!(
            said.contains("open: 1 hole: 4 edges, 80.000 mm wide") && !said.contains("refused: meshes/open"),
            "{said}"
        );
        assert_intact(&out, FULL_CHECK);
        let found: Vec<Scene> = scenes(&out).into_iter().flatten().collect();
        assert_eq!(found.len(), 2);
        weighed.push(found[0].bodies[0].mass);
    }
    // As full as if its lid were on, of the density of what has no material.
    assert!((0.02..0.24).contains(&weighed[0]) && weighed[0] != 0.05 && weighed[1] == 0.05, "{weighed:?}");
}

/// Thin walls that fall on thin walls, edge first or not: no kept body has passed through.
#[test]
#[ignore = "slow: make test-all"]
fn two_thousand_cups_fall_on_bowls_and_none_is_kept_in_one() {
    let workspace = Workspace::new();
    let keys = "mode = \"heap\"\ncount = 2\nscenes = { training = 2000 }\nphysics = { release_height = 0.3 }";
    let job = format!("product = \"scenes\"\n{keys}\n[[objects]]\nbuilt_in = [\"bowl-01\", \"cup-01\"]\n{NO_SPLIT}");
    let data = workspace.make_dataset("cups", &job, &[]);
    assert!(scenes(&data).iter().flatten().count() > 1800);
    let overlaps = Program::peer("peers/bin/python").arg("tests/peers/overlaps.py");
    let python = overlaps.arg(&data).arg("2000").env("PYTHONPATH", repository_path("python"));
    let found: serde_json::Value = python.succeed().json();
    println!("{found}");
    let number = |name: &str| found[name].as_f64().expect("a number");
    assert!(number("cut") > 100.0 && number("cut") == number("pairs") && number("worst") < 1.0, "{found}");
}

/// Twenty balls are the largest number of bodies of a scene, and all of them roll.
#[test]
#[ignore = "slow: make test-all"]
fn twenty_balls_come_to_rest_or_are_rejected() {
    let workspace = Workspace::new();
    let balls = "mode = \"bin\"\ncount = 20\nscenes = { training = 10 }\n[[objects]]\nfolder = \"meshes\"\nsizes = [0.5, 0.52, \
                 0.54, 0.56, 0.58, 0.6, 0.62, 0.64, 0.66, 0.68, 0.7, 0.72, 0.74, 0.76, 0.78, 0.8, 0.82, 0.84, 0.86, 0.88]\n";
    std::fs::create_dir(workspace.path("meshes")).expect("a folder");
    write_stl(&workspace.path("meshes/ball.stl"), &round(40, |_, _| 0.05));
    let data = workspace.make_dataset("balls", &format!("product = \"scenes\"\nseed = 1\n{balls}{NO_SPLIT}"), &[]);
    let kept: Vec<Scene> = scenes(&data).into_iter().flatten().collect();
    println!("{} of 10 scenes of 20 balls are kept", kept.len());
    assert!(kept.len() >= 5);
    assert!(kept.iter().all(|scene| scene.bodies.len() == 20 && scene.depths[0] <= 0.5e-3));
}
