//! Datasets of grasps from job file to report: the same root for all threads, kills and orders, and damage is found.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
    sync::LazyLock,
    thread,
    time::Duration,
};

use graspmill::{
    assets::read_triangles,
    factory::{
        Cancel, Parallelism, ProduceError, RunContext, RunError,
        job::{JobContext, JobText},
        run::OpenJob,
        work::Opening,
    },
    files::Folder,
    format::{
        Channel, Grasp, GraspLabel, GraspRun, GraspTrial, GraspTrials,
        dataset::{DatasetReader, Manifest, Sample, Selection, verify},
        extras::Shapes,
    },
    geom::{Shape, Triangles},
    ids::SampleId,
    words::{GraspVerdict, NumberClass},
};
use nalgebra::Vector3;

use crate::support::{
    files::{FULL_CHECK, assert_intact, copy_folder, flip_bit, read_json, read_text, repository_path},
    jobs::{NO_SPLIT, barrett_line},
    meshes::{block, centred_block, off_of, round, write_stl},
    program::{Program, print_by_rerun},
    robots::BARRETT,
    workspace::Workspace,
};

/// A workspace with a job of two shapes and few steps.
fn write_job() -> Workspace {
    let workspace = Workspace::new();
    workspace.write("job.toml", job());
    workspace
}

/// Two shapes and few steps.
fn job() -> String {
    format!(
        "product = \"grasps\"\nname = \"small\"\nseed = 5\n{}\
         objects = [{{ built_in = [\"can-01\", \"box-01\"] }}]\n[grasps]\nseeds = 2\n\
         [annealing]\nsteps = 300\nmax_failures = 300\n[shards]\nruns = 2\n",
        barrett_line()
    )
}

fn run(workspace: &Workspace, out: &str, arguments: &[&str]) -> Manifest {
    workspace.run_job("job", out).args(arguments).succeed();
    Manifest::read(&Folder::at(workspace.path(out))).expect("a finished dataset")
}

fn open(workspace: &Workspace, name: &str) -> DatasetReader {
    DatasetReader::open(&Folder::at(workspace.path(name))).expect("a dataset")
}

/// The dataset of [`job`], made once for all tests that only read it.
fn plain() -> PathBuf {
    static MADE: LazyLock<Workspace> = LazyLock::new(|| {
        // A copy, since reports are written beside the dataset.
        let made = Workspace::beside_fixtures("grasps");
        copy_folder(Workspace::with_datasets(&[("plain", job())]).folder(), made.folder());
        made
    });
    MADE.path("plain")
}

/// Writes the report of a dataset into its folder; returns its page.
fn read_report(dataset: &Path) -> String {
    Program::on("report", dataset).succeed();
    read_text(dataset.join("report.html"))
}

#[test]
fn threads_levels_kills_and_shards_change_no_byte() {
    let workspace = write_job();
    let first = run(&workspace, "first", &["--threads", "1"]);
    assert_eq!(first.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact]);
    assert_eq!(run(&workspace, "two", &["--threads", "2"]), first, "every file");
    let other = run(&workspace, "shards", &["--set", "shards.runs=9"]);
    assert_eq!((other.root, other.shards.len()), (first.root, 1));
    workspace.run_job("job", "scalar").env("GRASPMILL_SIMD", "scalar").succeed();
    assert_eq!(Manifest::read(&Folder::at(workspace.path("scalar"))).expect("a dataset"), first);
    for kill in 0..4 {
        workspace.run_job("job", "killed").kill_after(Duration::from_millis(100 + 250 * kill));
    }
    assert_eq!(run(&workspace, "killed", &[]), first);
    let again = workspace.run_job("job", "killed").succeed().stdout;
    assert!(again.contains("nothing to do"), "{again}");
    let verify = Program::new("verify").args(["--regenerate", "4", "--seed", "2"]);
    let found = verify.arg(workspace.path("first")).read_json();
    assert_eq!(found["regenerated"]["samples"], 4);
    assert_eq!(found["regenerated"]["differences"].as_array().map(Vec::len), Some(0));
    // A sample depends only on its object and seed, not on the rest of the job.
    run(&workspace, "alone", &["--set", "objects=[{built_in=[\"box-01\"]}]"]);
    let [all, alone] = ["first", "alone"].map(|name| open(&workspace, name));
    for sample in alone.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let same = all.sample_of(&sample.id).expect("readable").expect("there as well");
        assert_eq!(same.payload(Channel::GRASP_RUN), sample.payload(Channel::GRASP_RUN));
    }
}

/// Grasps that no search was for, of a gripper that gives way until both pads hold the object.
#[test]
#[ignore = "slow: a dataset per sampler"]
fn samplers_without_a_search_make_datasets() {
    let workspace = write_job();
    let scene = repository_path("scenes/fetch_gripper.xml");
    for (name, sampler, keys, max) in [
        ("along", "approach", "draws = 300\nbest = 2", 2),
        ("uniform", "uniform", "grasps = 3\nposes = \"any\"", 3),
        ("middles", "antipodal", "pairs = 100\nbest = 2\ndepth = \"middle\"", 2),
        ("air", "antipodal", "pairs = 100\nbest = 2", 2),
        ("table", "antipodal", "pairs = 100\nbest = 2\nsupport = \"table\"", 2),
    ] {
        let job = format!(
            "product = \"grasps\"\nname = \"{name}\"\nseed = 5\n[hand]\nmodel = {scene:?}\n[[objects]]\n\
             built_in = [\"can-01\"]\n[grasps]\nseeds = 2\nsampler = \"{sampler}\"\n[{sampler}]\n{keys}\n\
             [keep]\ntorsion = 0.002\n{NO_SPLIT}"
        );
        workspace.write("job.toml", job);
        let first = run(&workspace, &format!("{name}-one"), &["--threads", "1"]);
        let two = run(&workspace, &format!("{name}-two"), &["--threads", "2", "--set", "shards.runs=1"]);
        assert_eq!(two.root, first.root);
        let scalar = format!("{name}-scalar");
        workspace.run_job("job", &scalar).env("GRASPMILL_SIMD", "scalar").succeed();
        assert_eq!(Manifest::read(&Folder::at(workspace.path(&scalar))).expect("a dataset"), first);
        let reader = open(&workspace, &format!("{name}-one"));
        let samples = reader.iter(Selection::default()).map(|sample| sample.expect("a sample"));
        let runs: Vec<_> = samples.map(|sample| sample.read::<GraspRun>().expect("a run")).collect();
        assert!(runs.iter().all(|run| run.method.sampler == sampler && run.grasps.len() <= max));
        // On its table a run keeps its margin in one of the resting poses at least.
        let above = |grasp: &Grasp| grasp.clearances.iter().any(|[shaped, _]| *shaped >= 0.002);
        assert!(name != "table" || runs.iter().flat_map(|run| &run.grasps).all(above));
        let max_advance = if ["air", "table", "along"].contains(&name) { 0.0 } else { 0.03 };
        assert!(runs.iter().all(|run| run.method.max_advance == max_advance), "{name}");
        assert!(runs.iter().flat_map(|run| &run.grasps).any(|grasp| grasp.shift.is_some()), "{name}");
    }
    let barrett =
        [format!("hand.model={}", repository_path(BARRETT).display()), "antipodal={depth=\"middle\"}".to_owned()];
    // Refused before anything is written, by both verbs.
    let job = workspace.path("job.toml");
    for program in [workspace.run_job("job", "barrett"), Program::on("estimate", &job)] {
        let said = program.set(&barrett).expect_code(2).stderr;
        assert!(said.contains("only a gripper has middles of pads"), "{said}");
    }
    assert!(!workspace.path("barrett").exists());
}

/// Approaches of the Barrett hand: the same bytes on one thread and on two, and a budget that is spent is counted.
#[test]
fn approaches_of_several_fingers_make_the_same_dataset_on_any_number_of_threads() {
    let workspace = Workspace::new();
    let job = format!(
        "product = \"grasps\"\nname = \"approaches\"\nseed = 5\n{}objects = [{{ built_in = [\"can-01\"] }}]\n\
         [grasps]\nseeds = 2\nsampler = \"approach\"\n[approach]\ndraws = 400\nbest = 4\n{NO_SPLIT}",
        barrett_line()
    );
    workspace.write("job.toml", job);
    let first = run(&workspace, "one", &["--threads", "1"]);
    assert_eq!(run(&workspace, "two", &["--threads", "2"]), first, "every file");
    let runs = |name: &str| -> Vec<GraspRun> {
        let reader = open(&workspace, name);
        let samples = reader.iter(Selection::default()).map(|sample| sample.expect("a sample"));
        samples.map(|sample| sample.read::<GraspRun>().expect("a run")).collect()
    };
    for run in runs("one") {
        assert_eq!((run.method.sampler.as_str(), run.method.max_advance, run.grasps.len()), ("approach", 0.0, 4));
        assert!(!run.budget_spent && run.asked_steps == run.steps && run.steps < 400);
        let free = |grasp: &Grasp| grasp.object_in_way.is_some_and(|ways| ways.shaped.is_none());
        assert!(run.grasps.iter().all(free), "the way in the posture of the grasp is free of the object");
    }
    run(&workspace, "short", &["--set", "approach={draws=400,best=1000}"]);
    assert!(runs("short").iter().all(|run| run.budget_spent && run.steps == 400));
    assert!(read_report(&workspace.path("short")).contains("approached along surface normals"));
    assert_intact(workspace.path("one"), FULL_CHECK);
}

/// Runs of a plate that is flat on a table, wider than the gripper opens, are rejected, and the dataset reports why.
#[test]
fn runs_on_a_table_without_a_state_say_why() {
    let workspace = write_job();
    workspace.write("plate.off", off_of(&centred_block([0.1, 0.1, 0.003])));
    let job = format!(
        "product = \"grasps\"\nname = \"plate\"\nseed = 5\n[hand]\nmodel = {:?}\n[[objects]]\nlist = [\"plate.off\"]\n\
         [[objects]]\nbuilt_in = [\"can-01\"]\n[grasps]\nseeds = 2\nsampler = \"antipodal\"\n\
         [antipodal]\npairs = 50\nsupport = \"table\"\n{NO_SPLIT}",
        repository_path("scenes/panda_hand.xml")
    );
    workspace.write("job.toml", job);
    let manifest = run(&workspace, "plate", &[]);
    assert_eq!(manifest.counts.rejected.get("no_legal_state"), Some(&2), "{:?}", manifest.counts);
    let rejects = read_text(workspace.path("plate").join("rejects.jsonl"));
    let told = |line: &str| line.contains("of 50 pairs of points") && line.contains("nearer to the table");
    assert!(rejects.lines().count() == 2 && rejects.lines().all(told), "{rejects}");
}

/// Trials of many kinds.
const TRIED: &[&str] = &[
    "--set",
    "physics={rollout_share=0.5,rollouts=3,variant_share=0.5,series_share=0.5,failed_per_held=1000,confirm=\"none\"}",
    "--set",
    "annealing.steps=300",
];

/// Physics is a separate class: with and without it, the root of class exact is the same.
#[test]
#[ignore = "slow: two searches with all trials"]
fn trials_move_no_grasp() {
    let workspace = write_job();
    let plain = Manifest::read(&Folder::at(plain())).expect("a dataset");
    let tried = run(&workspace, "tried", &[TRIED, &["--threads", "2"]].concat());
    assert_eq!(tried.classes[&NumberClass::Exact], plain.classes[&NumberClass::Exact]);
    assert_eq!(tried.classes.keys().collect::<Vec<_>>(), [&NumberClass::Exact, &NumberClass::Physics]);
    assert_eq!(tried.class_of(Channel::GRASP_TRIALS), Some(NumberClass::Physics));
    assert!(tried.root != plain.root && tried.platform.contains_key("libmujoco"));
    assert_eq!(
        run(&workspace, "again", &[TRIED, &["--threads", "1", "--set", "shards.runs=9"]].concat()).root,
        tried.root
    );
    let [kept, tried_count, held, refused] =
        ["grasps_kept", "grasps_tried", "grasps_held", "grasps_refused"].map(|name| tried.counts.fact(name));
    let closed: u64 = ["no_force_closure", "low_quality", "below_table"]
        .map(|verdict| tried.counts.fact(&format!("grasps_{verdict}")))
        .iter()
        .sum();
    assert_eq!(tried_count, kept + closed);
    assert!(held + refused <= tried_count && tried_count > 0, "{:?}", tried.counts.facts);
    assert!(!plain.counts.facts.contains_key("grasps_tried"), "{:?}", plain.counts.facts);
    let (out, reader) = (workspace.path("tried"), open(&workspace, "tried"));
    let (mut rolled_out, mut varied, mut over_time) = (0, 0, 0);
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let (run, trials) =
            (sample.read::<GraspRun>().expect("a run"), sample.find::<GraspTrials>().expect("readable"));
        let trials = trials.expect("a channel of trials");
        let is_tried = |trial: &&GraspTrial| run.grasps[trial.grasp as usize].verdict.is_closed();
        assert_eq!(trials.trials.iter().filter(is_tried).count(), trials.trials.len());
        // Variants are of held grasps alone.
        let held = |trial: &&GraspTrial| trial.outcome.verdict.is_held() || trial.variants.is_empty();
        assert_eq!(trials.trials.iter().filter(held).count(), trials.trials.len());
        varied += trials.trials.iter().filter(|trial| trial.variants.len() == 7).count();
        let is_whole = |trial: &GraspTrial| match trial.label() {
            GraspLabel::Held | GraspLabel::Failed => trial.perturbed.len() == 2,
            GraspLabel::Borderline => trial.roll_outs[0] == 0 || trial.perturbed.len() == 2,
            // A run without a positive has one negative.
            GraspLabel::Unconfirmed => trials.trials.iter().all(|trial| trial.label() != GraspLabel::Held),
            GraspLabel::Untested => true,
        };
        assert!(trials.trials.iter().all(is_whole));
        for trial in trials.trials.iter().filter(|trial| trial.series.is_some()) {
            over_time += 1;
            let of_table = trial.table.as_ref().map(|table| (&table.outcome, &table.series));
            for (outcome, series) in [(&trial.outcome, &trial.series)].into_iter().chain(of_table) {
                let series = series.as_ref().expect("a series of both trials");
                let sampled = 0.02 * series.moved.len() as f64;
                assert!(
                    sampled <= outcome.time + 1e-9 && outcome.time < sampled + 0.02 - 1e-9,
                    "{sampled} {outcome:?}"
                );
                // What held was lifted and shaken for a second each.
                assert!(!outcome.verdict.is_held() || series.samples[1..] == [50, 50], "{:?}", series.samples);
            }
        }
        rolled_out += trials.trials.iter().filter(|trial| trial.roll_outs[0] == 3).count();
    }
    assert!(rolled_out > 0 && rolled_out < tried_count as usize, "{rolled_out}");
    assert!(varied > 0 && varied < held as usize, "{varied} of {held}");
    assert!(over_time > 0 && over_time < tried_count as usize, "{over_time} of {tried_count}");
    assert_intact(&out, FULL_CHECK);
    Program::new("verify").args(["--regenerate", "3", "--seed", "2"]).arg(&out).succeed();
    let inspected = Program::on("inspect", &out).succeed().stdout;
    assert!(inspected.contains("grasps tried") && inspected.contains("perturbed runs"), "{inspected}");
    assert!(inspected.contains("forces and drift over time of "), "{inspected}");
    let page = read_report(&out);
    assert!(page.contains("id=\"trials\"") && page.contains("<th>held</th>") && page.contains("Brier score"));
    replays_in_plain_mujoco(&out);
}

#[test]
#[ignore = "slow: make test-all"]
fn fewer_trials_are_those_of_all() {
    let workspace = write_job();
    let tried = run(&workspace, "tried", TRIED);
    let of_sample = |sample: Sample| {
        let trials = sample.find::<GraspTrials>().expect("readable").expect("a channel of trials");
        (sample.id, (sample.read::<GraspRun>().expect("a run"), trials))
    };
    let samples = open(&workspace, "tried");
    let first = samples.iter(Selection::default()).map(|sample| of_sample(sample.expect("a sample"))).collect();
    kept_grasps_have_the_same_trials_alone(&workspace, tried.counts.fact("grasps_kept"), &first);
    fewer_failures_are_confirmed_on_demand(&workspace, &first);
}

/// A dataset's runs and their trials.
type Tried = BTreeMap<SampleId, (GraspRun, GraspTrials)>;

/// The choice of what is tried moves no trial of a kept grasp as long as every failure is confirmed, nor does what is stored over
/// time.
fn kept_grasps_have_the_same_trials_alone(workspace: &Workspace, kept: u64, first: &Tried) {
    let physics = TRIED[1].replace("series_share=0.5", "series_share=0");
    let kept_alone = format!("{},tried=\"kept\"}}", physics.trim_end_matches('}'));
    let fewer = run(workspace, "kept-alone", &["--set", &kept_alone, "--set", "annealing.steps=300"]);
    assert_eq!(fewer.counts.fact("grasps_tried"), kept);
    for sample in open(workspace, "kept-alone").iter(Selection::default()) {
        let trials = sample.expect("a sample").find::<GraspTrials>().expect("readable").expect("a channel of trials");
        let (run, of_all) = &first[&trials.sample];
        let of_kept =
            of_all.trials.iter().filter(|trial| run.grasps[trial.grasp as usize].verdict == GraspVerdict::Kept);
        let without_series = |mut trial: GraspTrial| {
            trial.series = None;
            trial.table.iter_mut().for_each(|table| table.series = None);
            trial
        };
        let pairs: Vec<_> = of_kept.cloned().map(without_series).zip(&trials.trials).collect();
        assert_eq!(pairs.len(), trials.trials.len());
        for (of_all, alone) in pairs.iter().filter(|(one, other)| !one.is_unconfirmed && !other.is_unconfirmed) {
            assert_eq!(of_all, *alone);
        }
        assert_eq!(trials.method.series_interval, None);
    }
}

/// Half as many negatives as positives in a run, rounded up, and one where there are no positives; all else as before.
fn fewer_failures_are_confirmed_on_demand(workspace: &Workspace, first: &Tried) {
    let few = TRIED[1].replace("failed_per_held=1000", "failed_per_held=0.5");
    run(workspace, "few", &["--set", &few, "--set", "annealing.steps=300"]);
    let mut unconfirmed = 0;
    for sample in open(workspace, "few").iter(Selection::default()) {
        let trials = sample.expect("a sample").find::<GraspTrials>().expect("readable").expect("a channel of trials");
        let (_, of_all) = &first[&trials.sample];
        let count = |of: &GraspTrials, label| of.trials.iter().filter(|trial| trial.label() == label).count();
        let [held, failed] = [GraspLabel::Held, GraspLabel::Failed].map(|label| count(of_all, label));
        assert_eq!(count(&trials, GraspLabel::Held), held);
        assert_eq!(
            count(&trials, GraspLabel::Failed),
            failed.min(held.div_ceil(2).max(1)),
            "{held} held, {failed} failed"
        );
        unconfirmed += count(&trials, GraspLabel::Unconfirmed);
        for (trial, whole) in trials.trials.iter().zip(&of_all.trials) {
            assert_eq!((&trial.outcome, trial.roll_outs), (&whole.outcome, whole.roll_outs));
            assert!(trial.label() == whole.label() || trial.is_unconfirmed, "{trial:?}");
        }
    }
    assert!(unconfirmed > 0, "no run has more failures than required");
}

/// MuJoCo from its own Python package, with its own contacts, agrees with nearly all our verdicts.
fn replays_in_plain_mujoco(dataset: &Path) {
    let replay = dataset.join("replay");
    let export = Program::on("export", dataset).args(["--to", "mujoco", "--limit", "8"]);
    assert!(export.option("--out", &replay).succeed().stdout.starts_with("8 grasps in "));
    let said = Program::python().arg(replay.join("replay.py")).succeed().stdout;
    let agreement = replay.join("agreement.json");
    let found = read_json(&agreement);
    let [replayed, sure, agreed] = ["replayed", "sure", "sure_agreed"].map(|key| found[key].as_u64().expect("a count"));
    assert!(replayed == 8 && sure >= 4 && sure - agreed <= 1, "{said}");
    assert!(read_report(dataset).contains("Replayed in plain MuJoCo 3.17.0"));
    // An agreement about another dataset does not count.
    let root = Manifest::read(&Folder::at(dataset)).expect("a dataset").root.hex();
    fs::write(&agreement, read_text(&agreement).replace(&root, &"0".repeat(64))).expect("written");
    assert!(Program::on("report", dataset).fail().stderr.contains("agreement.json"));
}

/// Meshes that an independent MuJoCo collides by their triangles: vertices as they are stored and in front, edges of 6
/// mm at most, each passed once in either direction.
#[test]
fn exported_meshes_have_short_edges() {
    let workspace = Workspace::new();
    workspace.write("block.off", off_of(&centred_block([0.02, 0.02, 0.04])));
    let hand = repository_path("scenes/parallel_gripper.xml");
    let job = format!(
        "product = \"grasps\"\nname = \"block\"\nseed = 1\nhand = {{ model = {hand:?} }}\n\
         objects = [{{ list = [\"block.off\"] }}]\n\
         grasps = {{ seeds = 1, sampler = \"antipodal\" }}\nantipodal = {{ pairs = 20, support = \"none\" }}\n\
         physics = {{ confirm = \"none\", perturbed_runs = 0, table = false, rollout_share = 0.0 }}\n{NO_SPLIT}"
    );
    workspace.write("job.toml", job);
    run(&workspace, "data", &[]);
    let (data, replay) = (workspace.path("data"), workspace.path("replay"));
    Program::on("export", &data).args(["--to", "mujoco", "--limit", "1"]).option("--out", &replay).succeed();

    let folder = Folder::at(&data);
    let row = &DatasetReader::open(&folder).expect("a dataset").assets().expect("the asset table").objects[0];
    let stored = Shapes::open(&folder).expect("the shapes").object(0).expect("an object").mesh;
    let file = replay.join(&row.name).join("object.obj");
    let Triangles { corners, triangles } = read_triangles(&file).expect("a mesh");
    let single = corners.iter().map(|corner| corner.coords.map(|part| part as f32));
    assert!(single.zip(&stored.vertices).all(|(found, stored)| found == Vector3::from(*stored)));
    let mut passed = BTreeSet::new();
    for [from, to] in triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]) {
        assert!((corners[from as usize] - corners[to as usize]).norm() < 0.006 + 1e-7);
        assert!(passed.insert([from, to]), "an edge is passed twice");
    }
    assert!(passed.iter().all(|[from, to]| passed.contains(&[*to, *from])), "it is not closed");
}

#[test]
fn a_dataset_tells_of_its_hand_its_objects_and_every_run() {
    let workspace = write_job();
    let out = plain();
    let reader = DatasetReader::open(&Folder::at(&out)).expect("a dataset");
    let manifest = reader.manifest();
    let assets = reader.assets().expect("the asset table");
    let shapes = Shapes::open(&Folder::at(&out)).expect("the shapes");
    let hand = shapes.hand().expect("the hand");
    assert_eq!((assets.hands.len(), hand.id), (1, assets.hands[0].object));
    assert!(hand.joints.len() == 8 && hand.solids.len() > 8);
    assert!(hand.solids.iter().all(|solid| !matches!(solid.shape, Shape::Mesh(_))));
    assert_eq!(shapes.objects(), 2);
    for (index, row) in assets.objects.iter().enumerate() {
        let object = shapes.object(index).expect("an object");
        assert_eq!(object.object, row.object);
        assert_eq!(row.facts["triangles"], object.mesh.triangles.len());
    }
    let mut seeds = BTreeSet::new();
    let mut kept = 0;
    for sample in reader.iter(Selection::default()) {
        let run = sample.expect("a sample").read::<GraspRun>().expect("a run");
        assert_eq!((run.asked_steps, run.hand.id, run.sample.item.0 < 2), (300, hand.id, true));
        assert!(!run.grasps.is_empty() && run.grasps.len() <= 20);
        seeds.insert(run.object_from_seed.to_rows().map(f64::to_bits));
        for grasp in &run.grasps {
            // The base carries the palm: one pose of it for every posture.
            let base_from_approach = grasp.object_from_base.inverse() * grasp.object_from_approach;
            let first = run.grasps[0].object_from_base.inverse() * run.grasps[0].object_from_approach;
            let apart = base_from_approach.to_rows().into_iter().zip(first.to_rows()).map(|(a, b)| (a - b).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-9);
            kept += u64::from(grasp.verdict == GraspVerdict::Kept);
        }
    }
    assert_eq!(seeds.len() as u64, manifest.counts.kept, "each run has its own seed");
    assert_eq!(manifest.counts.fact("grasps_kept"), kept);
    let inspected = Program::on("inspect", &out).read_json();
    assert_eq!((&inspected["runs"], &inspected["verdicts"]["kept"]), (&4.into(), &kept.into()));
    let page = |name: &str| {
        Program::on("report", &out).option("--out", workspace.path(name)).succeed();
        workspace.read(name)
    };
    let (one, two) = (page("one.html"), page("two.html"));
    assert_eq!(one, two, "two reports of one dataset have the same bytes");
    assert!(one.contains("id=\"types\"") && one.contains("box-01") && one.contains("data:image/png"));
    assert!(fs::metadata(out.join("preview.mcap")).is_ok_and(|file| file.len() > 10_000));
}

#[test]
#[ignore = "slow: needs rerun-sdk (100 MB)"]
fn rerun_draws_object_hand_and_contacts() {
    let printed = print_by_rerun(&plain().join("preview.mcap"));
    for entity in ["object_points", "hand_points", "contact_points"] {
        let kinds = ["Points3D:positions", "Points3D:colors"];
        let is_drawn = |chunk: &str| chunk.contains(entity) && kinds.iter().all(|kind| chunk.contains(kind));
        assert!(printed.split("Chunk(").any(is_drawn), "no points of {entity} in {printed}");
    }
}

/// Runs and the asset table agree about tables; with `keep.table` nothing changes but verdicts.
#[test]
fn objects_rest_and_hands_stay_above_the_table() {
    let workspace = write_job();
    let watched = run(&workspace, "watched", &["--set", "keep.table=true", "--threads", "1"]);
    let (plain_folder, other) = (plain(), open(&workspace, "watched"));
    let plain = DatasetReader::open(&Folder::at(&plain_folder)).expect("a dataset");
    let assets = plain.assets().expect("the asset table");
    assert_eq!(assets, other.assets().expect("the asset table"));
    let mut below = 0;
    for (one, two) in plain.iter(Selection::default()).zip(other.iter(Selection::default())) {
        let [one, two] = [one, two].map(|sample| sample.expect("a sample").read::<GraspRun>().expect("a run"));
        let row = assets.objects.iter().find(|row| row.object == one.sample.subject).expect("a row");
        let resting = row.resting().expect("readable").expect("poses").poses;
        assert!(resting.len() >= 2 && resting.len() == one.resting_poses as usize);
        assert_eq!(two.resting_poses, one.resting_poses);
        for (one, two) in one.grasps.iter().zip(&two.grasps) {
            let low = (0..resting.len()).all(|pose| !one.is_above_table(pose));
            let falls = one.verdict == GraspVerdict::Kept && low;
            let verdict = if falls { GraspVerdict::BelowTable } else { one.verdict };
            assert_eq!(*two, Grasp { verdict, ..one.clone() });
            below += u64::from(falls);
        }
    }
    assert_eq!(watched.counts.fact("grasps_below_table"), below);
    let inspected = Program::on("inspect", plain_folder).succeed().stdout;
    assert!(inspected.contains("the hand stays above the table for"), "{inspected}");
    let page = read_report(&workspace.path("watched"));
    assert!(page.contains("id=\"table\"") && page.contains("below table") && page.contains("resting poses"));
}

/// The table of objects gives the mass of one and the material of another; the third has a mass from its hull.
#[test]
#[ignore = "slow: make test-all"]
fn masses_of_the_table_are_those_of_trials() {
    let workspace = write_job();
    let table = "name,category,mass,mass_source,material,wall\ncan-01,can,0.25,scales,,\nmug-01,mug,,,ceramic,0.004\n";
    workspace.write("masses.csv", table);
    let objects = "objects=[{built_in=[\"can-01\",\"box-01\",\"mug-01\"],table=\"masses.csv\"}]";
    let physics = "physics={perturbed_runs=0,table=false,confirm=\"none\"}";
    let one = ["--set", "grasps.seeds=1", "--set", "annealing.steps=300"];
    let run = |out: &str, objects: &str, physics: &str| {
        run(&workspace, out, &[&one[..], &["--set", objects, "--set", physics]].concat())
    };
    let tried = run("tried", objects, physics);
    let reader = open(&workspace, "tried");
    let assets = reader.assets().expect("the asset table");
    let mut seen = BTreeSet::new();
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("a sample");
        let method = sample.find::<GraspTrials>().expect("readable").expect("trials").method;
        let row = assets.objects.iter().find(|row| row.object == sample.id.subject).expect("a row");
        let name = &row.name;
        let facts = row.object_facts().expect("sound facts").expect("what it weighs");
        match name.as_str() {
            "can-01" => assert_eq!((method.mass, method.mass_source.as_str()), (0.25, "scales")),
            "mug-01" => assert_eq!(method.mass_source, "ceramic, 2400 kg/m^3, walls of 4 mm"),
            _ => assert!(method.mass != 0.25 && method.mass_source.is_empty()),
        }
        // The row of the object has the mass and friction of its trials.
        assert_eq!(
            (facts.mass, facts.mass_from, facts.mass_source),
            (method.mass, method.mass_from.clone(), method.mass_source)
        );
        assert_eq!((facts.friction, facts.category.is_some()), (Some(method.friction), name != "box-01"));
        let solid = facts.solid.expect("a solid");
        let within = |axis: usize| row.facts["lower"][axis].as_f64().expect("a number") < solid.centre[axis];
        assert!((0..3).all(within) && solid.inertia.diagonal().iter().all(|moment| *moment > 0.0));
        let group = &row.facts["symmetry"]["group"];
        assert_eq!(
            group,
            match name.as_str() {
                "can-01" => "Dinf",
                "mug-01" => "C1",
                _ => "D2",
            }
        );
        seen.insert((name.clone(), method.mass_from));
    }
    let expected = [("box-01", "hull"), ("can-01", "table"), ("mug-01", "material")];
    assert_eq!(seen, expected.map(|(name, from)| (name.to_owned(), from.to_owned())).into_iter().collect());
    // The resolved job has the same values; the job itself gives the mass of all.
    let again = workspace.path("resolved");
    Program::run_job(workspace.path("tried/job.toml"), &again).succeed();
    assert_eq!(Manifest::read(&Folder::at(&again)).expect("a dataset").root, tried.root);
    let bare = "objects=[{built_in=[\"can-01\",\"box-01\",\"mug-01\"]}]";
    let plain = run("plain", bare, physics);
    assert_eq!(plain.classes[&NumberClass::Exact], tried.classes[&NumberClass::Exact]);
    assert!(plain.job != tried.job && plain.classes[&NumberClass::Physics] != tried.classes[&NumberClass::Physics]);
    let physics = "physics={perturbed_runs=0,table=false,confirm=\"none\",mass=0.3}";
    let given = run("given", objects, physics);
    let reader = open(&workspace, "given");
    let sample = reader.iter(Selection::default()).next().expect("samples").expect("a sample");
    let method = sample.find::<GraspTrials>().expect("readable").expect("trials").method;
    assert_eq!((method.mass, method.mass_from.as_str()), (0.3, "job"));
    assert!(given.job != tried.job);
    // If the job gives one mass to all, trials do not depend on other data about the objects.
    let bare = run("bare", bare, physics);
    assert_eq!((bare.job, bare.classes), (given.job, given.classes));
}

#[test]
fn damage_to_the_shapes_is_found() {
    let workspace = write_job();
    let out = workspace.path("data");
    copy_folder(plain(), &out);
    assert_intact(&out, FULL_CHECK);
    let path = out.join("shapes.mcap");
    flip_bit(&path);
    let report = verify(&Folder::at(&out), FULL_CHECK, |_| ()).expect("readable");
    assert!(report.problems.iter().all(|problem| problem.file == "shapes.mcap"), "{:?}", report.problems);
    assert!(!report.is_intact());
    fs::remove_file(&path).expect("removed");
    assert!(!verify(&Folder::at(&out), FULL_CHECK, |_| ()).expect("readable").is_intact());
    // The run repairs it: shards are kept, tables and shapes are made again.
    fs::remove_file(out.join("manifest.json")).expect("removed");
    run(&workspace, "data", &[]);
    assert_intact(&out, FULL_CHECK);
}

/// A grasp job over two objects, one of them a sheet as thin as a hair.
fn write_job_with_sheet(sampler: &str, keys: &str) -> Workspace {
    let workspace = Workspace::new();
    write_stl(&workspace.path("sheet.stl"), &block([0.0; 3], [0.1, 0.07, 5e-5]));
    let scene = repository_path("scenes/fetch_gripper.xml");
    let job = format!(
        "product = \"grasps\"\nseed = 5\n[hand]\nmodel = {scene:?}\n[grasps]\nseeds = 1\nsampler = \"{sampler}\"\n{keys}\n\
         [keep]\ntorsion = 0.002\n{NO_SPLIT}[[objects]]\nbuilt_in = [\"can-01\"]\n[[objects]]\nlist = [\"sheet.stl\"]\n"
    );
    workspace.write("job.toml", job);
    workspace
}

#[test]
#[ignore = "slow: makes several datasets"]
fn an_object_without_a_solid_is_refused_before_the_run_and_the_others_are_made() {
    for (sampler, keys) in [
        ("annealing", "[annealing]\nsteps = 300\nmax_failures = 300"),
        ("uniform", "[uniform]\ngrasps = 3\nposes = \"any\""),
        ("antipodal", "[antipodal]\npairs = 100\nbest = 2"),
        ("approach", "[approach]\ndraws = 300\nbest = 2"),
    ] {
        let workspace = write_job_with_sheet(sampler, keys);
        let said = workspace.run_job("job", "data").expect_code(3).stdout;
        for words in ["sheet.stl: no solid inside: it is about 49.9", "make it at least 0.391 mm thick"] {
            assert!(said.contains(words), "{sampler}: {said}");
        }
        let assets = read_json(workspace.path("data/assets.json"));
        assert_eq!(assets["objects"].as_array().map(Vec::len), Some(1), "{assets}");
        assert_eq!(assets["refused"][0]["reason"], "no_solid", "{assets}");
        assert_intact(workspace.path("data"), FULL_CHECK);
        let job = workspace.path("job.toml");
        let told = Program::on("estimate", &job).arg("--json").expect_code(3).json::<serde_json::Value>();
        assert_eq!(told["refused_meshes"], 1);
        // Alone it makes no job.
        let said = Program::on("estimate", &job).set(["objects=[{list=[\"sheet.stl\"]}]"]).expect_code(2).stderr;
        assert!(said.contains("no solid inside"), "{said}");
    }
}

/// A job over a can and a mesh of two parts that nothing joins: a block and, 30 mm above it, a slab.
fn write_job_in_parts(product: &str, bodies: &str) -> Workspace {
    let workspace = Workspace::new();
    let mut parts = block([0.0; 3], [0.05, 0.04, 0.04]);
    let above = block([0.0, 0.0, 0.07], [0.05, 0.04, 0.08]);
    let first = parts.vertices.len() as u32;
    parts.vertices.extend(above.vertices);
    parts.triangles.extend(above.triangles.iter().map(|face| face.map(|vertex| vertex + first)));
    write_stl(&workspace.path("parts.stl"), &parts);
    let hand = if product == "grasps" {
        let scene = repository_path("scenes/fetch_gripper.xml");
        format!(
            "[hand]\nmodel = {scene:?}\n[grasps]\nseeds = 1\nsampler = \"antipodal\"\n[antipodal]\npairs = 200\nbest = 2\n"
        )
    } else {
        "views = { even = 2 }\n".to_owned()
    };
    let job = format!(
        "product = \"{product}\"\nseed = 5\n{hand}{NO_SPLIT}[[objects]]\nbuilt_in = [\"can-01\"]\n\
         [[objects]]\nlist = [\"parts.stl\"]\n{bodies}"
    );
    workspace.write("job.toml", job);
    workspace
}

#[test]
fn loose_parts_are_refused_for_grasps_unless_the_job_joins_them() {
    let workspace = write_job_in_parts("grasps", "");
    let said_apart = workspace.run_job("job", "data").expect_code(3).stdout;
    let said = &said_apart;
    for words in ["parts.stl: has 2 separate parts: the nearest two are 30.0 mm apart", "set bodies = \"join\""] {
        assert!(said.contains(words), "{said}");
    }
    let assets = read_json(workspace.path("data/assets.json"));
    assert_eq!(assets["refused"][0]["reason"], "loose_parts", "{assets}");
    assert_intact(workspace.path("data"), FULL_CHECK);
    // The same mesh, joined by its entry, makes grasps; the job has that entry, also after it is resolved.
    let joined = write_job_in_parts("grasps", "bodies = \"join\"\n");
    let said = joined.run_job("job", "data").succeed().stdout;
    assert!(said.contains("its 2 loose parts count as one body, as set in the job"), "{said}");
    let assets = read_json(joined.path("data/assets.json"));
    let row = assets["objects"].as_array().expect("rows").iter().find(|row| row["name"] == "parts").expect("the parts");
    assert_eq!(row["loose"]["parts"], 2, "{row}");
    let gap = row["loose"]["gap"].as_f64().expect("a gap");
    assert!((gap - 0.03).abs() < 1e-6, "{gap}");
    let again = joined.path("again");
    Program::run_job(joined.path("data/job.toml"), &again).succeed();
    assert_eq!(
        Manifest::read(&Folder::at(&again)).expect("a dataset").root,
        Manifest::read(&Folder::at(joined.path("data"))).expect("one").root
    );
    // The parts are several objects: the command of the remedy writes a mesh of each, and grasps are made of these.
    let mesh = workspace.path("parts.stl");
    let split = |out: &str| Program::on("meshes", "split").arg(&mesh).option("--out", workspace.path(out));
    assert!(said_apart.contains("`graspmill meshes split FILE --out DIR`"), "{said_apart}");
    let told = split("apart").succeed().stdout;
    assert!(told.starts_with("2 meshes in ") && told.ends_with("in metres: unit = \"m\" in a job\n"), "{told}");
    let job =
        read_text(workspace.path("job.toml")).replace("list = [\"parts.stl\"]", "folder = \"apart\"\nunit = \"m\"");
    workspace.write("job.toml", job);
    workspace.run_job("job", "data-apart").succeed();
    let assets = read_json(workspace.path("data-apart/assets.json"));
    let volume = |name: &str| {
        let row = assets["objects"].as_array().expect("rows").iter().find(|row| row["name"] == name);
        row.expect("a part")["volume"].as_f64().expect("a volume")
    };
    // Volumes of the two blocks [m^3].
    for (name, expected) in [("parts-1", 0.05 * 0.04 * 0.04), ("parts-2", 0.05 * 0.04 * 0.01)] {
        assert!((volume(name) - expected).abs() < 1e-9, "{name}: {}", volume(name));
    }
    // Nothing is overwritten, and a part has nothing to split.
    assert!(split("apart").expect_code(2).stderr.contains("apart"));
    let part = Program::on("meshes", "split").arg(workspace.path("apart/parts-1.ply"));
    let told = part.option("--out", workspace.path("parts")).expect_code(2).stderr;
    assert!(told.contains("there is nothing to split") && !workspace.path("parts").exists(), "{told}");
    // Completion takes it as before, with a note.
    let pairs = write_job_in_parts("completion", "");
    let said = pairs.run_job("job", "data").succeed().stdout;
    assert!(said.contains("2 loose parts that nothing joins"), "{said}");
    let told = Program::on("meshes", "check").arg(pairs.path("parts.stl")).succeed().stdout;
    assert!(told.contains("2 loose parts that nothing joins"), "{told}");
}

#[test]
fn a_completion_job_takes_an_object_without_a_solid() {
    let workspace = Workspace::new();
    write_stl(&workspace.path("sheet.stl"), &block([0.0; 3], [0.1, 0.07, 5e-5]));
    workspace.write("job.toml", format!("views = {{ even = 3 }}\n{NO_SPLIT}[[objects]]\nlist = [\"sheet.stl\"]\n"));
    workspace.run_job("job", "data").succeed();
}

/// A job over tiny objects, whose distance grids take seconds.
fn write_tiny_job() -> Workspace {
    let workspace = Workspace::new();
    let tiny: Vec<String> = (0..4).map(|index| format!("tiny-{index}.stl")).collect();
    for (index, name) in tiny.iter().enumerate() {
        write_stl(&workspace.path(name), &round(40, |theta, _| 0.003 + 1e-4 * (index as f64 * theta).sin()));
    }
    let job = format!(
        "product = \"grasps\"\n{}[[objects]]\nlist = {tiny:?}\n[grasps]\nseeds = 1\n[annealing]\nsteps = 300\n{NO_SPLIT}",
        barrett_line()
    );
    workspace.write("job.toml", job);
    workspace
}

#[test]
fn a_wish_to_stop_is_heard_while_an_object_is_prepared() {
    let workspace = write_tiny_job();
    let text = JobText::open(&workspace.path("job.toml"), &[]).expect("a job file");
    let parallelism = Parallelism::available();
    let context = RunContext::quiet(&parallelism);
    let job = OpenJob::open(&text, &JobContext::default(), &context).expect("a job").job;
    let opening = Opening { seed: job.seed, level: parallelism.level, splits: None };
    let work = job.work.open(opening).expect("a hand");
    let mut producer = work.producer().expect("a producer");
    let cancel = Cancel::new();
    cancel.cancel();
    let heard = producer.load(0, &cancel);
    assert!(matches!(heard, Err(ProduceError::Cancelled(_))), "{heard:?}");
    assert!(matches!(RunError::from(heard.expect_err("a wish")), RunError::Interrupted));
}

#[test]
fn signals_end_a_run_that_prepares_an_object() {
    for signal in ["TERM", "INT", "USR1"] {
        let workspace = write_tiny_job();
        let out = workspace.path("data");
        let mut run = workspace.run_job("job", "data").option("--threads", "1").start();
        // The folder is there once the meshes have been read; the first object is prepared next.
        while !out.exists() {
            assert!(run.try_wait().expect("a state").is_none(), "the run ended before it began");
            thread::sleep(Duration::from_millis(10));
        }
        thread::sleep(Duration::from_millis(100));
        Program::of_system("kill").option("-s", signal).arg(run.id().to_string()).succeed();
        assert_eq!(run.wait().expect("an end").code(), Some(75), "{signal}");
        assert!(!out.join("manifest.json").exists(), "{signal}");
    }
}
