//! Containers from mesh files: their content, all derived datasets, and meshes that are no containers.

use std::{
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    format::{PickCandidates, PickObstacle, Scene, SceneContainer},
    geom::TriMesh,
};
use serde_json::Value;

use crate::scenes::{
    amodal::{SHELL, amodal_job, check_by_trimesh, samples, views_job},
    assert_refused, picks, scenes,
    views::check_by_embree,
};
use crate::support::{
    files::{FULL_CHECK, assert_intact, list_shards, read_json, read_text, repository_path},
    jobs::NO_SPLIT,
    meshes::{block, write_stl},
    program::{Program, print_root},
    workspace::Workspace,
};

const TOTE: &str = "scenes/tote.stl";

fn job(mesh: &str, more: &str) -> String {
    format!(
        "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 4\nscenes = {{ training = 3 }}\n\
         container = {{ mesh = {mesh:?}{more} }}\n[[objects]]\n\
         built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\"]\n{NO_SPLIT}"
    )
}

fn repository(path: &str) -> String {
    repository_path(path).display().to_string()
}

/// Compares what the Python package reads with the file, and counts bodies whose middle the mesh's convex hull does not hold.
const IN_TOTE: &str = "
import json, sys, graspmill, numpy as np, trimesh
file = trimesh.load(sys.argv[2])
data = graspmill.Dataset(sys.argv[1], graspmill.SceneSample)
apart, outside, bodies = 0.0, 0, 0
for scene in data:
    kind, room = scene.container
    mesh = trimesh.Trimesh(*scene.container_mesh, process=False)
    assert kind == 'mesh' and mesh.is_watertight
    # The floor inside is 6 mm above the file's.
    apart = max(apart, float(np.abs(mesh.bounds - (file.bounds - [0, 0, 0.006])).max()), abs(mesh.volume / file.volume - 1))
    middles = scene.world_from_object[:, :3, 3]
    bodies += len(middles)
    outside += int((~mesh.convex_hull.contains(middles)).sum())
print(json.dumps(dict(apart=apart, outside=outside, bodies=bodies, room=np.asarray(room).tolist())))
";

/// Contents of the containers in a dataset's table of assets.
fn containers(data: &Path) -> Vec<String> {
    let assets = read_json(data.join("assets.json"));
    let rows = assets["containers"].as_array().expect("containers").iter();
    rows.map(|row| row["object"].as_str().expect("a digest").to_owned()).collect()
}

/// The tote's content in the table of licences.
fn tote_of_licences() -> String {
    let table: toml::Table = toml::from_str(&read_text(repository_path("scenes/licences.toml"))).expect("a table");
    let rows = table["containers"].as_array().expect("containers");
    let tote = rows.iter().find(|row| row["scene"].as_str() == Some(TOTE)).expect("the tote");
    tote["content"].as_str().expect("a digest").to_owned()
}

#[test]
#[ignore = "slow: settles many bodies"]
fn a_release_names_the_container_and_is_refused_without_its_licence() {
    let workspace = Workspace::new();
    let release = |data: &Path, to: &str| {
        let run = Program::on("release", data).option("--out", workspace.path(to));
        run.option("--about", repository_path("datasets/ycb-small/about.toml"))
    };
    let data = workspace.make_dataset("scenes", &job(&repository(TOTE), ""), &[]);
    release(&data, "free").succeed();
    let licences = read_json(workspace.path("free/licences.json"));
    let rows = licences["assets"].as_array().expect("assets");
    let tote = rows.iter().find(|row| row["kind"] == "container").expect("the container");
    assert_eq!((&tote["licence"], &tote["may_be_shipped"]), (&"MIT OR Apache-2.0".into(), &"everything".into()));
    // A mesh of unknown origin.
    write_stl(&workspace.path("tray.stl"), &tray(&[[[-0.19, -0.14, 0.003], [0.19, 0.14, 0.01]]]));
    let data = workspace.make_dataset("tray", &job("tray.stl", ""), &["count=2"]);
    let said = release(&data, "barred").expect_code(2).stderr;
    assert!(said.contains("container container (a mesh file): its licence is not known"), "{said}");
    // Where it may not be copied, no record of a scene may be shipped, since each has its mesh.
    let known = "[licences]\ncontainer = { licence = \"house terms\", redistribute = false, derived = true }\n";
    let about = read_text(repository_path("datasets/ycb-small/about.toml"));
    let about = workspace.write("about.toml", format!("{about}\n{known}"));
    let run = Program::on("release", &data).option("--out", workspace.path("recipe")).option("--about", about);
    run.arg("--recipe").succeed();
    assert_eq!(list_shards(workspace.path("recipe")), Vec::<PathBuf>::new());
}

#[test]
#[ignore = "slow: settles many bodies"]
fn bodies_lie_in_a_tote_wherever_its_file_stands() {
    let workspace = Workspace::new();
    let data = workspace.make_dataset("scenes", &job(&repository(TOTE), ""), &[]);
    assert_intact(&data, FULL_CHECK);
    Program::on("verify", &data).option("--regenerate", "3").succeed();
    // Path and threads change nothing; the resolved job names the content.
    fs::copy(repository_path(TOTE), workspace.path("crate.stl")).expect("a copy");
    let file = workspace.write("other.toml", job("crate.stl", ""));
    let other = workspace.path("other");
    Program::run_job(file, &other).option("--threads", "1").succeed();
    assert_eq!(print_root(&data), print_root(&other));
    assert!(read_text(data.join("job.toml")).contains("content = \""));
    assert_eq!(containers(&data), [tote_of_licences()]);

    let found: Value = Program::python_lines(IN_TOTE)
        .arg(&data)
        .arg(repository_path(TOTE))
        .env("PYTHONPATH", repository_path("python"))
        .succeed()
        .json();
    println!("{found}");
    assert_eq!((found["outside"].as_u64(), found["bodies"].as_u64()), (Some(0), Some(12)), "{found}");
    assert!(found["apart"].as_f64().is_some_and(|apart| apart < 1e-6), "{found}");
    // Between the walls 1 mm above the floor, whose corners are round, and up to the rim.
    let wanted = [2.0 * 0.156, 2.0 * 0.106, 0.144];
    for (side, wanted) in found["room"].as_array().expect("three sides").iter().zip(wanted) {
        assert!(side.as_f64().is_some_and(|side| (0.9 * wanted..=1.02 * wanted).contains(&side)), "{found}");
    }
}

#[test]
#[ignore = "slow: make test-all"]
fn everybody_sees_the_same_tote() {
    let workspace = Workspace::new();
    let data = workspace.make_dataset("scenes", &job(&repository(TOTE), ", tilt_deg = 15"), &[]);
    let kept: Vec<Scene> = scenes(&data).into_iter().flatten().collect();
    assert!(kept.len() >= 2, "{} kept", kept.len());
    for scene in &kept {
        assert!(matches!(&scene.container, SceneContainer::Mesh { tilt_deg: 15.0, .. }));
        assert!(scene.bodies.iter().all(|body| body.drift < 2e-3));
    }
    let views = workspace.make_dataset("views", &views_job("scenes", SHELL, ""), &["views.depth_step=0"]);
    println!("{}", check_by_embree(&views, 4));

    let pairs = workspace.make_dataset("pairs", &amodal_job("views", "channels = { cloud = true }"), &[]);
    println!("{}", check_by_trimesh(&pairs, &views, "8"));
    for made_of_it in [&views, &pairs] {
        assert_eq!(containers(made_of_it), [tote_of_licences()]);
        assert_intact(made_of_it, FULL_CHECK);
    }

    workspace.make_dataset("grasps", &picks::grasps_job(&picks::GRASPED, ""), &[]);
    let picked = workspace.make_dataset("picks", &picks::picks_job("trials = 2"), &[]);
    assert_intact(&picked, FULL_CHECK);
    Program::on("verify", &picked).option("--regenerate", "6").succeed();
    let candidates = samples(&picked).into_iter().map(|sample| sample.read::<PickCandidates>().expect("a record"));
    let blocked = candidates.flat_map(|record| record.candidates).filter_map(|candidate| candidate.ways.shaped.blocked);
    let by_walls = blocked.filter(|blocked| blocked.by == PickObstacle::Container).count();
    assert!(by_walls > 0, "walls are in the way of some grasps");
    Program::on("report", &picked).succeed();
    Program::on("report", &views).succeed();
}

/// Blocks as one mesh: lower and upper corners [m].
fn blocks(parts: &[[[f32; 3]; 2]]) -> TriMesh {
    let mut mesh = TriMesh::default();
    for [low, high] in parts {
        let (part, first) = (block(*low, *high), mesh.vertices.len() as u32);
        mesh.vertices.extend(part.vertices);
        mesh.triangles.extend(part.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
    }
    mesh
}

/// Walls around a floor that reach 1 mm into each other, and the part of it that lies at `floor`.
fn tray(floor: &[[[f32; 3]; 2]]) -> TriMesh {
    let walls = [
        [[-0.2, -0.15, 0.0], [-0.18, 0.15, 0.2]],
        [[0.18, -0.149, 0.001], [0.2, 0.149, 0.199]],
        [[-0.181, 0.13, 0.002], [0.181, 0.148, 0.198]],
        [[-0.181, -0.148, 0.002], [0.181, -0.13, 0.198]],
    ];
    blocks(&[&walls, floor].concat())
}

#[test]
fn a_mesh_without_a_floor_or_walls_is_no_container() {
    let workspace = Workspace::new();
    let tote = fs::read(repository_path(TOTE)).expect("the tote");
    let whole = [[-0.19, -0.14, 0.003], [0.19, 0.14, 0.01]];
    let mut upside_down = tray(&[whole]);
    upside_down.vertices.iter_mut().for_each(|[_, y, z]| (*y, *z) = (-*y, -*z));
    let mut open = tray(&[whole]);
    open.triangles.truncate(open.triangles.len() - 1);
    let write = |name: &str, mesh: &TriMesh| write_stl(&workspace.path(name), mesh);
    write("good.stl", &tray(&[whole]));
    write("upside-down.stl", &upside_down);
    write("open.stl", &open);
    write(
        "middle.stl",
        &tray(&[[[-0.19, -0.14, 0.003], [-0.05, 0.14, 0.01]], [[0.05, -0.14, 0.003], [0.19, 0.14, 0.01]]]),
    );
    write(
        "corner.stl",
        &tray(&[[[-0.19, -0.14, 0.003], [0.1, 0.14, 0.01]], [[0.099, -0.14, 0.004], [0.19, 0.05, 0.009]]]),
    );
    write(
        "side.stl",
        &blocks(&[[[-0.2, -0.15, 0.0], [-0.18, 0.15, 0.2]], [[-0.19, -0.14, 0.003], [0.19, 0.14, 0.01]]]),
    );
    workspace.write("short.stl", &tote[..2000]);
    let refused = |keys: &str, expected: &str| {
        assert_refused(&workspace, &format!("mode = \"bin\"\nscenes = {{ training = 2 }}\n{keys}"), expected);
    };
    for (name, expected) in [
        ("upside-down", "rotate the mesh so that z points out of its opening"),
        ("open", "its surface is not closed"),
        ("middle", "there is no floor below the middle"),
        ("corner", "its floor has a hole at x 0."),
        ("side", "its walls are closed all around to 0.000 m"),
        ("short", "short.stl"),
        ("none", "no such file"),
    ] {
        refused(&format!("container = {{ mesh = \"{name}.stl\" }}"), expected);
    }
    refused(
        "container = { mesh = \"good.stl\", inner_size = [0.3, 0.3, 0.2] }",
        "the mesh sets the size of the container",
    );
    refused("container = { mesh = \"good.stl\", unit = \"mm\" }", "container.mesh");
    refused("container = { unit = \"mm\" }", "`container.mesh` beside it");
    refused(&format!("container = {{ mesh = \"good.stl\", content = \"{}\" }}", "0".repeat(64)), "has changed");
    let heap = "mode = \"heap\"\nscenes = { training = 2 }\ncontainer = { mesh = \"good.stl\" }";
    assert_refused(&workspace, heap, "a bin has a container");
    // Parts that reach into each other are walls and floor as well.
    let made = workspace.make_dataset("good", &job("good.stl", ""), &["count=2", "scenes.training=2"]);
    assert_eq!(scenes(&made).iter().flatten().count(), 2);
}

/// The bin of 30 x 30 x 15 cm with walls of 2 cm as an MJCF file whose floor is its middle, with what cannot collide.
const CRATE: &str = "<mujoco><worldbody><body pos=\"0.7 -0.2 1\">\
    <geom type=\"box\" size=\"0.17 0.17 0.01\" pos=\"0 0 -0.01\"/>\
    <geom type=\"box\" size=\"0.01 0.17 0.075\" pos=\"0.16 0 0.075\"/><geom type=\"box\" size=\"0.01 0.17 0.075\" pos=\"-0.16 0 0.075\"/>\
    <geom type=\"box\" size=\"0.15 0.01 0.075\" pos=\"0 0.16 0.075\"/><geom type=\"box\" size=\"0.15 0.01 0.075\" pos=\"0 -0.16 0.075\"/>\
    <geom type=\"cylinder\" size=\"0.02 0.3\" contype=\"0\" conaffinity=\"0\"/></body></worldbody></mujoco>";

#[test]
fn boxes_of_an_mjcf_file_are_the_bin_that_they_make() {
    let workspace = Workspace::new();
    workspace.write("crate.xml", CRATE);
    let made = scenes(&workspace.make_dataset("crate", &job("crate.xml", ""), &["count=2"]));
    let kept: Vec<&Scene> = made.iter().flatten().collect();
    assert!(kept.len() >= 2, "{made:?}");
    for scene in kept {
        let room = scene.container.room().expect("a container has room inside");
        for (side, wanted) in (room.max - room.min).iter().zip([0.3, 0.3, 0.15]) {
            assert!((side - wanted).abs() < 1e-6, "{room:?}");
        }
        assert!((scene.container.table_z() + 0.02).abs() < 1e-6 && room.min.z.abs() < 1e-6, "{room:?}");
        assert!(scene.bodies.iter().all(|body| body.drift < 2e-3));
        for body in &scene.bodies {
            let middle = body.world_from_object.translation();
            assert!(middle.x.abs().max(middle.y.abs()) < 0.15 && (-1e-3..0.15).contains(&middle.z), "{middle}");
        }
    }
    // A view of it, by Embree.
    let views = workspace.make_dataset("views", &views_job("crate", SHELL, ""), &["views.depth_step=0"]);
    println!("{}", check_by_embree(&views, 2));

    let refused = |keys: &str, expected: &str| {
        assert_refused(&workspace, &format!("mode = \"bin\"\nscenes = {{ training = 2 }}\n{keys}"), expected);
    };
    workspace.write("round.xml", CRATE.replace(" contype=\"0\" conaffinity=\"0\"", ""));
    workspace.write("empty.xml", "<mujoco><worldbody/></mujoco>");
    workspace.write("broken.xml", "<mujoco><worldbody>");
    refused("container = { mesh = \"round.xml\" }", "has a geom that is round");
    refused("container = { mesh = \"empty.xml\" }", "longest side is 0.000 m");
    refused("container = { mesh = \"broken.xml\" }", "broken.xml");
    refused("container = { mesh = \"none.xml\" }", "none.xml");
    refused("container = { mesh = \"crate.xml\", unit = \"mm\" }", "an MJCF file is in metres");
}
