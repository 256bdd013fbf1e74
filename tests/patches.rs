//! Patches of grasps from job file to report: where they lie, what they hold, and the same root whatever threads and kills.
#![cfg(feature = "sim")]

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    sync::{Arc, LazyLock},
    thread,
    time::Duration,
};

use graspmill::{
    dataset::{DatasetReader, Manifest, NumberClass, Selection, Shapes, VerifyLevel, VerifyOptions, verify},
    geom::{CameraCv, Object, Pose, RenderMesh, SimdLevel, TriMesh},
    record::{Channel, Depth, GraspRun, HeatmapPatch, HeatmapPoint, PATCH_POINTS, PatchHeatmap, PatchPoint},
    render::Rasteriser,
    sim::{HandModel, Inertia, Look, SimModel, SimWorker},
};
use nalgebra::{Point3, Rotation3, Vector3};

fn graspmill() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

fn succeeded(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn failed(output: &Output) -> String {
    assert!(!output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/barrett_bh8_280.xml")
}

/// A folder with job files and one dataset of a few grasps, made once; tests write beside it.
struct Place {
    folder: tempfile::TempDir,
}

static PLACE: LazyLock<Place> = LazyLock::new(|| {
    let place = Place { folder: tempfile::tempdir().expect("a scratch folder") };
    let grasps = format!(
        concat!(
            "product = \"grasps\"\nseed = 5\n[hand]\nscene = \"{}\"\n[[objects]]\n",
            "built_in = [\"can-01\", \"box-01\", \"half-cube-sphere\"]\n[grasps]\nseeds = 3\n",
            "[annealing]\nsteps = 1500\n[keep]\nspace = \"force\"\nmin_epsilon = 0.0\n",
            "[split]\nvalidation_models = 0\ntest_models = 1\nholdout_views = 0.4\n"
        ),
        scene().display()
    );
    fs::write(place.at("grasps.toml"), grasps).expect("a job file");
    let patches = format!(
        "product = \"patches\"\nseed = 5\n[hand]\nscene = \"{}\"\n[grasps]\ndataset = \"grasps\"\n[shards]\nsamples = 5\n",
        scene().display()
    );
    fs::write(place.at("patches.toml"), patches).expect("a job file");
    place.run("grasps", "grasps", &[]);
    place.run("patches", "depth", &NO_COLOUR);
    place
});

const NO_COLOUR: [&str; 2] = ["--set", "render.colour=false"];

impl Place {
    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, job: &str, out: &str, more: &[&str]) -> Command {
        let mut command = graspmill();
        command.arg("run").arg(self.at(&format!("{job}.toml"))).arg("--out").arg(self.at(out));
        command.args(["--progress", "none"]).args(more);
        command
    }

    fn run(&self, job: &str, out: &str, more: &[&str]) -> Manifest {
        succeeded(&self.command(job, out, more).output().expect("graspmill starts"));
        Manifest::read(&self.at(out)).expect("a finished dataset")
    }

    fn fail(&self, job: &str, out: &str, more: &[&str]) -> String {
        failed(&self.command(job, out, more).output().expect("graspmill starts"))
    }

    fn open(&self, name: &str) -> DatasetReader {
        DatasetReader::open(&self.at(name)).expect("a dataset")
    }
}

fn patches(reader: &DatasetReader) -> Vec<HeatmapPatch> {
    reader
        .iter(Selection::default())
        .map(|sample| sample.and_then(|sample| sample.heatmap_patch()).expect("a patch"))
        .collect()
}

/// The runs of the dataset of grasps by object and seed.
fn runs(reader: &DatasetReader) -> BTreeMap<graspmill::ids::SampleId, GraspRun> {
    let runs =
        reader.iter(Selection::default()).map(|sample| sample.and_then(|sample| sample.grasp_run()).expect("a run"));
    runs.map(|run| (run.sample, run)).collect()
}

fn meshes(name: &str) -> BTreeMap<graspmill::ids::ObjectId, TriMesh> {
    let shapes = Shapes::open(&PLACE.at(name)).expect("shapes");
    let objects = (0..shapes.objects()).map(|place| shapes.object(place).expect("an object"));
    objects.map(|object| (object.object, object.mesh)).collect()
}

#[test]
fn the_most_common_types_are_looked_at_and_labelled() {
    let (reader, grasps) = (PLACE.open("depth"), PLACE.open("grasps"));
    let runs = runs(&grasps);
    let mut counts: BTreeMap<u32, u64> = BTreeMap::new();
    runs.values().flat_map(GraspRun::kept).filter_map(|grasp| grasp.kind).for_each(|kind| {
        *counts.entry(kind).or_default() += 1;
    });
    let mut common: Vec<_> = counts.iter().map(|(kind, count)| (std::cmp::Reverse(*count), *kind)).collect();
    common.sort_unstable();
    let expected: Vec<u32> = common.iter().take(8).map(|(_, kind)| *kind).collect();
    let types = reader.manifest().counts.types.clone().expect("types");
    assert_eq!((&types.chosen, &types.counts), (&expected, &counts));
    assert_eq!(reader.manifest().counts.samples, types.covered());
    assert!(types.covered() > 8, "{types:?}");
    let model = HandModel::open(&scene()).expect("the Barrett hand");
    let hand = model.hand();
    let mut last = None;
    for patch in patches(&reader) {
        let run = &runs[&graspmill::ids::SampleId { view: graspmill::ids::ViewId(patch.run), ..patch.sample }];
        let grasp = &run.grasps[patch.rank as usize];
        assert_eq!((Some(patch.kind()), patch.energy, patch.epsilon), (grasp.kind, grasp.energy, grasp.epsilon_force));
        assert_eq!(
            (patch.types.as_slice(), patch.grasps),
            (expected.as_slice(), grasps.manifest().classes[&NumberClass::Exact])
        );
        // Views number an object's grasps by run and rank.
        let here = (patch.sample.subject, patch.sample.view.0, patch.run, patch.rank);
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
    let meshes = meshes("grasps");
    let mut rasteriser = Rasteriser::new(SimdLevel::detect());
    let mut worst = 0.0_f64;
    let (mut edges, mut pixels) = (0, 0);
    for patch in patches(&PLACE.open("depth")) {
        let mesh = &meshes[&patch.sample.subject];
        let whole = rasteriser.render(&RenderMesh::new(mesh, false), &patch.camera, &patch.camera_from_object).clone();
        let mut worker = SimWorker::new(&Arc::new(SimModel::new(mesh, Inertia::Shell).expect("a model")));
        let by_mujoco = worker.ray_depth(&patch.camera, &patch.camera_from_object).expect("finite");
        for (place, point) in patch.points.iter().enumerate() {
            let [left, top] = point.corner;
            for (k, depth) in (0..).zip(patch.depth_of(place)) {
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
    let ball = ball(0.006);
    let model = Arc::new(SimModel::new(&ball, Inertia::Shell).expect("a model"));
    let mut worker = SimWorker::new(&model);
    let mut worst = 0.0_f64;
    for patch in patches(&PLACE.open("depth")) {
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

/// Images and heatmaps lie on topics of their own: what was there before stays, bit for bit.
#[test]
fn whole_images_hold_the_patches_and_the_grasps_from_about_one_side() {
    let more = [&NO_COLOUR[..], &["--set", "images.full=true", "--set", "images.heatmaps=true"]].concat();
    let first = PLACE.run("patches", "images", &[&more[..], &["--threads", "1"]].concat());
    assert_eq!(PLACE.run("patches", "images-two", &[&more[..], &["--threads", "2"]].concat()), first, "every file");
    assert_eq!(first.topics, ["/patches/patch", "/patches/image", "/patches/heatmap"]);
    let options = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: false, threads: 2 };
    assert!(verify(&PLACE.at("images"), options, |_| ()).expect("readable").is_intact());
    let (reader, plain) = (PLACE.open("images"), PLACE.open("depth"));
    let all = patches(&reader);
    let mut bytes = [0; 3];
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let patch = sample.heatmap_patch().expect("a patch");
        let alone = plain.sample_of(&sample.id).expect("readable").expect("the same grasp");
        assert_eq!(alone.payload(Channel::Patch), sample.payload(Channel::Patch));
        let channels = [Channel::Patch, Channel::PatchImage, Channel::PatchHeatmap];
        for (sum, channel) in bytes.iter_mut().zip(channels) {
            *sum += sample.payload(channel).map_or(0, <[u8]>::len);
        }
        patches_are_cuts(&patch, &sample.patch_image().expect("readable").expect("an image"));
        heatmaps_hold_the_near(&patch, &sample.patch_heatmap().expect("readable").expect("a heatmap"), &all);
    }
    println!("{} grasps, bytes of patches, images and heatmaps before compression: {bytes:?}", all.len());
}

fn patches_are_cuts(patch: &HeatmapPatch, image: &Depth) {
    let whole = image.crop.whole(patch.camera.width, patch.camera.height);
    assert_eq!((whole.len(), whole.iter().filter(|depth| !depth.is_nan()).count()), (640 * 480, image.crop.returns()));
    for (place, PatchPoint { corner: [left, top], .. }) in patch.points.iter().enumerate() {
        for (k, depth) in (0..).zip(patch.depth_of(place)) {
            let at = whole[((top + k / patch.side) * 640 + left + k % patch.side) as usize];
            assert!(at.to_bits() == depth.to_bits() || at.is_nan() && depth.is_nan());
        }
    }
}

/// Holds the points against all patches of the object, each of which says where its own points are in space.
fn heatmaps_hold_the_near(patch: &HeatmapPatch, heatmap: &PatchHeatmap, all: &[HeatmapPatch]) {
    let axis = |patch: &HeatmapPatch| patch.object_from_approach.rotation().matrix().column(2).into_owned();
    let mut expected = Vec::new();
    for other in all.iter().filter(|other| other.sample.subject == patch.sample.subject) {
        if axis(other).dot(&axis(patch)).clamp(-1.0, 1.0).acos() > heatmap.angle {
            continue;
        }
        for (place, point) in (0..).zip(&other.points) {
            let (u, v) = patch.camera.project(&patch.camera_from_object.point(&point.point.into()));
            let (run, rank, type_index, value) = (other.run, other.rank, other.type_index, other.value);
            expected.push(HeatmapPoint { run, rank, type_index, point: place, pixel: [u, v], value });
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
    PLACE.run("patches", "quirk", &quirk);
    let (quirk, plain) = (PLACE.open("quirk"), PLACE.open("depth"));
    for patch in patches(&quirk) {
        let straight = plain.sample_of(&patch.sample).expect("readable").expect("the same grasp");
        let straight = straight.heatmap_patch().expect("a patch");
        assert_eq!((patch.camera, straight.point_focal_length), (straight.camera, None));
        assert_eq!(patch.point_focal_length, Some(589.366_454));
        for (point, straight) in patch.points.iter().zip(&straight.points) {
            for (axis, middle) in [320.0, 240.0].into_iter().enumerate() {
                let told = middle + (straight.pixel[axis] - middle) * 589.366_454 / patch.camera.fx;
                assert!((point.pixel[axis] - told).abs() < 1e-9);
            }
        }
    }
}

/// Triangles of a ball.
fn ball(radius: f32) -> TriMesh {
    let (rings, around) = (12, 24);
    let mut mesh = TriMesh { vertices: Vec::new(), triangles: Vec::new() };
    for ring in 0..=rings {
        let (up, level) = (std::f32::consts::PI * ring as f32 / rings as f32).sin_cos();
        for step in 0..around {
            let (sin, cos) = (std::f32::consts::TAU * step as f32 / around as f32).sin_cos();
            mesh.vertices.push([radius * up * cos, radius * up * sin, radius * level]);
        }
    }
    for ring in 0..rings {
        for step in 0..around {
            let next = (step + 1) % around;
            let [a, b] = [ring * around, (ring + 1) * around];
            mesh.triangles.push([a + step, b + step, b + next]);
            mesh.triangles.push([a + step, b + next, a + next]);
        }
    }
    mesh
}

#[test]
fn threads_levels_kills_and_shards_change_no_byte() {
    let first = PLACE.run("patches", "first", &[&NO_COLOUR[..], &["--threads", "1"]].concat());
    assert_eq!(first.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact]);
    assert_eq!(PLACE.run("patches", "two", &[&NO_COLOUR[..], &["--threads", "2"]].concat()), first, "every file");
    assert!(first.shards.len() > 1);
    let other = PLACE.run("patches", "shards", &[&NO_COLOUR[..], &["--set", "shards.samples=1000"]].concat());
    assert_eq!((other.root, other.shards.len()), (first.root, 1));
    let mut scalar = PLACE.command("patches", "scalar", &NO_COLOUR);
    succeeded(&scalar.env("GRASPMILL_SIMD", "scalar").output().expect("graspmill starts"));
    assert_eq!(Manifest::read(&PLACE.at("scalar")).expect("a dataset"), first);
    for kill in 0..6 {
        let mut child = PLACE.command("patches", "killed", &NO_COLOUR);
        let mut child = child.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("graspmill starts");
        thread::sleep(Duration::from_millis(5 + 15 * kill));
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    assert_eq!(PLACE.run("patches", "killed", &NO_COLOUR), first);
    let options = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: false, threads: 2 };
    assert!(verify(&PLACE.at("first"), options, |_| ()).expect("readable").is_intact());
    let more = ["verify", "--regenerate", "5", "--seed", "2", "--json"];
    let found = succeeded(&graspmill().args(more).arg(PLACE.at("first")).output().expect("graspmill starts"));
    let found: serde_json::Value = serde_json::from_str(&found).expect("JSON");
    assert_eq!((&found["regenerated"]["samples"], &found["intact"]), (&5.into(), &true.into()));
    assert_eq!(found["regenerated"]["differences"].as_array().map(Vec::len), Some(0));
}

#[test]
fn the_second_stage_follows_from_the_first() {
    let first = Manifest::read(&PLACE.at("depth")).expect("a dataset");
    // Both stages anew, in other folders.
    let grasps = PLACE.run("grasps", "grasps-again", &["--threads", "1"]);
    assert_eq!(grasps.root, Manifest::read(&PLACE.at("grasps")).expect("a dataset").root);
    let again =
        PLACE.run("patches", "again", &["--set", "grasps.dataset=grasps-again", "--set", "render.colour=false"]);
    assert_eq!((again.root, &again.shards), (first.root, &first.shards));
    // Other grasps are other patches, and a pinned root finds out.
    let other = PLACE.run("grasps", "grasps-other", &["--set", "seed=6"]);
    let root = grasps.classes[&NumberClass::Exact].hex();
    let resolved = fs::read_to_string(PLACE.at("depth/job.toml")).expect("the resolved job");
    assert!(resolved.contains(&format!("root = \"{root}\"")) && resolved.contains("dataset = \"../grasps\""));
    let pinned = format!("grasps.root=\"{root}\"");
    let told = PLACE.fail("patches", "never", &["--set", &pinned, "--set", "grasps.dataset=grasps-other"]);
    assert!(told.contains("grasps.root") && told.contains(&other.classes[&NumberClass::Exact].short()), "{told}");
}

#[test]
fn only_finished_datasets_of_grasps_are_looked_at() {
    let unfinished = PLACE.at("unfinished");
    fs::create_dir(&unfinished).expect("a folder");
    fs::copy(PLACE.at("grasps/run.json"), unfinished.join("run.json")).expect("a copy");
    let told = PLACE.fail("patches", "never", &["--set", "grasps.dataset=unfinished"]);
    assert!(told.contains("grasps.dataset") && told.contains("not finished"), "{told}");
    let told = PLACE.fail("patches", "never", &["--set", "grasps.dataset=depth"]);
    assert!(told.contains("a dataset of patches, not of grasps"), "{told}");
    let told = PLACE.fail("patches", "never", &["--set", "grasps.dataset=nowhere"]);
    assert!(told.contains("nowhere") && told.contains("make it first"), "{told}");
    let tips = "patches.tips=[\"distal_1_outer\", \"thumb\", \"distal_3_outer\"]";
    let told = PLACE.fail("patches", "never-tips", &["--set", tips, "--set", "render.colour=false"]);
    assert!(told.contains("no contact `thumb`") && told.contains("distal_2_outer"), "{told}");
    assert!(fs::read_dir(PLACE.at("never")).is_err(), "nothing was begun");
}

#[test]
fn patches_out_of_the_image_are_counted() {
    let narrow = ["--set", "render.colour=false", "--set", "camera.width=100", "--set", "camera.horizontal_fov=0.18"];
    let manifest = PLACE.run("patches", "narrow", &narrow);
    assert!(!manifest.counts.rejected.is_empty(), "{:?}", manifest.counts);
    assert!(manifest.counts.rejected.keys().all(|reason| reason.ends_with("_out_of_frame")));
    let inspected = succeeded(&graspmill().arg("inspect").arg(PLACE.at("narrow")).output().expect("graspmill starts"));
    assert!(inspected.contains("_out_of_frame"), "{inspected}");
}

/// Colours have a root of their own, and leave the exact numbers alone.
#[test]
fn colours_lie_over_depth() {
    let depth = Manifest::read(&PLACE.at("depth")).expect("a dataset");
    let first = PLACE.run("patches", "colour", &["--threads", "1"]);
    assert_eq!(PLACE.run("patches", "colour-two", &["--threads", "2"]), first, "every file");
    assert_eq!(first.classes[&NumberClass::Exact], depth.classes[&NumberClass::Exact]);
    assert_eq!(first.class_topics[&NumberClass::Colour], ["/patches/colour"]);
    assert!(first.platform.contains_key("gl_renderer") && depth.platform.is_empty());
    let options = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: false, threads: 2 };
    assert!(verify(&PLACE.at("colour"), options, |_| ()).expect("readable").is_intact());
    let random = PLACE.run("patches", "random", &["--set", "render.randomise=true"]);
    assert_eq!(random.classes[&NumberClass::Exact], depth.classes[&NumberClass::Exact]);
    assert_eq!(PLACE.run("patches", "random-again", &["--set", "render.randomise=true"]), random);
    let (mut edges, mut pixels) = (0, 0);
    let background = Look::default().background;
    let (plain, random) = (PLACE.open("colour"), PLACE.open("random"));
    let mut backgrounds = BTreeSet::new();
    for sample in plain.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let patch = sample.heatmap_patch().expect("a patch");
        let colour = sample.patch_colour().expect("readable").expect("colours");
        assert_eq!((colour.sample, colour.rgb.len()), (patch.sample, patch.depth.len()));
        for (rgb, depth) in colour.rgb.iter().zip(&patch.depth) {
            // A pixel that is seen at all of its four samples is not as the background is.
            edges += u32::from((*rgb == background) != depth.is_nan());
            pixels += u32::from(!depth.is_nan());
        }
        // A pixel without depth shows the background, drawn anew for each grasp.
        let other = random.sample_of(&sample.id).expect("readable").expect("the same grasp");
        let other = other.patch_colour().expect("readable").expect("colours");
        backgrounds.extend(other.rgb.iter().zip(&patch.depth).find(|(_, depth)| depth.is_nan()).map(|(rgb, _)| *rgb));
    }
    println!("colours: {edges} edge pixels beside {pixels} with depth");
    assert!(f64::from(edges) < 0.1 * f64::from(pixels) && edges > 0, "{edges} of {pixels}");
    assert!(backgrounds.len() as u64 > first.counts.kept / 2);
    let mut command = graspmill();
    command.arg("report").arg(PLACE.at("colour")).arg("--out").arg(PLACE.at("colour.html"));
    succeeded(&command.output().expect("graspmill starts"));
    assert!(fs::read_to_string(PLACE.at("colour.html")).expect("a page").contains("colours around palm"));
}

/// The image in colour is drawn apart from the patches; both show the same.
#[test]
fn whole_images_in_colour_hold_the_patches() {
    let plain = PLACE.run("patches", "colour-alone", &[]);
    let full = PLACE.run("patches", "colour-images", &["--set", "images.full=true", "--threads", "1"]);
    assert_eq!(PLACE.run("patches", "colour-images-two", &["--set", "images.full=true", "--threads", "2"]), full);
    assert_eq!(full.class_topics[&NumberClass::Colour], ["/patches/colour", "/patches/image_colour"]);
    let options = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: false, threads: 2 };
    assert!(verify(&PLACE.at("colour-images"), options, |_| ()).expect("readable").is_intact());
    let (reader, plain) = (PLACE.open("colour-images"), (PLACE.open("colour-alone"), plain).0);
    let (mut apart, mut pixels, mut bytes) = (0, 0, 0);
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let (patch, colour) = (sample.heatmap_patch().expect("a patch"), sample.patch_colour().expect("readable"));
        let alone = plain.sample_of(&sample.id).expect("readable").expect("the same grasp");
        assert_eq!(alone.payload(Channel::PatchColour), sample.payload(Channel::PatchColour));
        let image = sample.patch_image_colour().expect("readable").expect("an image");
        let depth = sample.patch_image().expect("readable").expect("an image");
        let whole = image.whole(640, 480);
        bytes += sample.payload(Channel::PatchImageColour).map_or(0, <[u8]>::len);
        let colour = colour.expect("colours");
        for (place, PatchPoint { corner: [left, top], .. }) in patch.points.iter().enumerate() {
            for (k, rgb) in (0..).zip(colour.rgb_of(place)) {
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
        PLACE.run("patches", name, more);
        let first = fs::read(PLACE.at(name).join("preview.mcap")).expect("a preview");
        assert!(first.len() > 10_000);
        let again = format!("{name}-again");
        PLACE.run("patches", &again, more);
        assert_eq!(fs::read(PLACE.at(&again).join("preview.mcap")).expect("a preview"), first);
        let schemas: &[&[u8]] = &[b"foxglove.RawImage", b"foxglove.CameraCalibration", b"foxglove.SceneUpdate"];
        for schema in schemas {
            assert!(first.windows(schema.len()).any(|window| window == *schema));
        }
    }
}

/// Without EGL colours are refused with what to install, and all else is made as it is.
#[test]
fn only_colours_need_egl() {
    let without_egl = |out: &str, more: &[&str]| {
        let mut command = PLACE.command("patches", out, more);
        command.env("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json");
        command.output().expect("graspmill starts")
    };
    let told = failed(&without_egl("no-egl", &[]));
    assert!(told.contains("colours cannot be drawn") && told.contains("make deps-gl"), "{told}");
    assert!(told.contains("render.colour = false"), "{told}");
    succeeded(&without_egl("no-egl-depth", &NO_COLOUR));
    let (made, depth) = (Manifest::read(&PLACE.at("no-egl-depth")), Manifest::read(&PLACE.at("depth")));
    assert_eq!(made.expect("a dataset"), depth.expect("a dataset"));
}

#[test]
fn a_report_shows_types_and_sheets() {
    let page = |name: &str| {
        let mut command = graspmill();
        command.arg("report").arg(PLACE.at("depth")).arg("--out").arg(PLACE.at(name));
        succeeded(&command.output().expect("graspmill starts"));
        fs::read_to_string(PLACE.at(name)).expect("a page")
    };
    let (one, two) = (page("one.html"), page("two.html"));
    assert_eq!(one, two, "two reports of one dataset have the same bytes");
    assert!(one.contains("id=\"types\"") && one.contains("depth around F2") && one.contains("data:image/png"));
    let inspected = graspmill().args(["inspect", "--json"]).arg(PLACE.at("depth")).output().expect("graspmill starts");
    let inspected: serde_json::Value = serde_json::from_str(&succeeded(&inspected)).expect("JSON");
    assert_eq!(inspected["product"], "patches");
    assert!(inspected["types"].as_array().is_some_and(|types| !types.is_empty()));
}
