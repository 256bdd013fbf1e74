//! Datasets of grasps from job file to report: the same root whatever the threads, the kills and the order, and what damage
//! is found.
#![cfg(feature = "sim")]

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::Duration,
};

use graspmill::{
    dataset::{DatasetReader, Manifest, NumberClass, Selection, Shapes, VerifyLevel, VerifyOptions, verify},
    geom::Shape,
    record::{Channel, Grasp, GraspVerdict},
};

mod python;

fn graspmill() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// A job of three shapes with few steps, in a folder of its own.
struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/barrett_bh8_280.xml");
        let job = format!(
            concat!(
                "product = \"grasps\"\nname = \"small\"\nseed = 5\n[hand]\nscene = \"{}\"\n[[objects]]\n",
                "built_in = [\"can-01\", \"box-01\", \"half-cube-sphere\"]\n[grasps]\nseeds = 3\n",
                "[annealing]\nsteps = 300\nmost_failures = 300\n[shards]\nruns = 2\n"
            ),
            scene.display()
        );
        fs::write(folder.path().join("job.toml"), job).expect("a job file");
        Self { folder }
    }

    fn out(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, out: &str, more: &[&str]) -> Command {
        let mut command = graspmill();
        command.arg("run").arg(self.folder.path().join("job.toml")).arg("--out").arg(self.out(out));
        command.args(["--progress", "none"]).args(more);
        command
    }

    fn run(&self, out: &str, more: &[&str]) -> Manifest {
        succeeded(&self.command(out, more).output().expect("graspmill starts"));
        Manifest::read(&self.out(out)).expect("a finished dataset")
    }
}

fn succeeded(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn threads_levels_kills_and_shards_change_no_byte() {
    let place = Place::new();
    let first = place.run("first", &["--threads", "1"]);
    assert_eq!(first.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact]);
    assert_eq!(place.run("two", &["--threads", "2"]), first, "every file");
    let other = place.run("shards", &["--set", "shards.runs=9"]);
    assert_eq!((other.root, other.shards.len()), (first.root, 1));
    let scalar = place.command("scalar", &[]).env("GRASPMILL_SIMD", "scalar").output().expect("graspmill starts");
    succeeded(&scalar);
    assert_eq!(Manifest::read(&place.out("scalar")).expect("a dataset"), first);
    for kill in 0..4 {
        let mut command = place.command("killed", &[]);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("graspmill starts");
        thread::sleep(Duration::from_millis(100 + 250 * kill));
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    assert_eq!(place.run("killed", &[]), first);
    let again = succeeded(&place.command("killed", &[]).output().expect("graspmill starts"));
    assert!(again.contains("nothing to do"), "{again}");
    let more = ["verify", "--regenerate", "5", "--seed", "2", "--json"];
    let found = succeeded(&graspmill().args(more).arg(place.out("first")).output().expect("graspmill starts"));
    let found: serde_json::Value = serde_json::from_str(&found).expect("JSON");
    assert_eq!(found["regenerated"]["samples"], 5);
    assert_eq!(found["regenerated"]["differences"].as_array().map(Vec::len), Some(0));
    // A sample is that of its object and seed, whatever else stands in the job.
    let alone = place.run("alone", &["--set", "objects=[{built_in=[\"box-01\"]}]"]);
    let [all, alone] =
        [(first, "first"), (alone, "alone")].map(|(_, name)| DatasetReader::open(&place.out(name)).expect("a dataset"));
    for sample in alone.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let same = all.sample_of(&sample.id).expect("readable").expect("there as well");
        assert_eq!(same.payload(Channel::GraspRun), sample.payload(Channel::GraspRun));
    }
}

/// Grasps that no search was for, of a gripper that gives way until both pads hold the object.
#[test]
fn samplers_without_a_search_make_datasets() {
    let place = Place::new();
    let scene_of = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
    let scene = scene_of("fetch_gripper.xml");
    for (sampler, keys, most) in
        [("uniform", "grasps = 3\nposes = \"any\"", 3), ("antipodal", "pairs = 100\nbest = 2", 2)]
    {
        let job = format!(
            concat!(
                "product = \"grasps\"\nname = \"{}\"\nseed = 5\n[hand]\nscene = \"{}\"\n[[objects]]\n",
                "built_in = [\"can-01\"]\n[grasps]\nseeds = 2\nsampler = \"{}\"\n[{}]\n{}\n",
                "[keep]\ntorsion = 0.002\n[split]\nvalidation_models = 0\ntest_models = 0\n"
            ),
            sampler,
            scene.display(),
            sampler,
            sampler,
            keys
        );
        fs::write(place.folder.path().join("job.toml"), job).expect("a job file");
        let first = place.run(&format!("{sampler}-one"), &["--threads", "1"]);
        assert_eq!(
            place.run(&format!("{sampler}-two"), &["--threads", "2", "--set", "shards.runs=1"]).root,
            first.root
        );
        let mut command = place.command(&format!("{sampler}-scalar"), &[]);
        succeeded(&command.env("GRASPMILL_SIMD", "scalar").output().expect("graspmill starts"));
        assert_eq!(Manifest::read(&place.out(&format!("{sampler}-scalar"))).expect("a dataset"), first);
        let reader = DatasetReader::open(&place.out(&format!("{sampler}-one"))).expect("a dataset");
        let samples = reader.iter(Selection::default()).map(|sample| sample.expect("a sample"));
        let runs: Vec<_> = samples.map(|sample| sample.grasp_run().expect("a run")).collect();
        assert!(runs.iter().all(|run| run.method.sampler == sampler && run.grasps.len() <= most));
        assert!(runs.iter().flat_map(|run| &run.grasps).any(|grasp| grasp.shift.is_some()), "{sampler}");
    }
    let barrett = scene_of("barrett_bh8_280.xml");
    let plain = place.command("barrett", &["--set", &format!("hand.scene={}", barrett.display())]).output();
    let said = String::from_utf8_lossy(&plain.expect("graspmill starts").stderr).into_owned();
    assert!(said.contains("needs a gripper"), "{said}");
}

/// Physics is a class of its own: with it and without it the root of class exact is the same.
#[test]
fn trials_move_no_grasp() {
    let place = Place::new();
    let plain = place.run("plain", &[]);
    let asked = ["--set", "physics={roll_out_share=0.5,roll_outs=3}", "--set", "annealing.steps=300"];
    let tried = place.run("tried", &[&asked[..], &["--threads", "2"]].concat());
    assert_eq!(tried.classes[&NumberClass::Exact], plain.classes[&NumberClass::Exact]);
    assert_eq!(tried.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact, &NumberClass::Physics]);
    assert_eq!(tried.class_of(Channel::GraspTrials), Some(NumberClass::Physics));
    assert!(tried.root != plain.root && tried.platform.contains_key("libmujoco"));
    assert_eq!(
        place.run("again", &[&asked[..], &["--threads", "1", "--set", "shards.runs=9"]].concat()).root,
        tried.root
    );
    let counts = tried.counts.grasps.expect("counts of grasps");
    let trials = counts.trials.expect("counts of trials");
    assert_eq!(trials.tried, counts.of_verdict(GraspVerdict::Kept));
    assert!(trials.held + trials.refused <= trials.tried && trials.tried > 0, "{trials:?}");
    assert_eq!(plain.counts.grasps.expect("counts of grasps").trials, None);
    let out = place.out("tried");
    let reader = DatasetReader::open(&out).expect("a dataset");
    let mut rolled_out = 0;
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let (run, trials) = (sample.grasp_run().expect("a run"), sample.grasp_trials().expect("readable"));
        let trials = trials.expect("a channel of trials");
        assert_eq!(trials.trials.len(), run.kept().count());
        assert!(trials.trials.iter().all(|trial| trial.perturbed.len() == 2));
        rolled_out += trials.trials.iter().filter(|trial| trial.roll_outs[0] == 3).count();
    }
    assert!(rolled_out > 0 && rolled_out < trials.tried as usize, "{rolled_out}");
    let options = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: false, threads: 1 };
    let found = verify(&out, options, |_| ()).expect("readable");
    assert!(found.is_intact(), "{:?}", found.problems);
    let more = ["verify", "--regenerate", "3", "--seed", "2"];
    succeeded(&graspmill().args(more).arg(&out).output().expect("graspmill starts"));
    let inspected = succeeded(&graspmill().arg("inspect").arg(&out).output().expect("graspmill starts"));
    assert!(inspected.contains("grasps tried") && inspected.contains("perturbed runs"), "{inspected}");
    succeeded(&graspmill().arg("report").arg(&out).output().expect("graspmill starts"));
    let page = fs::read_to_string(out.join("report.html")).expect("a page");
    assert!(page.contains("id=\"trials\"") && page.contains("<th>held</th>") && page.contains("Brier score"));
    replays_in_plain_mujoco(&out);
}

/// MuJoCo out of its own Python package, with contacts of its own, says of nearly all grasps what we say of them.
fn replays_in_plain_mujoco(dataset: &Path) {
    let replay = dataset.join("replay");
    let mut export = graspmill();
    export.arg("export").arg(dataset).args(["--to", "mujoco", "--limit", "8", "--out"]).arg(&replay);
    assert!(succeeded(&export.output().expect("graspmill starts")).starts_with("8 grasps in "));
    let told = python::run(python::PYTHON, |command| command.arg(replay.join("replay.py")));
    let agreement = || fs::read_to_string(replay.join("agreement.json")).expect("written");
    let found: serde_json::Value = serde_json::from_str(&agreement()).expect("JSON");
    let [replayed, sure, agreed] = ["replayed", "sure", "sure_agreed"].map(|key| found[key].as_u64().expect("a count"));
    assert!(replayed == 8 && sure >= 4 && sure - agreed <= 1, "{told}");
    succeeded(&graspmill().arg("report").arg(dataset).output().expect("graspmill starts"));
    let page = fs::read_to_string(dataset.join("report.html")).expect("a page");
    assert!(page.contains("Replayed in plain MuJoCo 3.17.0"));
    // What it says of another dataset does not count.
    let root = Manifest::read(dataset).expect("a dataset").root.hex();
    fs::write(replay.join("agreement.json"), agreement().replace(&root, &"0".repeat(64))).expect("written");
    let refused = graspmill().arg("report").arg(dataset).output().expect("graspmill starts");
    assert!(!refused.status.success() && String::from_utf8_lossy(&refused.stderr).contains("agreement.json"));
}

#[test]
fn a_dataset_tells_of_its_hand_its_objects_and_every_run() {
    let place = Place::new();
    let manifest = place.run("data", &[]);
    let out = place.out("data");
    let reader = DatasetReader::open(&out).expect("a dataset");
    let assets = reader.assets().expect("the asset table");
    let shapes = Shapes::open(&out).expect("the shapes");
    let hand = shapes.hand().expect("the hand");
    assert_eq!((assets.hands.len(), hand.id), (1, assets.hands[0].object));
    assert!(hand.joints.len() == 8 && hand.solids.len() > 8);
    assert!(hand.solids.iter().all(|solid| !matches!(solid.shape, Shape::Mesh(_))));
    assert_eq!(shapes.objects(), 3);
    for (place, row) in assets.objects.iter().enumerate() {
        let object = shapes.object(place).expect("an object");
        assert_eq!(object.object, row.object);
        assert_eq!(row.facts["triangles"], object.mesh.triangles.len());
    }
    let mut seeds = BTreeSet::new();
    let mut kept = 0;
    for sample in reader.iter(Selection::default()) {
        let run = sample.expect("a sample").grasp_run().expect("a run");
        assert_eq!((run.asked_steps, run.hand.id, run.sample.view.0 < 3), (300, hand.id, true));
        assert!(!run.grasps.is_empty() && run.grasps.len() <= 20);
        seeds.insert(run.object_from_seed.to_rows().map(f64::to_bits));
        for grasp in &run.grasps {
            // The palm is carried by the base: one place of it, whatever the posture.
            let base_from_approach = grasp.object_from_base.inverse() * grasp.object_from_approach;
            let first = run.grasps[0].object_from_base.inverse() * run.grasps[0].object_from_approach;
            let apart = base_from_approach.to_rows().into_iter().zip(first.to_rows()).map(|(a, b)| (a - b).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-9);
            kept += u64::from(grasp.verdict == GraspVerdict::Kept);
        }
    }
    assert_eq!(seeds.len() as u64, manifest.counts.kept, "each run has a seed of its own");
    let counts = manifest.counts.grasps.expect("counts of grasps");
    assert_eq!(counts.of_verdict(GraspVerdict::Kept), kept);
    let inspected = succeeded(&graspmill().args(["inspect", "--json"]).arg(&out).output().expect("graspmill starts"));
    let inspected: serde_json::Value = serde_json::from_str(&inspected).expect("JSON");
    assert_eq!((&inspected["runs"], &inspected["verdicts"]["kept"]), (&9.into(), &kept.into()));
    let page = |name: &str| {
        let mut command = graspmill();
        command.arg("report").arg(&out).arg("--out").arg(place.out(name));
        succeeded(&command.output().expect("graspmill starts"));
        fs::read_to_string(place.out(name)).expect("a page")
    };
    let (one, two) = (page("one.html"), page("two.html"));
    assert_eq!(one, two, "two reports of one dataset have the same bytes");
    assert!(one.contains("id=\"types\"") && one.contains("half-cube-sphere") && one.contains("data:image/png"));
    assert!(fs::metadata(out.join("preview.mcap")).is_ok_and(|file| file.len() > 10_000));
}

/// What a run says of tables is what the asset table says; with `keep.table` nothing changes but verdicts.
#[test]
fn objects_rest_and_hands_stay_above_the_table() {
    let place = Place::new();
    place.run("plain", &[]);
    let watched = place.run("watched", &["--set", "keep.table=true", "--threads", "1"]);
    let [plain, other] = ["plain", "watched"].map(|name| DatasetReader::open(&place.out(name)).expect("a dataset"));
    let assets = plain.assets().expect("the asset table");
    assert_eq!(assets, other.assets().expect("the asset table"));
    let mut below = 0;
    for (one, two) in plain.iter(Selection::default()).zip(other.iter(Selection::default())) {
        let [one, two] = [one, two].map(|sample| sample.expect("a sample").grasp_run().expect("a run"));
        let row = assets.objects.iter().find(|row| row.object == one.sample.subject).expect("a row");
        let resting = row.facts["resting"].as_array().expect("poses");
        assert!(resting.len() >= 2 && resting.len() == one.resting.poses.len());
        assert_eq!(row.facts["resting_left_out"], one.resting.left_out);
        for (row, pose) in resting.iter().zip(&one.resting.poses) {
            assert_eq!((&row["probability"], &row["height"]), (&pose.probability.into(), &pose.height.into()));
            assert_eq!(row["world_from_object"], serde_json::json!(pose.world_from_object.to_rows()));
        }
        for (one, two) in one.grasps.iter().zip(&two.grasps) {
            let low = (0..resting.len()).all(|pose| !one.is_above_table(pose));
            let falls = one.verdict == GraspVerdict::Kept && low;
            let verdict = if falls { GraspVerdict::BelowTable } else { one.verdict };
            assert_eq!(*two, Grasp { verdict, ..one.clone() });
            below += u64::from(falls);
        }
    }
    assert_eq!(watched.counts.grasps.expect("counts of grasps").of_verdict(GraspVerdict::BelowTable), below);
    let inspected = succeeded(&graspmill().arg("inspect").arg(place.out("plain")).output().expect("graspmill starts"));
    assert!(inspected.contains("on a table the hand stays above it"), "{inspected}");
    succeeded(&graspmill().arg("report").arg(place.out("watched")).output().expect("graspmill starts"));
    let page = fs::read_to_string(place.out("watched").join("report.html")).expect("a page");
    assert!(page.contains("id=\"table\"") && page.contains("below table") && page.contains("resting poses"));
}

/// The table of objects says what one weighs; another weighs by its volume.
#[test]
fn masses_of_the_table_are_those_of_trials() {
    let place = Place::new();
    let table = "name,mass,mass_source\ncan-01,0.25,scales\n";
    fs::write(place.out("masses.csv"), table).expect("a table");
    let objects = "objects=[{built_in=[\"can-01\",\"box-01\"],table=\"masses.csv\"}]";
    let physics = "physics={perturbed=0}";
    let tried = place.run("tried", &["--set", objects, "--set", physics]);
    let reader = DatasetReader::open(&place.out("tried")).expect("a dataset");
    let assets = reader.assets().expect("the asset table");
    let mut seen = BTreeSet::new();
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let method = sample.grasp_trials().expect("readable").expect("trials").method;
        let name = &assets.objects.iter().find(|row| row.object == sample.id.subject).expect("a row").name;
        match name.as_str() {
            "can-01" => assert_eq!((method.mass, method.mass_source.as_str()), (0.25, "scales")),
            _ => assert!(method.mass != 0.25 && method.mass_source.is_empty()),
        }
        seen.insert((name.clone(), method.mass_from));
    }
    let expected = [("box-01", "volume"), ("can-01", "table")].map(|(name, from)| (name.to_owned(), from.to_owned()));
    assert_eq!(seen, expected.into_iter().collect());
    // The resolved job says the same; the job itself says what all weigh.
    let resolved = place.out("tried").join("job.toml");
    let again = place.out("resolved");
    let mut command = graspmill();
    command.arg("run").arg(&resolved).arg("--out").arg(&again).args(["--progress", "none"]);
    succeeded(&command.output().expect("graspmill starts"));
    assert_eq!(Manifest::read(&again).expect("a dataset").root, tried.root);
    let plain = place.run("plain", &["--set", "objects=[{built_in=[\"can-01\",\"box-01\"]}]", "--set", physics]);
    assert_eq!(plain.classes[&NumberClass::Exact], tried.classes[&NumberClass::Exact]);
    assert!(plain.job != tried.job && plain.classes[&NumberClass::Physics] != tried.classes[&NumberClass::Physics]);
    let given = ["--set", objects, "--set", "physics={perturbed=0,mass=0.3}"];
    let given = place.run("given", &given);
    let reader = DatasetReader::open(&place.out("given")).expect("a dataset");
    let sample = reader.iter(Selection::default()).next().expect("samples").expect("a sample");
    let method = sample.grasp_trials().expect("readable").expect("trials").method;
    assert_eq!((method.mass, method.mass_from.as_str()), (0.3, "job"));
    assert!(!fs::read_to_string(place.out("given").join("job.toml")).expect("a job").contains("scales"));
    assert!(given.job != tried.job);
}

#[test]
fn damage_to_the_shapes_is_found() {
    let place = Place::new();
    place.run("data", &[]);
    let out = place.out("data");
    let options = VerifyOptions { level: VerifyLevel::Full, partial_inside_complete: false, threads: 1 };
    assert!(verify(&out, options, |_| ()).expect("readable").is_intact());
    let path = out.join("shapes.mcap");
    let mut bytes = fs::read(&path).expect("the shapes");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&path, bytes).expect("written");
    let report = verify(&out, options, |_| ()).expect("readable");
    assert!(report.problems.iter().all(|problem| problem.file == "shapes.mcap"), "{:?}", report.problems);
    assert!(!report.is_intact());
    fs::remove_file(&path).expect("removed");
    assert!(!verify(&out, options, |_| ()).expect("readable").is_intact());
    // The run mends it: shards are kept, tables and shapes are made again.
    fs::remove_file(out.join("manifest.json")).expect("removed");
    place.run("data", &[]);
    assert!(verify(&out, options, |_| ()).expect("readable").is_intact());
}
