//! Patches of grasps from job file to report: their positions and content, and the same root for all threads and kills.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    sync::{Arc, LazyLock},
    time::Duration,
};

use graspmill::{
    files::Folder,
    format::{
        Channel, Depth, GraspRun, HeatmapPatch, HeatmapPoint, PATCH_POINTS, PatchColour, PatchHeatmap,
        PatchImageColour, PatchPoint,
        dataset::{DatasetReader, Manifest, Selection},
        extras::{Shapes, read_types},
    },
    geom::{CameraCv, Object, Pose, RenderMesh, SimdLevel, TriMesh},
    ids::{ItemId, ObjectId, SampleId},
    render::Rasteriser,
    sim::{Appearance, Inertia, SimModel, SimWorker},
    words::NumberClass,
};
use nalgebra::{Point3, Rotation3, Vector3};

use crate::support::{
    files::{FULL_CHECK, assert_intact},
    jobs::barrett_line,
    meshes::round,
    program::Program,
    robots::{BARRETT, open_hand},
    workspace::Workspace,
};

/// A folder with job files and datasets of a few grasps and of their patches, made once; tests write into it.
static WORKSPACE: LazyLock<Workspace> = LazyLock::new(|| {
    let workspace = Workspace::kept("patches");
    let hand = barrett_line();
    let grasps = format!(
        "product = \"grasps\"\nseed = 5\n{hand}\
         objects = [{{ built_in = [\"can-01\", \"box-01\", \"half-cube-sphere\"] }}]\n[grasps]\nseeds = 3\n\
         [annealing]\nsteps = 1500\n[keep]\nspace = \"force\"\nmin_epsilon = 0.0\n\
         [split]\nvalidation_objects = 0\ntest_objects = 1\nholdout_items = 0.4\n"
    );
    let patches = format!(
        "product = \"patches\"\nseed = 5\n{hand}[grasps]\ndataset = \"grasps\"\n[patches]\nlabel = \"epsilon\"\n\
         [shards]\nsamples = 5\n"
    );
    workspace.write("patches.toml", patches);
    workspace.make_dataset("grasps", &grasps, &[]);
    workspace.run_job("patches", "depth").args(NO_COLOUR).succeed();
    workspace
});

const NO_COLOUR: [&str; 2] = ["--set", "render.colour=false"];

fn run(job: &str, out: &str, arguments: &[&str]) -> Manifest {
    WORKSPACE.run_job(job, out).args(arguments).succeed();
    read_manifest(out)
}

/// Fails to make a dataset; the error.
fn fail(settings: &[&str]) -> String {
    WORKSPACE.run_job("patches", "never").set(settings).expect_code(2).stderr
}

fn read_manifest(name: &str) -> Manifest {
    Manifest::read(&Folder::at(WORKSPACE.path(name))).expect("a finished dataset")
}

fn open(name: &str) -> DatasetReader {
    DatasetReader::open(&Folder::at(WORKSPACE.path(name))).expect("a dataset")
}

/// Writes the report of a dataset to a file; its page.
fn write_report(dataset: &str, name: &str) -> String {
    Program::on("report", WORKSPACE.path(dataset)).option("--out", WORKSPACE.path(name)).succeed();
    WORKSPACE.read(name)
}

fn read_patches(reader: &DatasetReader) -> Vec<HeatmapPatch> {
    reader
        .iter(Selection::default())
        .map(|sample| sample.and_then(|sample| sample.read::<HeatmapPatch>()).expect("a patch"))
        .collect()
}

/// The runs of the dataset of grasps by object and seed.
fn read_runs(reader: &DatasetReader) -> BTreeMap<SampleId, GraspRun> {
    let runs = reader
        .iter(Selection::default())
        .map(|sample| sample.and_then(|sample| sample.read::<GraspRun>()).expect("a run"));
    runs.map(|run| (run.sample, run)).collect()
}

fn read_meshes(name: &str) -> BTreeMap<ObjectId, TriMesh> {
    let shapes = Shapes::open(&Folder::at(WORKSPACE.path(name))).expect("shapes");
    let objects = (0..shapes.objects()).map(|index| shapes.object(index).expect("an object"));
    objects.map(|object| (object.object, object.mesh)).collect()
}

#[test]
fn the_most_common_types_are_looked_at_and_labelled() {
    let (reader, grasps) = (open("depth"), open("grasps"));
    let runs = read_runs(&grasps);
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    runs.values().flat_map(GraspRun::kept).filter_map(|grasp| grasp.kind).for_each(|kind| {
        *counts.entry(kind).or_default() += 1;
    });
    let mut common: Vec<_> = counts.iter().map(|(kind, count)| (std::cmp::Reverse(*count), *kind)).collect();
    common.sort_unstable();
    let expected: Vec<u32> = common.iter().take(8).map(|(_, kind)| *kind).collect();
    let types = read_types(reader.folder()).expect("types");
    assert_eq!((&types.chosen, &types.counts), (&expected, &counts));
    assert_eq!(reader.manifest().counts.samples, types.covered());
    assert!(types.covered() > 8, "{types:?}");
    let model = open_hand(BARRETT);
    let hand = model.hand();
    let mut last = None;
    for patch in read_patches(&reader) {
        let run = &runs[&SampleId { item: ItemId(patch.run), ..patch.sample }];
        let grasp = &run.grasps[patch.rank as usize];
        assert_eq!((Some(patch.kind()), patch.energy, patch.epsilon), (grasp.kind, grasp.energy, grasp.epsilon_force));
        assert_eq!(
            (patch.types.as_slice(), patch.grasps),
            (expected.as_slice(), grasps.manifest().classes[&NumberClass::Exact])
        );
        // Items number an object's grasps by run and rank.
        let here = (patch.sample.subject, patch.sample.item.0, patch.run, patch.rank);
        if let Some((subject, view, run, rank)) = last.replace(here).filter(|last| last.0 == here.0) {
            assert!(subject == here.0 && here.1 == view + 1 && (here.2, here.3) > (run, rank));
        } else {
            assert_eq!(here.1, 0);
        }
        for point in 0..PATCH_POINTS {
            let mut labels = vec![0.0; 32.min(4 * expected.len())];
            labels[4 * patch.type_index as usize + point] = -grasp.epsilon_force as f32;
            assert_eq!(patch.labels(point), labels);
        }
        // Fingertips by the hand itself.
        let frames = hand.link_frames(&grasp.joints);
        for point in &patch.points[1..] {
            let contact = hand.contacts().iter().position(|contact| contact.name == point.name).expect("a contact");
            let tip = grasp.object_from_base.point(&hand.contact_in_base(contact, &frames).0);
            assert!((tip - Point3::from(point.point)).norm() < 1e-12);
        }
        assert_eq!(Vector3::from(patch.points[0].point), *grasp.object_from_approach.translation());
        // Runs that the grasps hold out are held out here, and objects stay on their sides.
        let of = |reader: &DatasetReader, sample| reader.split(reader.find(sample).expect("known"));
        assert_eq!(of(&reader, &patch.sample), of(&grasps, &run.sample));
    }
}

#[test]
fn depth_is_that_of_the_whole_image() {
    let meshes = read_meshes("grasps");
    let mut rasteriser = Rasteriser::new(SimdLevel::detect());
    let mut worst = 0.0_f64;
    let (mut edges, mut pixels) = (0, 0);
    for patch in read_patches(&open("depth")) {
        let mesh = &meshes[&patch.sample.subject];
        let whole = rasteriser.render(&RenderMesh::new(mesh, false), &patch.camera, &patch.camera_from_object).clone();
        let mut worker = SimWorker::new(&Arc::new(SimModel::new(mesh, Inertia::Shell).expect("a model")));
        let by_mujoco = worker.ray_depth(&patch.camera, &patch.camera_from_object).expect("finite");
        for (index, point) in patch.points.iter().enumerate() {
            let [left, top] = point.corner;
            for (k, depth) in (0..).zip(patch.depth_of(index)) {
                let (column, row) = (left + k % patch.side, top + k / patch.side);
                assert_eq!(depth.to_bits(), whole.at(column, row).to_bits());
                let other = by_mujoco.at(column, row);
                edges += u32::from(depth.is_nan() != other.is_nan());
                pixels += u32::from(!depth.is_nan());
                if (depth - other).abs() < 1e-3 {
                    worst = worst.max(f64::from((depth - other).abs()));
                } else {
                    edges += u32::from(!depth.is_nan() && !other.is_nan());
                }
            }
        }
        assert!(whole.returns() > 100, "the object is seen");
    }
    println!("depth: {pixels} pixels, worst {worst:.1e} m from MuJoCo's rays, {edges} edge pixels differ");
    assert!(worst < 2e-5 && f64::from(edges) < 1e-3 * f64::from(pixels));
}

/// A ball, as MuJoCo's own camera sees it, is where a point was projected to.
#[test]
fn points_are_where_mujoco_sees_them() {
    let ball = round(12, |_, _| 0.006);
    let model = Arc::new(SimModel::new(&ball, Inertia::Shell).expect("a model"));
    let mut worker = SimWorker::new(&model);
    let mut worst = 0.0_f64;
    for patch in read_patches(&open("depth")) {
        for point in &patch.points {
            let at = Pose::<Object, Object>::new(Rotation3::identity(), Vector3::from(point.point));
            let pose: Pose<CameraCv, Object> = patch.camera_from_object * at;
            for drawn in [true, false] {
                let seen = match drawn {
                    true => worker.gl_depth(&patch.camera, &pose),
                    false => worker.ray_depth(&patch.camera, &pose),
                };
                let seen = seen.expect("EGL (make deps-gl)");
                let (mut sum, mut count) = ([0.0; 2], 0.0);
                for row in seen.top..seen.top + seen.height {
                    for column in seen.left..seen.left + seen.width {
                        if !seen.at(column, row).is_nan() {
                            sum = [sum[0] + f64::from(column) + 0.5, sum[1] + f64::from(row) + 0.5];
                            count += 1.0;
                        }
                    }
                }
                let apart = (sum[0] / count - point.pixel[0]).hypot(sum[1] / count - point.pixel[1]);
                worst = worst.max(apart);
            }
        }
    }
    println!("projections: worst {worst:.2} px from the middle of a ball");
    assert!(worst < 0.5);
}

/// Images and heatmaps have separate topics: earlier topics stay the same, bit for bit.
#[test]
fn whole_images_hold_the_patches_and_the_grasps_from_about_one_side() {
    let more = [&NO_COLOUR[..], &["--set", "images.full=true", "--set", "images.heatmaps=true"]].concat();
    let first = run("patches", "images", &[&more[..], &["--threads", "1"]].concat());
    assert_eq!(run("patches", "images-two", &[&more[..], &["--threads", "2"]].concat()), first, "every file");
    assert_eq!(
        first.topics,
        ["/patches/patch", "/patches/image", "/patches/heatmap", "/patches/visibility", "/patches/metric"]
    );
    assert_intact(WORKSPACE.path("images"), FULL_CHECK);
    let (reader, plain) = (open("images"), open("depth"));
    let all = read_patches(&reader);
    let mut bytes = [0; 3];
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let patch = sample.read::<HeatmapPatch>().expect("a patch");
        let alone = plain.sample_of(&sample.id).expect("readable").expect("the same grasp");
        assert_eq!(alone.payload(Channel::PATCH), sample.payload(Channel::PATCH));
        let channels = [Channel::PATCH, Channel::PATCH_IMAGE, Channel::PATCH_HEATMAP];
        for (sum, channel) in bytes.iter_mut().zip(channels) {
            *sum += sample.payload(channel).map_or(0, <[u8]>::len);
        }
        assert_cuts(&patch, &sample.find_at::<Depth>(Channel::PATCH_IMAGE).expect("readable").expect("an image"));
        assert_near_points(&patch, &sample.find::<PatchHeatmap>().expect("readable").expect("a heatmap"), &all);
    }
    println!("{} grasps, bytes of patches, images and heatmaps before compression: {bytes:?}", all.len());
}

fn assert_cuts(patch: &HeatmapPatch, image: &Depth) {
    let whole = image.crop.whole(patch.camera.width, patch.camera.height);
    assert_eq!((whole.len(), whole.iter().filter(|depth| !depth.is_nan()).count()), (640 * 480, image.crop.returns()));
    for (index, PatchPoint { corner: [left, top], .. }) in patch.points.iter().enumerate() {
        for (k, depth) in (0..).zip(patch.depth_of(index)) {
            let at = whole[((top + k / patch.side) * 640 + left + k % patch.side) as usize];
            assert!(at.to_bits() == depth.to_bits() || at.is_nan() && depth.is_nan());
        }
    }
}

/// Compares the points with those of all patches of the object, each of which has its own points in space.
fn assert_near_points(patch: &HeatmapPatch, heatmap: &PatchHeatmap, all: &[HeatmapPatch]) {
    let axis = |patch: &HeatmapPatch| patch.object_from_approach.rotation().matrix().column(2).into_owned();
    let mut expected = Vec::new();
    for other in all.iter().filter(|other| other.sample.subject == patch.sample.subject) {
        if axis(other).dot(&axis(patch)).clamp(-1.0, 1.0).acos() > heatmap.angle {
            continue;
        }
        for (index, point) in (0..).zip(&other.points) {
            let (u, v) = patch.camera.project(&patch.camera_from_object.point(&point.point.into()));
            let (run, rank, type_index, value) = (other.run, other.rank, other.type_index, other.value);
            expected.push(HeatmapPoint { run, rank, type_index, point: index, pixel: [u, v], value });
        }
    }
    expected.sort_by_key(|point| (point.run, point.rank, point.point));
    assert_eq!(heatmap.points, expected);
    let own: Vec<&HeatmapPoint> =
        heatmap.points.iter().filter(|point| (point.run, point.rank) == (patch.run, patch.rank)).collect();
    for (point, own) in patch.points.iter().zip(&own) {
        assert_eq!((point.pixel, patch.value, patch.type_index), (own.pixel, own.value, own.type_index));
    }
    assert_eq!(own.len(), PATCH_POINTS);
    let maps = heatmap.maps();
    let types = patch.types.len();
    assert_eq!(maps.len(), PATCH_POINTS * types * 640 * 480);
    for point in &heatmap.points {
        let map = PATCH_POINTS * point.type_index as usize + point.point as usize;
        let [column, row] = point.pixel.map(|pixel| pixel as usize);
        assert!(maps[(map * 480 + row) * 640 + column] <= point.value);
    }
}

/// The thesis's code draws with one focal length and projects with another: the same points lie 6 % further from the middle.
#[test]
fn the_thesis_projects_with_a_focal_length_of_its_own() {
    let quirk = [&NO_COLOUR[..], &["--set", "camera.point_focal_length=589.366454"]].concat();
    run("patches", "quirk", &quirk);
    let (quirk, plain) = (open("quirk"), open("depth"));
    for patch in read_patches(&quirk) {
        let straight = plain.sample_of(&patch.sample).expect("readable").expect("the same grasp");
        let straight = straight.read::<HeatmapPatch>().expect("a patch");
        assert_eq!((patch.camera, straight.point_focal_length), (straight.camera, None));
        assert_eq!(patch.point_focal_length, Some(589.366_454));
        for (point, straight) in patch.points.iter().zip(&straight.points) {
            for (axis, middle) in [320.0, 240.0].into_iter().enumerate() {
                let said = middle + (straight.pixel[axis] - middle) * 589.366_454 / patch.camera.fx;
                assert!((point.pixel[axis] - said).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn threads_levels_kills_and_shards_change_no_byte() {
    let first = run("patches", "first", &[&NO_COLOUR[..], &["--threads", "1"]].concat());
    assert_eq!(first.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact]);
    assert_eq!(run("patches", "two", &[&NO_COLOUR[..], &["--threads", "2"]].concat()), first, "every file");
    assert!(first.shards.len() > 1);
    let other = run("patches", "shards", &[&NO_COLOUR[..], &["--set", "shards.samples=1000"]].concat());
    assert_eq!((other.root, other.shards.len()), (first.root, 1));
    WORKSPACE.run_job("patches", "scalar").args(NO_COLOUR).env("GRASPMILL_SIMD", "scalar").succeed();
    assert_eq!(read_manifest("scalar"), first);
    for kill in 0..6 {
        WORKSPACE.run_job("patches", "killed").args(NO_COLOUR).kill_after(Duration::from_millis(5 + 15 * kill));
    }
    assert_eq!(run("patches", "killed", &NO_COLOUR), first);
    assert_intact(WORKSPACE.path("first"), FULL_CHECK);
    let verify = Program::new("verify").args(["--regenerate", "5", "--seed", "2"]);
    let found = verify.arg(WORKSPACE.path("first")).read_json();
    assert_eq!((&found["regenerated"]["samples"], &found["intact"]), (&5.into(), &true.into()));
    assert_eq!(found["regenerated"]["differences"].as_array().map(Vec::len), Some(0));
}

#[test]
fn the_second_stage_follows_from_the_first() {
    let first = read_manifest("depth");
    // Both stages again, in other folders.
    let grasps = run("grasps", "grasps-again", &["--threads", "1"]);
    assert_eq!(grasps.root, read_manifest("grasps").root);
    let again = run("patches", "again", &["--set", "grasps.dataset=grasps-again", "--set", "render.colour=false"]);
    assert_eq!((again.root, &again.shards), (first.root, &first.shards));
    // Other grasps are other patches, and a pinned root finds out.
    let other = run("grasps", "grasps-other", &["--set", "seed=6"]);
    let root = grasps.classes[&NumberClass::Exact].hex();
    let resolved = WORKSPACE.read("depth/job.toml");
    assert!(resolved.contains(&format!("root = \"{root}\"")) && resolved.contains("dataset = \"../grasps\""));
    let pinned = format!("grasps.root=\"{root}\"");
    let said = fail(&[&pinned, "grasps.dataset=grasps-other"]);
    assert!(said.contains("grasps.root") && said.contains(&other.classes[&NumberClass::Exact].short()), "{said}");
}

#[test]
fn only_finished_datasets_of_grasps_are_looked_at() {
    WORKSPACE.write("unfinished/run.json", WORKSPACE.read("grasps/run.json"));
    let said = fail(&["grasps.dataset=unfinished"]);
    assert!(said.contains("grasps.dataset") && said.contains("not finished"), "{said}");
    let said = fail(&["grasps.dataset=depth"]);
    assert!(said.contains("a dataset of patches, not of grasps"), "{said}");
    let said = fail(&["grasps.dataset=nowhere"]);
    assert!(said.contains("nowhere") && said.contains("make one first"), "{said}");
    let tips = "patches.tips=[\"distal_1_outer\", \"thumb\", \"distal_3_outer\"]";
    let said = WORKSPACE.run_job("patches", "never-tips").set([tips, "render.colour=false"]).expect_code(2).stderr;
    assert!(said.contains("no contact `thumb`") && said.contains("distal_2_outer"), "{said}");
    assert!(!WORKSPACE.path("never").exists(), "nothing was begun");
}

#[test]
fn patches_out_of_the_image_are_counted() {
    let narrow = ["--set", "render.colour=false", "--set", "camera.width=100", "--set", "camera.horizontal_fov=0.18"];
    let manifest = run("patches", "narrow", &narrow);
    assert!(!manifest.counts.rejected.is_empty(), "{:?}", manifest.counts);
    assert!(manifest.counts.rejected.keys().all(|reason| reason.ends_with("_out_of_frame")));
    let inspected = Program::on("inspect", WORKSPACE.path("narrow")).succeed().stdout;
    assert!(inspected.contains("_out_of_frame"), "{inspected}");
}

/// Colours have their own root and do not change the exact numbers.
#[test]
fn colours_lie_over_depth() {
    let depth = read_manifest("depth");
    let first = run("patches", "colour", &["--threads", "1"]);
    assert_eq!(run("patches", "colour-two", &["--threads", "2"]), first, "every file");
    assert_eq!(first.classes[&NumberClass::Exact], depth.classes[&NumberClass::Exact]);
    assert_eq!(first.class_topics[&NumberClass::Colour], ["/patches/colour", "/patches/metric_colour"]);
    assert!(first.platform.contains_key("gl_renderer") && depth.platform.is_empty());
    assert_intact(WORKSPACE.path("colour"), FULL_CHECK);
    let random = run("patches", "random", &["--set", "render.randomise=true"]);
    assert_eq!(random.classes[&NumberClass::Exact], depth.classes[&NumberClass::Exact]);
    assert_eq!(run("patches", "random-again", &["--set", "render.randomise=true"]), random);
    let (mut edges, mut pixels) = (0, 0);
    let background = Appearance::default().background;
    let (plain, random) = (open("colour"), open("random"));
    let mut backgrounds = BTreeSet::new();
    for sample in plain.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let patch = sample.read::<HeatmapPatch>().expect("a patch");
        let colour = sample.find::<PatchColour>().expect("readable").expect("colours");
        assert_eq!((colour.sample, colour.rgb.len()), (patch.sample, patch.depth.len()));
        for (rgb, depth) in colour.rgb.iter().zip(&patch.depth) {
            // A pixel that is seen at all of its four samples is not as the background is.
            edges += u32::from((*rgb == background) != depth.is_nan());
            pixels += u32::from(!depth.is_nan());
        }
        // A pixel without depth shows the background, drawn again for each grasp.
        let other = random.sample_of(&sample.id).expect("readable").expect("the same grasp");
        let other = other.find::<PatchColour>().expect("readable").expect("colours");
        backgrounds.extend(other.rgb.iter().zip(&patch.depth).find(|(_, depth)| depth.is_nan()).map(|(rgb, _)| *rgb));
    }
    println!("colours: {edges} edge pixels beside {pixels} with depth");
    assert!(f64::from(edges) < 0.1 * f64::from(pixels) && edges > 0, "{edges} of {pixels}");
    assert!(backgrounds.len() as u64 > first.counts.kept / 2);
    assert!(write_report("colour", "colour.html").contains("colours around palm"));
}

/// The image in colour is drawn apart from the patches; both show the same.
#[test]
fn whole_images_in_colour_hold_the_patches() {
    run("patches", "colour-alone", &[]);
    let full = run("patches", "colour-images", &["--set", "images.full=true", "--threads", "1"]);
    assert_eq!(run("patches", "colour-images-two", &["--set", "images.full=true", "--threads", "2"]), full);
    assert_eq!(
        full.class_topics[&NumberClass::Colour],
        ["/patches/colour", "/patches/image_colour", "/patches/metric_colour"]
    );
    assert_intact(WORKSPACE.path("colour-images"), FULL_CHECK);
    let (reader, plain) = (open("colour-images"), open("colour-alone"));
    let (mut apart, mut pixels, mut bytes) = (0, 0, 0);
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let (patch, colour) =
            (sample.read::<HeatmapPatch>().expect("a patch"), sample.find::<PatchColour>().expect("readable"));
        let alone = plain.sample_of(&sample.id).expect("readable").expect("the same grasp");
        assert_eq!(alone.payload(Channel::PATCH_COLOUR), sample.payload(Channel::PATCH_COLOUR));
        let image = sample.find::<PatchImageColour>().expect("readable").expect("an image");
        let depth = sample.find_at::<Depth>(Channel::PATCH_IMAGE).expect("readable").expect("an image");
        let whole = image.whole(640, 480);
        bytes += sample.payload(Channel::PATCH_IMAGE_COLOUR).map_or(0, <[u8]>::len);
        let colour = colour.expect("colours");
        for (index, PatchPoint { corner: [left, top], .. }) in patch.points.iter().enumerate() {
            for (k, rgb) in (0..).zip(colour.rgb_of(index)) {
                let (column, row) = (left + k % patch.side, top + k / patch.side);
                let same = whole[(row * 640 + column) as usize] == *rgb;
                apart += u32::from(!same);
                pixels += u32::from(!depth.crop.at(column, row).is_nan());
            }
        }
        // All that has depth is inside the box.
        assert!(image.left <= depth.crop.left && image.top <= depth.crop.top);
        assert!(image.left + image.width >= depth.crop.left + depth.crop.width);
        assert!(image.top + image.height >= depth.crop.top + depth.crop.height);
    }
    println!(
        "colour images: {apart} of {pixels} pixels of patches differ; {bytes} bytes of {} grasps",
        full.counts.kept
    );
    assert!(f64::from(apart) < 1e-3 * f64::from(pixels), "{apart} of {pixels}");
}

#[test]
fn viewers_have_a_preview() {
    for (name, more) in [("seen", &NO_COLOUR[..]), ("seen-in-colour", &["--set", "images.full=true"])] {
        run("patches", name, more);
        let first = fs::read(WORKSPACE.path(name).join("preview.mcap")).expect("a preview");
        assert!(first.len() > 10_000);
        let again = format!("{name}-again");
        run("patches", &again, more);
        assert_eq!(fs::read(WORKSPACE.path(&again).join("preview.mcap")).expect("a preview"), first);
        let schemas: &[&[u8]] = &[b"foxglove.RawImage", b"foxglove.CameraCalibration", b"foxglove.SceneUpdate"];
        for schema in schemas {
            assert!(first.windows(schema.len()).any(|window| window == *schema));
        }
    }
}

/// Without EGL, colours are refused with the package to install, and all else is made unchanged.
#[test]
fn only_colours_need_egl() {
    let without_egl = |out: &str| WORKSPACE.run_job("patches", out).without_egl();
    let said = without_egl("no-egl").fail().stderr;
    assert!(said.contains("colours cannot be drawn") && said.contains("make deps-gl"), "{said}");
    assert!(said.contains("render.colour = false"), "{said}");
    without_egl("no-egl-depth").args(NO_COLOUR).succeed();
    assert_eq!(read_manifest("no-egl-depth"), read_manifest("depth"));
}

#[test]
fn a_report_shows_types_and_sheets() {
    let [one, two] = ["one.html", "two.html"].map(|name| write_report("depth", name));
    assert_eq!(one, two, "two reports of one dataset have the same bytes");
    assert!(one.contains("id=\"types\"") && one.contains("depth around F2") && one.contains("data:image/png"));
    let inspected = Program::on("inspect", WORKSPACE.path("depth")).read_json();
    assert_eq!(inspected["product"], "patches");
    assert!(inspected["types"].as_array().is_some_and(|types| !types.is_empty()));
}
