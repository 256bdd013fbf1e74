//! Patches to train on: labels by trials, points behind the surface, squares in metres, and the table under the object.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::LazyLock,
};

use graspmill::{
    files::Folder,
    format::{
        Channel, Depth, GraspLabel, GraspRun, GraspTrials, HeatmapPatch, PATCH_POINTS, PatchHeatmap, PatchImageColour,
        PatchMetric, PatchPoint, PatchTable, PatchTrial, PatchVisibility, VISIBLE_TOLERANCE,
        dataset::{DatasetReader, Fate, Manifest, Sample, Selection},
        extras::{Shapes, read_types},
    },
    geom::{Ray, RenderMesh, SimdLevel, TriMesh, TriangleTree},
    ids::{ItemId, ObjectId, SampleId},
    render::Rasteriser,
    words::{GraspTypeCounts, NumberClass},
};
use nalgebra::{Point3, Unit, Vector3};

use crate::support::{
    files::{FULL_CHECK, assert_intact},
    jobs::barrett_line,
    program::Program,
    workspace::Workspace,
};

/// A folder with a dataset of grasps that were tried, and the job for their patches, made once.
static WORKSPACE: LazyLock<Workspace> = LazyLock::new(|| {
    let workspace = Workspace::kept("patch_marks");
    let hand = barrett_line();
    // Labels, and no other results of the grasps.
    let few_trials = "[physics]\nperturbed_runs = 0\nrollout_share = 0.0\nvariant_share = 0.0\n";
    let grasps = format!(
        "product = \"grasps\"\nseed = 5\n{hand}\
         objects = [{{ built_in = [\"can-01\", \"box-01\", \"half-cube-sphere\"] }}]\n[grasps]\nseeds = 3\n\
         [annealing]\nsteps = 1500\n[keep]\nspace = \"force\"\nmin_epsilon = 0.0\n{few_trials}\
         [split]\nvalidation_objects = 0\ntest_objects = 1\nholdout_items = 0.4\n"
    );
    workspace.make_dataset("grasps", &grasps, &[]);
    let lying = format!(
        "product = \"grasps\"\nseed = 5\n{hand}\
         objects = [{{ built_in = [\"can-01\", \"box-01\", \"half-cube-sphere\"] }}]\n[grasps]\nseeds = 2\n\
         sampler = \"antipodal\"\n[antipodal]\nsupport = \"table\"\n{few_trials}\
         [split]\nvalidation_objects = 0\ntest_objects = 1\nholdout_items = 0.4\n"
    );
    workspace.make_dataset("lying", &lying, &[]);
    workspace.write(
        "patches.toml",
        format!(
            "product = \"patches\"\nseed = 5\n{hand}[grasps]\ndataset = \"grasps\"\n[images]\nfull = true\n\
             heatmaps = true\n[shards]\nsamples = 20\n"
        ),
    );
    workspace.run_job("patches", "depth").set(["render.colour=false"]).succeed();
    workspace.run_job("patches", "table").set(ON_TABLE).succeed();
    workspace
});

/// Grasps that were sampled for a table, and enough types that some of them failed.
const LYING: [&str; 3] = ["grasps.dataset=lying", "scene.table=true", "grasps.types=64"];
const ON_TABLE: [&str; 4] = ["render.colour=false", LYING[0], LYING[1], LYING[2]];

fn run(out: &str, settings: &[&str], threads: &str) -> Manifest {
    WORKSPACE.run_job("patches", out).set(settings).args(["--threads", threads]).succeed();
    Manifest::read(&Folder::at(WORKSPACE.path(out))).expect("a finished dataset")
}

fn open(name: &str) -> DatasetReader {
    DatasetReader::open(&Folder::at(WORKSPACE.path(name))).expect("a dataset")
}

fn samples(reader: &DatasetReader) -> Vec<Sample> {
    reader.iter(Selection::default()).collect::<Result<_, _>>().expect("samples")
}

/// Runs and trials of the dataset of grasps.
fn read_trials(grasps: &str) -> BTreeMap<SampleId, (GraspRun, GraspTrials)> {
    let read = |sample: Sample| {
        let (run, trials) =
            (sample.read::<GraspRun>().expect("a run"), sample.find::<GraspTrials>().expect("readable"));
        (run.sample, (run, trials.expect("trials")))
    };
    samples(&open(grasps)).into_iter().map(read).collect()
}

fn read_meshes() -> BTreeMap<ObjectId, TriMesh> {
    let shapes = Shapes::open(&Folder::at(WORKSPACE.path("grasps"))).expect("shapes");
    let objects = (0..shapes.objects()).map(|index| shapes.object(index).expect("an object"));
    objects.map(|object| (object.object, object.mesh)).collect()
}

#[test]
fn tried_grasps_are_samples_with_the_label_of_their_trials() {
    let (reader, grasps, runs) = (open("depth"), open("grasps"), read_trials("grasps"));
    let (mut tried, mut held, mut without) = (BTreeMap::new(), BTreeMap::new(), 0);
    for (run, trials) in runs.values() {
        for trial in &trials.trials {
            let Some(kind) = run.grasps[trial.grasp as usize].kind else {
                without += 1;
                continue;
            };
            *tried.entry(kind).or_default() += 1;
            if trial.label() == GraspLabel::Held {
                *held.entry(kind).or_default() += 1;
            }
        }
    }
    let chosen = GraspTypeCounts::choose(held, 0, 8).chosen;
    let types = read_types(reader.folder()).expect("types");
    assert_eq!((&types.counts, types.without, &types.chosen), (&tried, without, &chosen));
    assert_eq!(reader.manifest().counts.samples, types.covered());
    let mut seen = BTreeMap::new();
    for sample in samples(&reader) {
        let (patch, record) =
            (sample.read::<HeatmapPatch>().expect("a patch"), sample.find::<PatchTrial>().expect("readable"));
        let record = record.expect("a trial");
        let (run, trials) = &runs[&SampleId { item: ItemId(patch.run), ..patch.sample }];
        let trial = trials.trials.iter().find(|trial| trial.grasp == patch.rank).expect("the trial of the grasp");
        let label = trial.label();
        assert_eq!((record.outcome, record.trial), (label, trial.outcome.verdict));
        assert_eq!(record.verdict, run.grasps[patch.rank as usize].verdict);
        assert_eq!(record.trials, grasps.manifest().classes[&NumberClass::Physics]);
        assert_eq!(patch.label, "trial");
        let value = match label {
            GraspLabel::Held => -1.0,
            GraspLabel::Failed => 1.0,
            GraspLabel::Borderline | GraspLabel::Untested | GraspLabel::Unconfirmed => 0.0,
        };
        for point in 0..PATCH_POINTS {
            let mut expected = vec![0.0; 4 * chosen.len()];
            expected[4 * patch.type_index as usize + point] = value;
            assert_eq!(patch.labels(point), expected);
            let known: Vec<bool> = expected.iter().map(|value| *value != 0.0).collect();
            assert_eq!(record.tested[point * known.len()..(point + 1) * known.len()], known);
        }
        *seen.entry(label.name()).or_insert(0) += 1;
    }
    println!("labels: {seen:?}");
    assert!(seen["held"] > 5, "{seen:?}");
    // Inspection and report count the same.
    let inspected = Program::on("inspect", WORKSPACE.path("depth")).read_json();
    for label in GraspLabel::ALL.map(GraspLabel::name) {
        assert_eq!(inspected["outcomes"][label], seen.get(label).copied().unwrap_or(0), "{label}");
    }
    Program::on("report", WORKSPACE.path("depth")).option("--out", WORKSPACE.path("depth.html")).succeed();
    let page = WORKSPACE.read("depth.html");
    assert!(page.contains("The label combines all trials of a grasp") && page.contains(", hidden"), "the page has it");
    assert_intact(WORKSPACE.path("depth"), FULL_CHECK);
}

/// Hidden is what a ray from the camera to the point finds behind the mesh itself.
#[test]
fn points_behind_the_surface_are_marked() {
    let trees: BTreeMap<ObjectId, TriangleTree> =
        read_meshes().into_iter().map(|(id, mesh)| (id, TriangleTree::new(&mesh))).collect();
    let (mut other, mut hidden, mut points) = (0, 0, 0);
    for sample in samples(&open("depth")) {
        let patch = sample.read::<HeatmapPatch>().expect("a patch");
        let visibility = sample.find::<PatchVisibility>().expect("readable").expect("marks");
        let heatmap = sample.find::<PatchHeatmap>().expect("readable").expect("a heatmap");
        assert_eq!(visibility.heatmap_visible.len(), heatmap.points.len());
        let eye = Point3::from(*patch.camera_from_object.inverse().translation());
        for (index, PatchPoint { point, .. }) in patch.points.iter().enumerate() {
            let point = Point3::from(*point);
            let direction = Unit::new_normalize(point - eye);
            let hit = trees[&patch.sample.subject].first_hit(SimdLevel::detect(), &Ray::new(&eye, &direction), 9.0);
            let depth = |point: &Point3<f64>| patch.camera_from_object.point(point).z;
            let surface = hit.map(|hit| depth(&(eye + direction.into_inner() * hit.distance)));
            let is_hidden = surface.is_some_and(|surface| depth(&point) > surface + VISIBLE_TOLERANCE);
            other += u32::from(is_hidden == visibility.visible[index]);
            hidden += u32::from(is_hidden);
            points += 1;
        }
    }
    println!("{hidden} of {points} points hidden, {other} seen otherwise through the middles of pixels");
    assert!(hidden > 10 && hidden < points && 20 * other <= points, "{other} of {points}");
}

#[test]
fn squares_in_metres_are_cut_from_the_image() {
    for name in ["depth", "table"] {
        for sample in samples(&open(name)) {
            let (patch, image) = (
                sample.read::<HeatmapPatch>().expect("a patch"),
                sample.find_at::<Depth>(Channel::PATCH_IMAGE).expect("readable"),
            );
            let (metric, image) =
                (sample.find::<PatchMetric>().expect("readable").expect("squares"), image.expect("an image"));
            for (index, point) in patch.points.iter().enumerate() {
                let (window, [left, top]) = (metric.windows[index], metric.corners[index]);
                let depth = patch.camera_from_object.point(&point.point.into()).z;
                let pixel = depth / patch.camera.fx;
                assert!((f64::from(window) * pixel - 0.12).abs() <= 0.5 * pixel + 1e-12, "{window} px at {depth} m");
                for (corner, pixel) in [left, top].into_iter().zip(point.pixel) {
                    assert!((f64::from(corner) + f64::from(window) / 2.0 - pixel).abs() <= 0.5 + 1e-9);
                }
                for (k, depth) in (0..).zip(metric.depth_of(index)) {
                    let middle = |k: u32| ((f64::from(k) + 0.5) * f64::from(window) / 72.0).floor() as u32;
                    let seen = image.crop.at(left + middle(k % 72), top + middle(k / 72));
                    assert!(seen.to_bits() == depth.to_bits() || seen.is_nan() && depth.is_nan());
                }
            }
        }
    }
}

#[test]
fn objects_stand_on_the_table_that_their_grasp_allows() {
    let (reader, runs, meshes) = (open("table"), read_trials("lying"), read_meshes());
    let resting: BTreeMap<ObjectId, _> = (open("lying").assets().expect("assets").objects.iter())
        .map(|row| (row.object, row.resting().expect("poses").expect("poses").poses))
        .collect();
    let mut rasteriser = Rasteriser::new(SimdLevel::detect());
    let (mut outcomes, mut lowest, mut worst) = (BTreeSet::new(), 0.0_f64, 0.0_f64);
    for sample in samples(&reader) {
        let patch = sample.read::<HeatmapPatch>().expect("a patch");
        let table = sample.find::<PatchTable>().expect("readable").expect("a table");
        let image = sample.find_at::<Depth>(Channel::PATCH_IMAGE).expect("readable").expect("an image").crop;
        let (run, _) = &runs[&SampleId { item: ItemId(patch.run), ..patch.sample }];
        let pose = run.grasps[patch.rank as usize].likeliest_table().expect("a table");
        assert_eq!(table.resting_pose as usize, pose);
        let table_from_object = table.camera_from_table.inverse() * patch.camera_from_object;
        let resting = &resting[&patch.sample.subject][pose].world_from_object;
        let apart = table_from_object.to_rows().into_iter().zip(resting.to_rows()).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-12);
        // The camera looks along the approach; the table's normal is up in the image.
        let axis = patch.camera_from_object.rotation() * patch.object_from_approach.rotation() * Vector3::z();
        assert!((axis - Vector3::z()).norm() < 1e-12);
        let normal = table.camera_from_table.rotation() * Vector3::z();
        assert!(normal.x.abs() < 1e-12 && normal.y <= 0.0 || normal.xy().norm() < 0.09, "{normal}");
        let mesh = &meshes[&patch.sample.subject];
        let heights = mesh.vertices.iter().map(|vertex| table_from_object.point(&vertex.map(f64::from).into()).z);
        lowest = lowest.max(heights.fold(f64::INFINITY, f64::min).abs());
        // Next to the object each pixel sees the tabletop, or the background behind its edges.
        let object = rasteriser.render(&RenderMesh::new(mesh, false), &patch.camera, &patch.camera_from_object);
        for (column, row) in (0..patch.camera.height).flat_map(|row| (0..patch.camera.width).map(move |x| (x, row))) {
            let (seen, alone) = (image.at(column, row), object.at(column, row));
            if !alone.is_nan() && seen.to_bits() == alone.to_bits() {
                continue;
            }
            let [u, v] = [column, row].map(|pixel| f64::from(pixel) + 0.5);
            if seen.is_nan() {
                let sight = patch.camera.unproject(u, v, 1.0).coords;
                let under = table
                    .depth_along(&sight)
                    .map(|depth| table.camera_from_table.inverse().point(&Point3::from(sight * depth)));
                assert!(under.is_none_or(|point| point.x.abs().max(point.y.abs()) > 0.6 - 1e-9));
                continue;
            }
            let point = table.camera_from_table.inverse().point(&patch.camera.unproject(u, v, f64::from(seen)));
            assert!(point.x.abs().max(point.y.abs()) < 0.6 + 1e-5, "{point}");
            worst = worst.max(point.z.abs());
        }
        outcomes.insert(sample.find::<PatchTrial>().expect("readable").expect("a trial").outcome);
    }
    println!("objects {lowest:.1e} m from their tables, tabletops {worst:.1e} m off; labels {outcomes:?}");
    assert!(lowest < 1e-6 && worst < 1e-6);
    assert!(outcomes.contains(&GraspLabel::Held) && outcomes.contains(&GraspLabel::Failed), "{outcomes:?}");
    assert_intact(WORKSPACE.path("table"), FULL_CHECK);
}

#[test]
#[ignore = "slow: makes several datasets"]
fn grasps_that_no_table_allows_are_rejected() {
    run("upright", &["render.colour=false", "scene.table=true", "grasps.types=64", "patches.label=epsilon"], "2");
    let (reader, grasps) = (open("upright"), open("grasps"));
    let mut rejected = 0;
    for shard in 0..reader.manifest().shards.len() {
        for row in reader.ledger(shard).expect("a ledger").rows {
            if let Fate::Rejected { reason, .. } = &row.fate {
                assert!(
                    ["no_table", "camera_below_table"].contains(&reason.as_str()) || reason.ends_with("_out_of_frame")
                );
                rejected += u32::from(reason == "no_table");
            }
        }
    }
    assert!(rejected > 0 && reader.manifest().counts.kept > 0, "{:?}", reader.manifest().counts);
    // Types are those of kept grasps that a table allows.
    let runs = samples(&grasps).into_iter().map(|sample| sample.read::<GraspRun>().expect("a run"));
    let upright: usize = runs.map(|run| run.kept().filter(|grasp| grasp.likeliest_table().is_some()).count()).sum();
    assert!(reader.manifest().counts.kept <= upright as u64);
    assert_intact(WORKSPACE.path("upright"), FULL_CHECK);
}

#[test]
fn threads_and_colours_change_no_exact_number() {
    let first = Manifest::read(&Folder::at(WORKSPACE.path("table"))).expect("a dataset");
    assert_eq!(run("table-one", &ON_TABLE, "1"), first, "every file");
    let colour = run("table-colour", &LYING, "2");
    assert_eq!(colour.classes[&NumberClass::Exact], first.classes[&NumberClass::Exact]);
    assert_eq!(run("table-colour-one", &LYING, "1"), colour, "every file");
    let random = run("table-random", &[&LYING[..], &["render.randomise=true"]].concat(), "2");
    assert_eq!(random.classes[&NumberClass::Exact], first.classes[&NumberClass::Exact]);
    assert_ne!(random.classes[&NumberClass::Colour], colour.classes[&NumberClass::Colour]);
}

/// Two lights from far away on a plain table: a pixel of it has one of four colours, and somewhere the object's shadow lies.
#[test]
fn objects_throw_shadows_on_their_table() {
    run("shadows", &[LYING[0], LYING[1]], "2");
    let mut shaded = 0;
    for sample in samples(&open("shadows")) {
        let patch = sample.read::<HeatmapPatch>().expect("a patch");
        let image = sample.find_at::<Depth>(Channel::PATCH_IMAGE).expect("readable").expect("an image").crop;
        let colour = sample.find::<PatchImageColour>().expect("readable").expect("colours");
        let table = sample.find::<PatchTable>().expect("readable").expect("a table");
        let is_table = |column: u32, row: u32| {
            let (seen, [u, v]) = (image.at(column, row), [column, row].map(|pixel| f64::from(pixel) + 0.5));
            let point = table.camera_from_table.inverse().point(&patch.camera.unproject(u, v, f64::from(seen)));
            !seen.is_nan() && point.z.abs() < 1e-6
        };
        let mut colours = BTreeMap::new();
        for (column, row) in (1..479).step_by(3).flat_map(|row| (1..639).step_by(3).map(move |column| (column, row))) {
            if (row - 1..=row + 1).all(|row| (column - 1..=column + 1).all(|column| is_table(column, row))) {
                *colours.entry(colour.at(column, row)).or_insert(0) += 1;
            }
        }
        assert!((1..=4).contains(&colours.len()), "{colours:?}");
        shaded += usize::from(colours.len() > 1);
    }
    assert!(shaded > 5, "{shaded}");
    assert_intact(WORKSPACE.path("shadows"), FULL_CHECK);
}

/// A changed mask and changed labels of an outcome are found although the digests fit.
#[test]
fn masks_know_what_is_not_tested() {
    let reader = open("depth");
    let sample = samples(&reader).into_iter().next().expect("a sample");
    let (patch, record) =
        (sample.read::<HeatmapPatch>().expect("a patch"), sample.find::<PatchTrial>().expect("readable"));
    let record = record.expect("a trial");
    assert!(record.check_beside(&patch).is_ok() && sample.payload(Channel::PATCH_TRIAL).is_some());
    for outcome in GraspLabel::ALL.into_iter().filter(|outcome| *outcome != record.outcome) {
        let tested = PatchTrial::mask(outcome, patch.type_index, patch.types.len());
        let is_alike = (record.tested == tested) && patch.value == graspmill::format::trial_value(outcome);
        let lie = PatchTrial { outcome, tested, ..record.clone() };
        assert_eq!(lie.check_beside(&patch).is_ok(), is_alike, "{outcome:?}");
    }
}
