//! Imported scenes: external poses, kept unchanged, with the measurements of the checks of settled scenes.

use std::{collections::BTreeSet, path::Path};

use graspmill::{
    files::Folder,
    format::{Scene, SceneMode, dataset::DatasetReader},
    geom::{Pose, SourceWorld, TriMesh, World, rotation_from_quaternion},
    ids::ObjectId,
    words::Split,
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::scenes::scenes;
use crate::support::{
    files::{FULL_CHECK, assert_intact, read_json},
    jobs::NO_SPLIT,
    meshes::{built_in_mesh, stl_bytes},
    program::{Program, print_root},
    solid::{Ends, Solid},
    workspace::Workspace,
};

/// A job that imports scenes of three shapes.
fn job(import: &str, split: &str) -> String {
    format!(
        "product = \"scenes\"\nseed = 5\n[[objects]]\nbuilt_in = [\"box-01\", \"can-01\", \"mug-01\"]\n[import]\n{import}\n\
         [shards]\nscenes = 1\n{split}"
    )
}

/// Heights of the origins of three shapes above their plane, and the first one's length [m].
struct Shapes {
    heights: [f64; 3],
    length: f64,
}

fn shapes() -> Shapes {
    let bounds = ["box-01", "can-01", "mug-01"].map(|name| built_in_mesh(name).aabb().expect("vertices"));
    Shapes { heights: bounds.map(|bounds| -bounds.min.z), length: bounds[0].extents()[0] }
}

/// Two scenes on a table 20 cm above the world's origin: a can and a mug that are apart, and two boxes that overlap by
/// 5 mm, one of which hovers.
fn table() -> String {
    let Shapes { heights, length } = shapes();
    let ([cube, can, mug], beside) = (heights.map(|height| 0.2 + height), length - 0.005);
    let raised = cube + 0.01;
    format!(
        "scene,object,x,y,z,qx,qy,qz,qw\napart,can-01,1.00,2.0,{can},0,0,0,1\napart,mug-01,1.25,2.0,{mug},0,0,0.6,0.8\n\
         overlap,box-01,0,0,{cube},0,0,0,1\noverlap,box-01,{beside},0.01,{raised},0,0,0,1\n"
    )
}

fn kept(folder: &Path) -> Vec<Scene> {
    scenes(folder).into_iter().map(|fate| fate.expect("imported scenes are kept")).collect()
}

/// Prints what the Python package reads of the source of each scene.
const READ: &str = "\
import json, sys, graspmill
data = graspmill.Dataset(sys.argv[1], graspmill.SceneSample)
print(json.dumps([[scene.mode, scene.source, scene.crossed, scene.world_from_source[:3, 3].tolist()] for scene in data]))
";

#[test]
fn poses_of_a_table_are_kept_as_they_are_and_their_overlaps_are_measured() {
    let workspace = Workspace::new();
    workspace.write("poses.csv", table());
    let data = workspace.make_dataset("poses", &job("csv = \"poses.csv\"", NO_SPLIT), &[]);
    assert_intact(&data, FULL_CHECK);
    let [apart, overlap] = &kept(&data)[..] else { panic!("two scenes") };
    // The table is at height 0 and the middle of the bodies at the origin.
    let Shapes { heights: [cube, can, mug], length } = shapes();
    for (scene, expected) in [(apart, [can, mug]), (overlap, [cube, cube + 0.01])] {
        assert_eq!((scene.mode, scene.steps, scene.gone), (SceneMode::Imported, 0, 0));
        for (body, height) in scene.bodies.iter().zip(expected) {
            assert!((body.world_from_object.translation().z - height).abs() < 1e-6, "{body:?}");
        }
    }
    let along = apart.bodies[1].world_from_object.translation() - apart.bodies[0].world_from_object.translation();
    assert!((along.xy().norm() - 0.25).abs() < 1e-9, "{along}");
    let middle = overlap.bodies[0].world_from_object.translation() + overlap.bodies[1].world_from_object.translation();
    assert!(middle.xy().norm() < 1e-6, "{middle}");
    // One scene is at rest, of the other both bodies are pushed away.
    assert!(apart.depths[0] == 0.0 && apart.depths[1] < 1e-5 && apart.bodies.iter().all(|body| body.drift < 2e-3));
    assert!((overlap.depths[0] - 0.005).abs() < 1e-4, "{:?}", overlap.depths);
    assert!(overlap.bodies.iter().all(|body| body.drift > 1e-3), "{:?}", overlap.facts());
    let sources: Vec<&str> =
        [apart, overlap].iter().map(|scene| scene.import.as_ref().expect("a source").source.as_str()).collect();
    assert_eq!(sources, ["apart", "overlap"]);

    // The report, the inspection and the Python package have these numbers.
    Program::on("report", &data).succeed();
    let page = workspace.read("poses/report.html");
    assert!(page.contains("1 of the scenes bodies overlap by more than 0.5 mm"), "the report has no overlaps");
    assert!(page.contains("2 bodies of overlap") && page.contains("5.00 mm deep"), "no card of the scene");
    let facts = Program::on("inspect", &data).read_json();
    assert_eq!((&facts["imported"]["too_deep"], &facts["imported"]["moved"]), (&1.into(), &1.into()));
    assert!(Program::on("inspect", &data).succeed().stdout.contains("in 1 a body moves by 2 mm or 2 degrees"));
    let read: Vec<(String, String, u32, [f64; 3])> = Program::python_lines(READ)
        .arg(&data)
        .env("PYTHONPATH", crate::scenes::repository_path("python"))
        .succeed()
        .json();
    assert_eq!((read[1].0.as_str(), read[1].1.as_str(), read[1].2), ("imported", "overlap", 0));
    assert!((read[1].3[0] + (length - 0.005) / 2.0).abs() < 1e-6 && (read[1].3[2] + 0.2).abs() < 1e-6, "{read:?}");

    // Threads change nothing, and the resolved job needs no file.
    Program::run_job(workspace.path("poses.toml"), workspace.path("one")).option("--threads", "1").succeed();
    assert_eq!(print_root(&data), print_root(workspace.path("one")));
    std::fs::remove_file(workspace.path("poses.csv")).expect("a file");
    Program::run_job(data.join("job.toml"), workspace.path("again")).succeed();
    assert_eq!(print_root(&data), print_root(workspace.path("again")));
    let digest = |name: &str| read_json(workspace.path(name).join("manifest.json"))["job_digest"].clone();
    assert_eq!(digest("poses"), digest("again"));
}

#[test]
fn scenes_of_a_split_have_objects_of_its_side() {
    let workspace = Workspace::new();
    workspace.write("poses.csv", table());
    let import = "csv = \"poses.csv\"\nsplit = \"test\"\ntable_height = 0.15";
    let refused = workspace.write("refused.toml", job(import, NO_SPLIT));
    let said = Program::run_job(refused, workspace.path("none")).expect_code(2).stderr;
    assert!(
        said.contains("scene apart") && said.contains("does not have the split test") && said.contains("import.split"),
        "{said}"
    );
    let split = "[split]\nvalidation_objects = 0\ntest_objects = [\"can-01\", \"box-01\"]\n";
    let mixed = workspace.write("mixed.toml", job(import, split));
    let said = Program::run_job(mixed, workspace.path("neither")).expect_code(2).stderr;
    assert!(said.contains("`mug-01` does not have the split test"), "{said}");
    // The overlapping boxes alone, 5 cm above the stated table.
    let Shapes { heights: [cube, ..], length } = shapes();
    let body = |x: f64| format!("{{ object = \"box-01\", pose = [{x}, 0.0, {}, 0.0, 0.0, 0.0, 1.0] }}", cube + 0.05);
    let bodies = format!("bodies = [{}, {}]", body(0.0), body(length - 0.005));
    let listed = format!("scenes = [{{ source = \"by hand\", {bodies} }}]\nsplit = \"test\"\ntable_height = 0.0");
    let data = workspace.make_dataset("listed", &job(&listed, split), &[]);
    let reader = DatasetReader::open(&Folder::at(&data)).expect("a dataset");
    let sample =
        reader.iter(graspmill::format::dataset::Selection::default()).next().expect("a sample").expect("readable");
    assert_eq!(reader.split(sample.index), Some(Split::Test));
    let scene = sample.read::<Scene>().expect("a scene");
    assert!((scene.bodies[0].world_from_object.translation().z - cube - 0.05).abs() < 1e-6, "{scene:?}");
    assert!(scene.contacts.iter().all(|contact| contact.pair[0] != 0), "nothing touches the table");
}

#[test]
fn faults_of_files_are_said_with_line_and_remedy() {
    let workspace = Workspace::new();
    let said_of = |name: &str, content: &str, import: &str| {
        workspace.write(name, content);
        let file = workspace.write("job.toml", job(import, NO_SPLIT));
        let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
        assert!(!workspace.path("none").exists(), "{content}");
        said
    };
    let head = "scene,object,x,y,z,qx,qy,qz,qw\n";
    let many: String = (0..21).map(|index| format!("a,can-01,{index},0,0,0,0,0,1\n")).collect();
    for (rows, expected) in [
        ("a,cam-01,0,0,0,0,0,0,1\n", ["poses.csv:2:", "did you mean `can-01`"]),
        ("a,can-01,0,0,0,0,0,0,1\na,can-01,0,0,0,0,0,0,1\n", ["poses.csv:3:", "twice in one pose"]),
        ("a,can-01,0,0,0,0,0,0,1.1\n", ["poses.csv:2:", "divide it by its length"]),
        ("a,can-01,0,0,0,0,0,1\n", ["poses.csv:2:", "seven numbers"]),
        (&many, ["poses.csv:2:", "1 to 20 bodies in scene `a`"]),
        ("", ["poses.csv:1:", "at least one body"]),
    ] {
        let said = said_of("poses.csv", &format!("{head}{rows}"), "csv = \"poses.csv\"");
        assert!(expected.iter().all(|words| said.contains(words)), "{expected:?}\n{said}");
    }
    // Keys that do not go together.
    let poses = format!("{head}a,can-01,0,0,0,0,0,0,1\n");
    for (import, expected) in [
        ("csv = \"poses.csv\"\nimages = [1]", "applies to folders of BOP"),
        ("csv = \"poses.csv\"\nbop = [\"000001\"]", "bop and csv"),
        ("split = \"test\"", "one of `bop`, `csv` and `scenes`"),
        ("csv = \"nowhere.csv\"", "nowhere.csv"),
        ("csv = \"poses.csv\"\nup = [0, 0, 0]", "a direction"),
        ("bop = [\"000001\"]", "scene_gt.json"),
        ("csv = \"poses.csv\"\nsplit = \"all\"", "import.split"),
        ("csv = \"poses.csv\"\ncontainer_pose = [0, 0, 0, 0, 0, 0, 1]", "describe the container"),
    ] {
        let said = said_of("poses.csv", &poses, import);
        assert!(said.contains(expected), "{import}\n{said}");
    }
    for keys in ["mode = \"bin\"", "count = 3", "scenes = { training = 2 }", "physics = { settle_timeout = 2.0 }"] {
        let file = workspace.write("job.toml", format!("{keys}\n{}", job("csv = \"poses.csv\"", NO_SPLIT)));
        let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
        assert!(said.contains("imported scenes are kept as they are"), "{keys}\n{said}");
    }
}

/// Settled bins are reproduced from their poses alone, for any pose of their bin in the world of a file.
#[test]
fn bodies_come_into_a_container() {
    let workspace = Workspace::new();
    let container = "container = { inner_size = [0.3, 0.25, 0.15], wall = 0.01, tilt_deg = 10 }\n";
    let objects = "[[objects]]\nbuilt_in = [\"bottle-01\", \"box-01\", \"can-01\", \"mug-01\"]\n";
    let settle = format!(
        "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 3\nscenes = {{ training = 2 }}\n{container}\
         physics = {{ friction = 0.5 }}\n{objects}{NO_SPLIT}"
    );
    let data = workspace.make_dataset("settled", &settle, &[]);
    let assets = read_json(data.join("assets.json"));
    let name_of = |id: &ObjectId| {
        let rows = assets["objects"].as_array().expect("rows").iter();
        let row = rows.into_iter().find(|row| row["object"] == id.to_string().as_str()).expect("its row");
        row["name"].as_str().expect("a name").to_owned()
    };
    let settled = kept(&data);
    // The bin's x points along y of the world, its floor is 0.75 m up.
    let half = 0.5_f64.sqrt();
    let source_from_world: Pose<SourceWorld, World> =
        Pose::new(rotation_from_quaternion([half, 0.0, 0.0, half]), Vector3::new(0.5, -0.2, 0.75));
    let mut table = "scene,object,x,y,z,qx,qy,qz,qw\n".to_owned();
    for (number, scene) in settled.iter().enumerate() {
        for body in &scene.bodies {
            let pose = source_from_world * body.world_from_object;
            let rotation = UnitQuaternion::from_rotation_matrix(pose.rotation());
            let numbers = pose.translation().iter().chain(rotation.coords.iter());
            let numbers: Vec<String> = numbers.map(f64::to_string).collect();
            table += &format!("{number},{},{}\n", name_of(&body.object), numbers.join(","));
        }
    }
    workspace.write("poses.csv", table);
    let pose = format!("[0.5, -0.2, 0.75, 0.0, 0.0, {half}, {half}]");
    let import = |more: &str| {
        format!(
            "product = \"scenes\"\nseed = 5\n{container}physics = {{ friction = 0.5 }}\n{objects}[import]\ncsv = \"poses.csv\"\n\
             {more}\n{NO_SPLIT}"
        )
    };
    let data = workspace.make_dataset("imported", &import(&format!("container_pose = {pose}")), &[]);
    assert_intact(&data, FULL_CHECK);
    let imported = kept(&data);
    assert_eq!(imported.len(), settled.len());
    for (settled, imported) in settled.iter().zip(&imported) {
        assert_eq!((&settled.container, imported.mode), (&imported.container, SceneMode::Imported));
        for (one, other) in settled.bodies.iter().zip(&imported.bodies) {
            assert_eq!(one.object, other.object);
            let apart = one.world_from_object.translation() - other.world_from_object.translation();
            assert!(apart.norm() < 1e-12, "{apart}");
            assert!((one.drift - other.drift).abs() < 1e-3, "{} {}", one.drift, other.drift);
        }
        assert!((settled.depths[1] - imported.depths[1]).abs() < 1e-9, "{:?} {:?}", settled.depths, imported.depths);
    }
    // The resolved job has the same values.
    Program::run_job(data.join("job.toml"), workspace.path("again")).succeed();
    assert_eq!(print_root(&data), print_root(workspace.path("again")));
    // Views see the bin around them.
    let views = "product = \"views\"\nseed = 3\n[scenes]\ndataset = \"imported\"\n[views]\nmin_pixels = 50\n\
                 cameras = [{ shell = { radius = [0.5, 0.7], polar_deg = [10, 40] }, views = 1, width = 160, height = 120, \
                 fx = 120.0 }]\n";
    assert_intact(workspace.make_dataset("views", views, &[]), FULL_CHECK);
    // Keys that do not go together.
    for (more, expected) in [
        ("up = [0, 0, 1]", "gives the pose of the container"),
        ("table_height = 0.2", "gives the pose of the container"),
        ("container_pose = [0, 0, 0, 0, 0, 0, 2]", "a pose"),
    ] {
        let file = workspace.write("job.toml", import(more));
        let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
        assert!(said.contains(expected), "{more}\n{said}");
    }
    let file = workspace.write("job.toml", import("").replace("[import]", "[table]\nsize = [1, 1]\n[import]"));
    let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
    assert!(said.contains("into a container or onto a table"), "{said}");
}

/// A cup that is a cone, upright on its bottom of radius 3 cm, 4 cm at the rim, 10 cm high, 1.5 mm thick, and the
/// height of a second one in it whose wall overlaps its own by a length.
fn cone() -> (TriMesh, impl Fn(f64) -> f64) {
    let (bottom, top, height, wall) = (0.03_f64, 0.04, 0.1, 0.0015);
    let slope = (top - bottom).atan2(height);
    let across = wall / slope.cos();
    let inside = bottom + (top - bottom) * wall / height - across;
    let profile = [[0.0, 0.0], [bottom, 0.0], [top, height], [top - across, height], [inside, wall], [0.0, wall]];
    (Solid::lathe(&profile, 256, Ends::Polygons).mesh(), move |depth| (wall - depth) / slope.sin())
}

/// Twenty nested cups, their walls 0.1 mm deep in each other: contacts of neighbours only, as deep as the slope
/// implies.
#[test]
fn twenty_nested_cups_touch_their_neighbours_as_deep_as_their_slope_says() {
    let workspace = Workspace::new();
    let (mesh, step) = cone();
    workspace.write("meshes/cup.stl", stl_bytes(&mesh));
    let depth = 1e-4;
    let rows = (0..20).map(|number| format!("nested,cup,0,0,{},0,0,0,1\n", f64::from(number) * step(depth)));
    workspace.write("poses.csv", format!("scene,object,x,y,z,qx,qy,qz,qw\n{}", rows.collect::<String>()));
    let job = format!(
        "product = \"scenes\"\nseed = 1\nphysics = {{ stability_time = 0.1 }}\n[[objects]]\nfolder = \"meshes\"\n[import]\n\
         csv = \"poses.csv\"\n{NO_SPLIT}"
    );
    let [nested] = &kept(&workspace.make_dataset("nested", &job, &[]))[..] else { panic!("one scene") };
    assert_eq!(nested.bodies.len(), 20);
    let between: Vec<_> = nested.contacts.iter().filter(|contact| contact.pair[0] != 0).collect();
    let pairs: BTreeSet<[u32; 2]> = between.iter().map(|contact| contact.pair).collect();
    assert_eq!(pairs, (1..20).map(|lower| [lower, lower + 1]).collect());
    assert_eq!(between.len(), 8 * 19);
    for contact in between {
        assert!((contact.distance + depth).abs() < 1e-6, "{contact:?}");
    }
}

/// Our own export of BOP, read back: models whose origins lie elsewhere, cameras in the world, millimetres.
#[test]
fn a_dataset_of_bop_comes_back_as_scenes() {
    let workspace = Workspace::new();
    let bins = "product = \"scenes\"\nseed = 5\nmode = \"table\"\ncount = 3\nscenes = { training = 2 }\n[[objects]]\n\
                built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"mug-01\"]\n";
    let settled = kept(&workspace.make_dataset("settled", &format!("{bins}{NO_SPLIT}"), &[]));
    let views = "product = \"views\"\nseed = 3\n[scenes]\ndataset = \"settled\"\n[views]\nmin_pixels = 50\n\
                 cameras = [{ shell = { radius = [0.5, 0.7], polar_deg = [10, 40] }, views = 2, width = 160, height = 120, \
                 fx = 120.0 }]\n";
    let views = workspace.make_dataset("views", views, &[]);
    let bop = workspace.path("bop");
    Program::on("export", &views).option("--to", "bop").option("--out", &bop).succeed();
    let folders = ["000000", "000001"].map(|name| format!("\"bop/train/{name}\""));
    let import = |more: &str| {
        format!(
            "product = \"scenes\"\nseed = 5\n[[objects]]\nfolder = \"bop/models\"\nunit = \"mm\"\ninclude = [\"*.ply\"]\n[import]\n\
             bop = [{}]\n{more}\n{NO_SPLIT}",
            folders.join(", ")
        )
    };
    let data = workspace.make_dataset("imported", &import("table_height = 0.0"), &[]);
    let models = read_json(bop.join("objects.json"));
    let imported = kept(&data);
    assert_eq!(imported.len(), 2);
    for (settled, imported) in settled.iter().zip(&imported) {
        assert_eq!(settled.bodies.len(), imported.bodies.len());
        let centre = |index: usize| {
            let digest = settled.bodies[index].object.to_string();
            let models = models.as_object().expect("models").values();
            let model = models.into_iter().find(|model| model["object"] == digest.as_str()).expect("its model");
            let centre = model["centre"].as_array().expect("three numbers");
            let centre: Vec<f64> = centre.iter().map(|part| part.as_f64().expect("a number")).collect();
            settled.bodies[index].world_from_object.point(&nalgebra::Point3::from_slice(&centre))
        };
        for (index, body) in imported.bodies.iter().enumerate() {
            // Where the middle of its box was, but for a shift along the table.
            let shift = imported.bodies[0].world_from_object.translation() - centre(0).coords;
            let moved = body.world_from_object.translation() - centre(index).coords;
            assert!((moved - shift).norm() < 1e-5 && moved.z.abs() < 1e-5, "{moved} {shift}");
            let rotations = [body, &settled.bodies[index]].map(|body| *body.world_from_object.rotation().matrix());
            assert!((rotations[0] - rotations[1]).amax() < 1e-9, "{rotations:?}");
            assert!(body.drift < 3e-3, "{body:?}");
        }
    }
    // Every image of a folder shows the same.
    let every = kept(&workspace.make_dataset("every", &import("every_image = true\ntable_height = 0.0"), &[]));
    assert_eq!(every.len(), 4);
    let apart = |scene: &Scene| {
        scene.bodies[1].world_from_object.translation() - scene.bodies[0].world_from_object.translation()
    };
    assert!((apart(&every[0]) - apart(&every[1])).norm() < 1e-5);

    // Views of imported scenes are made as of all others.
    let views = workspace.read("views.toml").replace("\"settled\"", "\"imported\"");
    assert_intact(workspace.make_dataset("again", &views, &[]), FULL_CHECK);

    // An unknown model, and an image that is not there.
    for (more, expected) in [("objects = { \"1\" = \"cup\" }", "obj_id 1"), ("images = [9]", "no image 9")] {
        let file = workspace.write("job.toml", import(more));
        let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
        assert!(said.contains(expected), "{said}");
    }
}
