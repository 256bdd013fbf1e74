//! Scenes of bodies that are packed upright, and piles between walls that are lifted away.

use graspmill::format::{Scene, SceneContainer, SceneMode};

use crate::scenes::{SHAPES, assert_refused, job, scenes};
use crate::support::{
    files::{FULL_CHECK, assert_intact},
    program::{Program, print_root},
    workspace::Workspace,
};

/// Makes a dataset of these keys on two threads and on one, and checks it.
fn made(workspace: &Workspace, keys: &str) -> Vec<Result<Scene, String>> {
    let two = workspace.make_dataset("two", &job(&SHAPES, keys), &[]);
    let one = workspace.path("one");
    Program::run_job(workspace.path("two.toml"), &one).option("--threads", "1").succeed();
    assert_eq!(print_root(&two), print_root(&one));
    assert_intact(&two, FULL_CHECK);
    Program::on("verify", &two).option("--regenerate", "2").succeed();
    // The resolved job makes the same.
    Program::run_job(two.join("job.toml"), workspace.path("again")).succeed();
    assert_eq!(print_root(&two), print_root(workspace.path("again")));
    scenes(&two)
}

/// Largest distance of a body's origin from the middle of the table [m].
fn spread(scene: &Scene) -> f64 {
    scene.bodies.iter().map(|body| body.world_from_object.translation().xy().norm()).fold(0.0, f64::max)
}

#[test]
#[ignore = "slow: settles many bodies"]
fn packed_bodies_stand_upright_around_the_middle() {
    let workspace = Workspace::new();
    let packed = made(&workspace, "mode = \"packed\"\ncount = 6\nscenes = { training = 4 }");
    let tables =
        workspace.make_dataset("tables", &job(&SHAPES, "mode = \"table\"\ncount = 6\nscenes = { training = 4 }"), &[]);
    let mean = |scenes: &[Result<Scene, String>]| {
        let kept: Vec<f64> = scenes.iter().flatten().map(spread).collect();
        assert!(kept.len() >= 3, "{scenes:?}");
        kept.iter().sum::<f64>() / kept.len() as f64
    };
    let (close, wide) = (mean(&packed), mean(&scenes(&tables)));
    assert!(close < 0.75 * wide, "{close} {wide}");
    for scene in packed.iter().flatten() {
        assert_eq!(
            (scene.mode, scene.container.clone()),
            (SceneMode::Packed, SceneContainer::Plane { size: [0.6, 0.6] })
        );
        assert_eq!(scene.bodies.len(), 6);
        for body in &scene.bodies {
            // All of these shapes rest with z of their mesh up.
            let up = body.world_from_object.rotation().matrix()[(2, 2)];
            assert!(up > 0.98, "{up}");
            assert!(body.released_at == 0.0 && body.drift < 2e-3);
        }
        // One body is in the middle.
        let nearest = scene.bodies.iter().map(|body| body.world_from_object.translation().xy().norm());
        assert!(nearest.fold(f64::INFINITY, f64::min) < 0.03);
        // Nothing but the plane carries them.
        assert!(scene.supports.iter().all(|support| support.by == 0));
    }
}

#[test]
#[ignore = "slow: settles many bodies"]
fn bodies_stand_where_their_place_on_the_table_is() {
    let workspace = Workspace::new();
    let made = |name: &str, place: &str| {
        let keys = "mode = \"table\"\ncount = 4\nscenes = { training = 3 }\ntable = { size = [1.0, 0.8] }";
        let scenes = scenes(&workspace.make_dataset(name, &job(&SHAPES, &format!("{keys}\n{place}")), &[]));
        let kept: Vec<Scene> = scenes.iter().flatten().cloned().collect();
        assert!(kept.len() >= 2, "{scenes:?}");
        kept
    };
    let positions = |scenes: &[Scene]| -> Vec<[f64; 2]> {
        let bodies = scenes.iter().flat_map(|scene| &scene.bodies);
        bodies.map(|body| body.world_from_object.translation().xy().into()).collect()
    };
    // The middles of outlines are in the region; the origins of these shapes are within 6 cm of them, also at rest.
    let slack = 0.06;
    // A ring around a shoulder next to the table, as an arm has it.
    let ring = made("ring", "region = { around = [-0.6, 0.1], radius = [0.45, 0.6] }");
    let distances: Vec<f64> = positions(&ring).iter().map(|[x, y]| (x + 0.6).hypot(y - 0.1)).collect();
    assert!(distances.iter().all(|distance| (0.45 - slack..0.6 + slack).contains(distance)), "{distances:?}");
    // Two equal numbers make a circle of it.
    let circle = made("circle", "region = { around = [-0.6, 0.1], radius = [0.55, 0.55] }");
    let distances: Vec<f64> = positions(&circle).iter().map(|[x, y]| (x + 0.6).hypot(y - 0.1)).collect();
    assert!(distances.iter().all(|distance| (distance - 0.55).abs() < slack), "{distances:?}");
    let rectangle = made("rectangle", "region = { x = [-0.4, 0.4], y = [0.2, 0.4] }");
    let rim = positions(&rectangle);
    assert!(rim.iter().all(|[x, y]| x.abs() < 0.4 + slack && (0.2 - slack..0.4).contains(y)), "{rim:?}");
    // Regions make separate samples, which the resolved job makes again.
    assert_ne!(ring[0].sample.subject, rectangle[0].sample.subject);
    let resolved = workspace.path("ring").join("job.toml");
    Program::run_job(resolved, workspace.path("again")).succeed();
    assert_eq!(print_root(workspace.path("ring")), print_root(workspace.path("again")));
    // A region too small for its bodies rejects the scene.
    let keys = "mode = \"table\"\ncount = 4\nscenes = { training = 2 }\nregion = { x = [0.0, 0.02], y = [0.0, 0.02] }";
    let file = workspace.write("small.toml", job(&SHAPES, keys));
    let said = Program::run_job(file, workspace.path("small")).expect_code(3).stdout;
    assert!(said.contains("2 no_room"), "{said}");
}

#[test]
fn mistakes_about_a_place_are_said_with_key_and_remedy() {
    let workspace = Workspace::new();
    for (keys, expected) in [
        ("region = { x = [0.2, 0.1], y = [0.0, 0.1] }", "region.x"),
        ("region = { around = [0.0, 0.0], radius = [0.3, 0.2] }", "region.radius"),
        ("region = { around = [2.0, 0.0], radius = [0.1, 0.2] }", "a part of the table (`table.size`)"),
        ("region = { around = [0.0, 0.0], radius = [0.5, 0.6] }", "a part of the table (`table.size`)"),
        ("region = { x = [0.5, 0.6], y = [0.0, 0.1] }", "a part of the table (`table.size`)"),
        ("region = { around = [0.0, 0.0] }", "region"),
        ("mode = \"heap\"\nregion = { x = [0.0, 0.1], y = [0.0, 0.1] }", "are bodies put next to each other"),
    ] {
        assert_refused(&workspace, &format!("{keys}\nscenes = {{ training = 1 }}"), expected);
    }
}

#[test]
fn what_finds_no_room_is_rejected_and_never_left_out() {
    let workspace = Workspace::new();
    let keys =
        "mode = \"packed\"\ncount = { min = 1, max = 6 }\nscenes = { training = 6 }\ntable = { size = [0.16, 0.16] }";
    let data = workspace.make_dataset("crowded", &job(&SHAPES, keys), &[]);
    let fates = scenes(&data);
    assert!(fates.contains(&Err("no_room".to_owned())), "{fates:?}");
    assert!(
        fates.iter().all(|fate| fate.as_ref().is_ok_and(|scene| scene.gone == 0) || fate == &Err("no_room".to_owned()))
    );
    let said = Program::on("inspect", &data).read_json();
    assert!(said["rejected"]["no_room"].as_u64().is_some_and(|count| count >= 1), "{said}");
}

#[test]
#[ignore = "slow: settles many bodies"]
fn a_pile_is_what_stays_when_its_walls_are_lifted() {
    let workspace = Workspace::new();
    let keys = "mode = \"pile\"\ncount = 5\nscenes = { training = 4 }\ntable = { size = [1.0, 1.0] }\n\
                pile = { side = 0.25, height = 0.2 }";
    let piles = made(&workspace, keys);
    let kept: Vec<&Scene> = piles.iter().flatten().collect();
    assert!(kept.len() >= 3, "{piles:?}");
    for scene in &kept {
        assert_eq!(
            (scene.mode, scene.container.clone()),
            (SceneMode::Pile, SceneContainer::Plane { size: [1.0, 1.0] })
        );
        assert_eq!((scene.bodies.len(), scene.gone), (5, 0));
        // Five drops, 0.2 m at 0.2 m/s, and the time to rest behind it.
        assert!(f64::from(scene.steps) * 0.002 > 4.0 * 0.3 + 1.0 + scene.rest_time, "{}", scene.steps);
    }
    // Some lie on others.
    assert!(kept.iter().any(|scene| scene.supports.iter().any(|support| support.by > 0)));
    Program::on("report", workspace.path("two")).succeed();
    assert!(workspace.read("two/report.html").contains("bodies at rest on their true meshes"));
    // Walls of other sizes make other samples.
    let narrow =
        workspace.make_dataset("narrow", &job(&SHAPES, &keys.replace("0.25", "0.2").replace("= 4", "= 1")), &[]);
    let sample = scenes(&narrow).into_iter().flatten().next().expect("a scene").sample;
    assert_ne!(sample.subject, kept[0].sample.subject);
}

#[test]
#[ignore = "slow: settles many bodies"]
fn an_object_may_stand_twice_where_the_job_says_so() {
    let workspace = Workspace::new();
    let keys =
        "mode = \"packed\"\ncount = 8\nrepeats = true\nscenes = { training = 3 }\nphysics = { friction = [0.3, 0.9] }";
    let found = made(&workspace, keys);
    let mut twice = 0;
    for scene in found.iter().flatten() {
        for (number, body) in scene.bodies.iter().enumerate() {
            let others = scene.bodies[..number].iter().filter(|other| other.object == body.object);
            for other in others {
                twice += 1;
                // Each body has its own friction and pose.
                assert!(other.friction != body.friction && other.world_from_object != body.world_from_object);
            }
        }
        assert_eq!(scene.bodies.len(), 8);
    }
    assert!(twice >= 4, "{twice}");
    let file = workspace.write("job.toml", job(&SHAPES, &keys.replace("count = 8", "count = 13")));
    let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
    assert!(said.contains("no object more than twice"), "{said}");
}

#[test]
fn mistakes_about_walls_are_said_with_key_and_remedy() {
    let workspace = Workspace::new();
    for (keys, expected) in [
        ("mode = \"pile\"\npile = { side = 0.7 }", "at most the sides of the table (`table.size`)"),
        ("mode = \"pile\"\npile = { side = 0.0 }", "pile.side"),
        ("mode = \"pile\"\npile = { lift_speed = 9.0 }", "pile.lift_speed"),
        ("mode = \"pile\"\ncontainer = { wall = 0.01 }", "a bin has a container"),
        ("mode = \"heap\"\npile = { side = 0.2 }", "only a pile has walls"),
        ("mode = \"packed\"\nphysics = { release_interval = 0.2 }", "2 mm above it"),
        ("mode = \"upright\"", "packed"),
    ] {
        assert_refused(&workspace, &format!("{keys}\nscenes = {{ training = 1 }}"), expected);
    }
    // A square that an object does not fit into is announced.
    let keys = "mode = \"pile\"\ncount = 1\nscenes = { training = 2 }\npile = { side = 0.06 }";
    let file = workspace.write("job.toml", job(&["bowl-01"], keys));
    let said = Program::run_job(file, workspace.path("out")).finish();
    assert!(said.text().contains("do not fit into the container"), "{}", said.text());
    assert!(scenes(&workspace.path("out")).iter().all(|fate| *fate == Err("too_large".to_owned())));
}
