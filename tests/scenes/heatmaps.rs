//! Heatmaps of scenes from the job file to the reader: another program makes every row again, the three states are
//! those of the trials, a forbidden grasp is background, threads and tasks change nothing, and mistakes are reported
//! with their keys.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use graspmill::{
    files::Folder,
    format::{
        HeatmapFacts, HeatmapLabel, PickState, SceneHeatmap,
        dataset::{DatasetReader, Fate},
    },
    ids::SampleId,
};
use serde_json::Value;

use super::{
    alike::{make_alike, make_scalar},
    picks::{candidates, samples, trials},
};
use crate::support::{
    files::repository_path,
    jobs::NO_SPLIT,
    program::{Program, print_root},
    robots::GRIPPER,
    workspace::Workspace,
};

/// Shallow bins of three of four shapes, in two splits.
const BINS: &str = "product = \"scenes\"\nseed = 7\nmode = \"bin\"\ncount = 3\ncontainer = { inner_size = [0.4, 0.4, 0.06] }\n\
     scenes = { training = 2, holdout = 1 }\n[[objects]]\n\
     built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\"]\n";

/// Cameras above, and one that sees nothing.
const CAMERAS: &str = "{ shell = { radius = [0.45, 0.6], polar_deg = [0, 40] }, views = 3, width = 320, height = 240, fx = 300.0 },\n\
     { overhead = { height = 0.5 }, width = 320, height = 240, fx = 300.0 },\n\
     { poses = [[0.0, 0.0, 0.6, 1.0, 0.0, 0.0, 0.0]], width = 64, height = 64, fx = 40.0 }";

fn views_job(cameras: &str) -> String {
    format!(
        "product = \"views\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[views]\ncameras = [{cameras}]\nmin_pixels = 50\n\
         [sensor]\nprofile = \"kinect-v1\"\n"
    )
}

/// Grasps of a gripper on three of the four shapes: the cup has none.
fn grasps_job() -> String {
    format!(
        "product = \"grasps\"\nseed = 7\n[hand]\nmodel = {:?}\n[[objects]]\n\
         built_in = [\"bottle-01\", \"box-01\", \"can-01\"]\n[grasps]\nseeds = 2\nsampler = \"antipodal\"\n\
         [antipodal]\nbest = 5\n[keep]\ntorsion = 0.002\n{NO_SPLIT}",
        repository_path(GRIPPER)
    )
}

fn picks_job(picks: &str) -> String {
    format!(
        "product = \"picks\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[grasps]\ndataset = \"grasps\"\n[hand]\nmodel = {:?}\n\
         [picks]\ncandidates = 200\n{picks}\n",
        repository_path(GRIPPER)
    )
}

pub(super) fn heatmaps_job(keys: &str) -> String {
    format!(
        "product = \"heatmaps\"\nseed = 3\n[views]\ndataset = \"views\"\n[picks]\ndataset = \"picks\"\n[hand]\nmodel = {:?}\n\
         [heatmaps]\nmax_angle = 0.9\n{keys}\n[patches]\nside = 40\n[shards]\nsamples = 4\n",
        repository_path(GRIPPER)
    )
}

/// Jobs of scenes, views, grasps, and picks with four trials of each body.
pub(super) fn input_jobs() -> Vec<(&'static str, String)> {
    let scenes = format!("{BINS}{NO_SPLIT}");
    vec![
        ("scenes", scenes),
        ("views", views_job(CAMERAS)),
        ("grasps", grasps_job()),
        ("picks", picks_job("trials = 4")),
    ]
}

/// A workspace with the datasets of [`input_jobs`].
pub(super) fn with_inputs() -> Workspace {
    Workspace::copy_of(&Workspace::with_datasets(&input_jobs()))
}

fn heatmaps(folder: &Path) -> Vec<SceneHeatmap> {
    samples(folder).iter().map(|sample| sample.read::<SceneHeatmap>().expect("a heatmap")).collect()
}

/// State of each free candidate by its trial, and every forbidden candidate: by scene and number of the body, and index.
type States = (BTreeMap<(SampleId, u32), PickState>, BTreeSet<(SampleId, u32)>);

fn states(picks: &Path, has_trials: bool) -> States {
    let (mut free, mut forbidden) = (BTreeMap::new(), BTreeSet::new());
    for sample in samples(picks) {
        let record = candidates(&sample);
        for (index, candidate) in (0..).zip(&record.candidates) {
            if candidate.is_free() {
                free.insert((record.sample, index), PickState::Untried);
            } else {
                forbidden.insert((record.sample, index));
            }
        }
        let tried = if has_trials { trials(&sample).trials } else { Vec::new() };
        for trial in tried {
            let state = if trial.verdict.is_held() { PickState::Held } else { PickState::Failed };
            free.insert((record.sample, trial.candidate), state);
        }
    }
    (free, forbidden)
}

#[test]
fn threads_and_tasks_change_nothing_and_rejected_views_have_no_heatmap() {
    let workspace = with_inputs();
    let two = make_alike(&workspace, &heatmaps_job(""), "1000");
    assert_eq!(print_root(&two), print_root(make_scalar(&workspace)));

    // As many images as views, of their splits, under their names.
    let [reader, views] =
        [&two, &workspace.path("views")].map(|folder| DatasetReader::open(&Folder::at(folder)).expect("a dataset"));
    assert_eq!(reader.manifest().counts.samples, 3 * 5);
    let rows = |reader: &DatasetReader| {
        let all = (0..reader.manifest().shards.len()).flat_map(|shard| reader.ledger(shard).expect("a ledger").rows);
        all.collect::<Vec<_>>()
    };
    for (row, view) in rows(&reader).into_iter().zip(rows(&views)) {
        assert_eq!((row.sample, reader.split(row.index)), (view.sample, views.split(view.index)));
        match (&row.fate, &view.fate) {
            (Fate::Kept(_), Fate::Kept(_)) => assert!(HeatmapFacts::from(&row.facts).bodies == 3),
            (Fate::Rejected { reason, .. }, Fate::Rejected { .. }) => assert_eq!(reason, "no_view"),
            fates => panic!("{fates:?}"),
        }
    }
    assert_eq!(reader.manifest().counts.kept, 3 * 4);

    let inspected = Program::on("inspect", &two).succeed().text();
    for words in ["12 of 15 images kept", "free, held", "forbidden by neighbour", "approach, pad_left, pad_right"] {
        assert!(inspected.contains(words), "{words}: {inspected}");
    }
    Program::on("report", &two).succeed();
    let page = workspace.read("two/report.html");
    assert!(page.contains("A forbidden grasp is background") && page.contains("patches of a grasp"));
    assert!(two.join("preview.mcap").exists());
    let estimated = Program::on("estimate", workspace.path("two.toml")).succeed().text();
    assert!(estimated.contains("15 views of 3 scenes") && estimated.contains("root of their trials"), "{estimated}");
}

/// NumPy makes every row again from scenes, views and picks, MuJoCo gives the positions of the hand's points, and
/// Embree sees the same depth.
#[test]
fn another_program_makes_every_row_anew() {
    let workspace = with_inputs();
    workspace.make_dataset("heatmaps", &heatmaps_job(""), &[]);
    let folders = ["heatmaps", "scenes", "views", "picks"].map(|name| workspace.path(name));
    let program = folders.iter().fold(Program::python().arg("tests/peers/heatmaps.py"), |program, at| program.arg(at));
    let program = program.arg(repository_path(GRIPPER)).env("PYTHONPATH", repository_path("python"));
    let found: Value = program.succeed().json();
    let number = |name: &str| found[name].as_f64().expect("a number");
    assert_eq!(number("images"), 12.0, "{found}");
    for name in ["held", "failed", "untried", "forbidden", "patches", "background"] {
        assert!(number(name) > 0.0, "{name}: {found}");
    }
    assert!(number("background") >= 100.0 && number("visible") < number("points"), "{found}");
    assert!(number("worst_point") < 1e-9 && number("ties") == 0.0, "{found}");
    assert!(number("depth_missing") == 0.0 && number("worst_depth") < 6e-5 && number("depth_pixels") > 1e5, "{found}");
    println!("{found}");
}

#[test]
fn states_are_those_of_trials_and_a_forbidden_grasp_is_background_in_all() {
    let workspace = with_inputs();
    let made = workspace.make_dataset("heatmaps", &heatmaps_job(""), &["heatmaps.max_angle=3.1415"]);
    let (free, forbidden) = states(&workspace.path("picks"), true);
    let body = |heatmap: &SceneHeatmap, body: u32| {
        SampleId::of_object(heatmap.sample.subject, graspmill::ids::ItemId(body - 1))
    };
    let mut counted = HeatmapFacts::default();
    for heatmap in heatmaps(&made) {
        // From all around every free grasp of the scene is a row, and every forbidden one background.
        let of_scene = |key: &&(SampleId, u32)| key.0.subject == heatmap.sample.subject;
        let rows = heatmap.grasps.iter().map(|grasp| ((body(&heatmap, grasp.body), grasp.candidate), grasp.state));
        let expected = free.iter().filter(|(key, _)| of_scene(key)).map(|(key, state)| (*key, *state));
        assert!(rows.eq(expected), "{}", heatmap.sample);
        let stopped = heatmap.forbidden.iter().map(|grasp| (body(&heatmap, grasp.body), grasp.candidate));
        assert!(stopped.eq(forbidden.iter().filter(of_scene).copied()), "{}", heatmap.sample);
        // No map has a label in the pixel of a forbidden palm, unless another grasp has a point there.
        let (maps, camera) = (heatmap.maps(), heatmap.camera);
        let points = heatmap.grasps.iter().flat_map(|grasp| &grasp.points);
        let taken: BTreeSet<[u32; 2]> = points.filter_map(|point| point.pixel_in(&camera)).collect();
        let pixels = (camera.width * camera.height) as usize;
        for [column, row] in heatmap.forbidden.iter().filter_map(|grasp| grasp.pixel_in(&camera)) {
            let at = (row * camera.width + column) as usize;
            let is_empty = (0..3).all(|map| maps[map * pixels + at] == 0.0);
            assert!(is_empty || taken.contains(&[column, row]), "{} {column} {row}", heatmap.sample);
        }
        let facts = HeatmapFacts::from_heatmap(&heatmap);
        assert_eq!(facts.other_types, 0);
        (0..3).for_each(|state| counted.states[state] += facts.states[state]);
        (0..4).for_each(|by| counted.forbidden[by] += facts.forbidden[by]);
        counted.patches += facts.patches;
    }
    assert!(counted.states.iter().all(|count| *count > 0), "{counted:?}");
    assert!(counted.forbidden.iter().sum::<u32>() >= 100, "{counted:?}");

    // Without trials nothing is known, and every free grasp is as good.
    workspace.make_dataset("untried", &picks_job("trials = 0"), &[]);
    let job = heatmaps_job("label = \"free\"").replace("\"picks\"", "\"untried\"");
    let by_free = workspace.make_dataset("free", &job, &["patches.metric=false", "heatmaps.depth_step=0"]);
    for heatmap in heatmaps(&by_free) {
        assert_eq!((heatmap.label, heatmap.trials, heatmap.size), (HeatmapLabel::Free, None, None));
        assert!(heatmap.grasps.iter().all(|grasp| grasp.state == PickState::Untried && grasp.value == -1.0));
    }
    assert!(!workspace.read("free/job.toml").contains("trials_root"));
}

#[test]
fn mistakes_of_heatmaps_are_said_with_key_and_remedy() {
    let workspace = with_inputs();
    let said = |text: &str| {
        let file = workspace.write("job.toml", text);
        let out = workspace.path("none");
        let said = Program::run_job(file, &out).expect_code(2).stderr;
        assert!(!out.join("manifest.json").exists(), "{text}");
        std::fs::remove_dir_all(&out).ok();
        said
    };
    let fine = heatmaps_job("label = \"free\"");
    // The same shapes in other scenes.
    workspace.make_dataset("others", &format!("{BINS}{NO_SPLIT}").replace("seed = 7", "seed = 6"), &[]);
    workspace.make_dataset("untried", &picks_job("trials = 0"), &[]);
    workspace.make_dataset("of-others", &picks_job("trials = 0").replace("\"scenes\"", "\"others\""), &[]);
    let root = |section: &str| {
        let named = format!("dataset = \"{section}\"");
        fine.replace(&named, &format!("{named}\nroot = \"{}\"", "0".repeat(64)))
    };
    let barrett = fine.replace("parallel_gripper", "barrett_bh8_280");
    for (text, expected) in [
        (fine.replace("dataset = \"views\"", "dataset = \"nowhere\""), ["views.dataset", "make one first"]),
        (fine.replace("dataset = \"picks\"", "dataset = \"nowhere\""), ["picks.dataset", "make one first"]),
        (fine.replace("dataset = \"picks\"", "dataset = \"views\""), ["picks.dataset", "not of picks"]),
        (fine.replace("[picks]\ndataset = \"picks\"\n", ""), ["picks.dataset", "make one first"]),
        (fine.replace("\"picks\"", "\"of-others\""), ["picks.dataset", "the same dataset of scenes"]),
        (root("views"), ["views.root", "remove `root` from the job"]),
        (root("picks"), ["picks.root", "remove `root` from the job"]),
        (barrett.clone(), ["heatmaps.tips", "distal_1_outer"]),
        (
            barrett.replace("\nlabel", "\ntips = [\"distal_1_outer\"]\nlabel"),
            ["hand.model", "as the job of the picks does"],
        ),
        (
            heatmaps_job("label = \"trial\"").replace("\"picks\"", "\"untried\""),
            ["heatmaps.label", "`heatmaps.label = \"free\"`"],
        ),
        (heatmaps_job("label = \"epsilon\""), ["heatmaps.label", "trial"]),
        (heatmaps_job("label = \"free\"\ntips = [\"thumb\"]"), ["heatmaps.tips", "pad_left"]),
        (heatmaps_job("label = \"free\"\ntips = [\"pad_left\", \"pad_left\"]"), ["heatmaps.tips", "twice"]),
        (heatmaps_job("label = \"free\"\ntypes = 0"), ["heatmaps.types", "1"]),
        (fine.replace("max_angle = 0.9", "max_angle = 4"), ["heatmaps.max_angle", "3.14"]),
        (fine.replace("side = 40", "side = 2"), ["patches.side", "4"]),
        (fine.replace("[patches]", "[grasps]\ndataset = \"grasps\"\n[patches]"), ["grasps", "`picks.dataset`"]),
    ] {
        let found = said(&text);
        assert!(expected.iter().all(|words| found.contains(words)), "{expected:?}\n{text}\n{found}");
    }
    // Other trials of the same picks.
    let pinned = heatmaps_job("")
        .replace("dataset = \"picks\"", &format!("dataset = \"picks\"\ntrials_root = \"{}\"", "0".repeat(64)));
    let found = said(&pinned);
    assert!(found.contains("picks.trials_root") && found.contains("remove `trials_root`"), "{found}");
}

#[test]
fn the_jobs_of_heatmaps_that_travel_with_the_source_are_jobs() {
    let workspace = Workspace::new();
    let made = |name: &str| workspace.path(name).display().to_string();
    let run = |name: &str, inputs: &[(&str, &str)]| {
        let datasets = inputs.iter().map(|(section, input)| format!("{section}.dataset={:?}", made(input)));
        Program::run_job(format!("jobs/{name}.toml"), workspace.path(name)).set(datasets)
    };
    run("scenes-quick", &[]).set(["scenes.training=2"]).succeed();
    run("views-quick", &[("scenes", "scenes-quick")]).succeed();
    run("clutter-grasps-quick", &[]).set(["grasps.seeds=1", "antipodal.best=5"]).succeed();
    let inputs = [("scenes", "scenes-quick"), ("grasps", "clutter-grasps-quick")];
    run("picks-quick", &inputs).set(["picks.candidates=60", "picks.trials=1"]).succeed();
    let inputs = [("views", "views-quick"), ("picks", "picks-quick")];
    run("heatmaps-quick", &inputs).succeed();
    let found = heatmaps(&workspace.path("heatmaps-quick"));
    assert_eq!(found.len(), 2 * 5);
    assert!(found.iter().map(|heatmap| heatmap.grasps.len()).sum::<usize>() > 0);
    // The hand of the scans' job is another one.
    assert!(run("ycb-heatmaps", &inputs).expect_code(2).stderr.contains("as the job of the picks does"));
    let hand = format!("hand.model={:?}", repository_path(GRIPPER).display().to_string());
    run("ycb-heatmaps", &inputs).set([hand]).succeed();
}
