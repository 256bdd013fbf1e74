//! Picks from the job file to the reader: grasps among neighbours are those of the stored grasps and scenes, threads,
//! tasks and other objects change nothing, and mistakes are reported with their keys.

use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::TAU,
    path::Path,
};

use graspmill::{
    contact::ContactSurface,
    files::Folder,
    format::{
        GraspLabel, GraspRun, GraspTrials, PickCandidates, PickFacts, PickObstacle, PickPassage, PickTrials, Scene,
        SceneContainer,
        dataset::{DatasetReader, Fate, Sample, Selection},
        extras::Shapes,
    },
    geom::TriMesh,
    grasp::{HandPassage, HandSearch, PathObstacle, SceneObstacle, Surroundings},
    ids::{ItemId, ObjectId, SampleId},
    voxel::InsideTest,
    words::{PathStage, Split},
};
use nalgebra::{IsometryMatrix3, Point3, Quaternion, UnitQuaternion, Vector3};

use super::alike::{make_alike, make_scalar};
use crate::support::{
    files::repository_path,
    jobs::NO_SPLIT,
    program::Program,
    robots::{BARRETT, GRIPPER, open_hand},
    workspace::Workspace,
};

/// Bins of three of four shapes, in two splits.
const BINS: &str = "product = \"scenes\"\nseed = 5\nmode = \"bin\"\ncount = 3\ncontainer = { inner_size = [0.4, 0.4, 0.06] }\n\
                    scenes = { training = 2, holdout = 1 }\n[[objects]]\n\
                    built_in = [\"bottle-01\", \"box-01\", \"can-01\", \"cup-01\"]\n";

/// Grasps of a gripper on these shapes.
pub(super) fn grasps_job(shapes: &[&str], more: &str) -> String {
    format!(
        "product = \"grasps\"\nseed = 7\n[hand]\nmodel = {:?}\n[[objects]]\nbuilt_in = {shapes:?}\n[grasps]\nseeds = 2\n\
         sampler = \"antipodal\"\n[antipodal]\nbest = 5\n[keep]\ntorsion = 0.002\n{more}\n{NO_SPLIT}",
        repository_path(GRIPPER)
    )
}

/// Three of the four shapes: the cup has no grasp.
pub(super) const GRASPED: [&str; 3] = ["bottle-01", "box-01", "can-01"];

const PHYSICS: &str = "[physics]\nperturbed_runs = 1";

pub(super) fn picks_job(picks: &str) -> String {
    format!(
        "product = \"picks\"\nseed = 3\n[scenes]\ndataset = \"scenes\"\n[grasps]\ndataset = \"grasps\"\n[hand]\nmodel = {:?}\n\
         [picks]\ncandidates = 60\n{picks}\n[shards]\nsamples = 4\n",
        repository_path(GRIPPER)
    )
}

/// A workspace with scenes, and grasps that were tried or not, which are made once.
fn with_inputs(tried: bool) -> Workspace {
    let physics = if tried { PHYSICS } else { "" };
    let jobs = [("scenes", format!("{BINS}{NO_SPLIT}")), ("grasps", grasps_job(&GRASPED, physics))];
    Workspace::copy_of(&Workspace::with_datasets(&jobs))
}

fn reader(folder: &Path) -> DatasetReader {
    DatasetReader::open(&Folder::at(folder)).expect("a dataset")
}

pub(super) fn samples(folder: &Path) -> Vec<Sample> {
    reader(folder).iter(Selection::default()).map(|sample| sample.expect("readable")).collect()
}

pub(super) fn candidates(sample: &Sample) -> PickCandidates {
    sample.read::<PickCandidates>().expect("candidates")
}

pub(super) fn trials(sample: &Sample) -> PickTrials {
    sample.find::<PickTrials>().expect("readable").expect("stored")
}

/// Reason of each rejected sample.
fn rejects(folder: &Path) -> BTreeMap<SampleId, String> {
    let reader = reader(folder);
    let rows = (0..reader.manifest().shards.len()).flat_map(|shard| reader.ledger(shard).expect("a ledger").rows);
    let reason = |fate| match fate {
        Fate::Rejected { reason, .. } => Some(reason),
        Fate::Kept(_) => None,
    };
    rows.filter_map(|row| Some((row.sample, reason(row.fate)?))).collect()
}

/// Prints what the Python package reads of picks, with its own arithmetic.
const READ: &str = "\
import json, sys, graspmill, numpy as np
data = graspmill.Dataset(sys.argv[1], graspmill.PickSample)
names = {row['object'] for row in data.folder.objects()}
counts, held = np.zeros(5, int), 0
for sample in data:
    n = len(sample.runs)
    assert sample.world_from_base.shape == (n, 4, 4) and set(sample.objects) <= names
    assert len(sample.objects) == len(sample.world_from_object) == 3 and sample.object_id == sample.objects[sample.body - 1]
    assert (sample.free == (sample.stages == 0)).all() and ((sample.neighbours > 0) == (sample.verdicts == 4)).all()
    assert (sample.clearances[sample.free] > sample.margin - 2e-4).all()
    assert (sample.clearances[~sample.free] < sample.margin).all()
    ways = sample.free_ways
    assert (sample.free == np.isin(ways, ('posture', 'both'))).all() and (sample.free_opened == np.isin(ways, ('opened', 'both'))).all()
    assert np.isfinite(sample.closed_joints).all(1).tolist() == (ways != 'none').tolist()
    assert (sample.free_opened == (sample.stages_opened == 0)).all()
    assert ((sample.neighbours_opened > 0) == (sample.verdicts_opened == 4)).all()
    assert ((sample.clearances_opened > sample.margin - 2e-4) | ~sample.free_opened).all()
    assert sample.closed_joints.shape[1] == len(sample.joint_names) == 2 and sample.container[0] == 'bin'
    counts += np.bincount(sample.verdicts, minlength=5)
    for trial in sample.trials:
        held += trial.held
        assert sample.free[trial.candidate] and sample.body not in trial.moved and sample.body not in trial.touched
        assert not trial.held or (trial.raised >= 0.08 and len(set(trial.links)) >= 2 and trial.object_from_base.shape == (4, 4))
        assert set(trial.moved) == set(trial.lifted)
lost = ['free', 'lost_to_ground', 'lost_to_container', 'lost_to_own_object', 'lost_to_neighbour']
print(json.dumps([counts.tolist(), [int(data.column(name).sum()) for name in lost], held, int(data.column('held').sum())]))
";

fn payloads(folder: &Path) -> BTreeMap<SampleId, PickCandidates> {
    samples(folder).iter().map(|sample| (sample.id, candidates(sample))).collect()
}

#[test]
#[ignore = "slow: make test-all"]
fn other_objects_and_more_trials_change_nothing() {
    let workspace = with_inputs(true);
    let job = picks_job("trials = 2");
    let two = workspace.make_dataset("two", &job, &[]);
    let found = payloads(&two);

    // A fourth object of the grasps changes no other.
    workspace.make_dataset("grasps-of-four", &grasps_job(&["bottle-01", "box-01", "can-01", "cup-01"], PHYSICS), &[]);
    let more = job.replace("dataset = \"grasps\"", "dataset = \"grasps-of-four\"");
    let more = workspace.make_dataset("more", &more, &[]);
    let all = payloads(&more);
    assert_eq!(all.len(), 9);
    assert!(found.iter().all(|(sample, record)| all[sample] == *record));
    let tried = |folder: &Path| -> BTreeMap<SampleId, PickTrials> {
        samples(folder).iter().map(|sample| (sample.id, trials(sample))).collect()
    };
    let (few, many) = (tried(&two), tried(&more));
    assert!(few.iter().all(|(sample, record)| many[sample] == *record));
    assert!(few.values().map(|trials| trials.trials.len()).sum::<usize>() >= 4, "{few:?}");

    // One more trial of each body changes no other trial, and nothing exact.
    let three = workspace.make_dataset("three", &job, &["picks.trials=3"]);
    assert_eq!(payloads(&three), found);
    for (sample, record) in tried(&three) {
        let known = &few[&sample].trials;
        assert!(known.iter().all(|trial| record.trials.contains(trial)), "{sample:?}");
        assert!(record.trials.len() <= 3);
    }
}

#[test]
#[ignore = "slow: runs by threads, tasks and levels"]
fn threads_and_tasks_change_nothing() {
    let workspace = with_inputs(true);
    let job = picks_job("trials = 2");
    let two = make_alike(&workspace, &job, "1000");

    // Exact numbers are those of any machine.
    let scalar = make_scalar(&workspace);
    let found = payloads(&two);
    assert_eq!(found, payloads(&scalar));

    // A body without a stored grasp is rejected with its reason.
    let scenes: BTreeMap<ObjectId, Scene> = (samples(&workspace.path("scenes")).iter())
        .map(|sample| sample.read::<Scene>().expect("a scene"))
        .map(|scene| (scene.id(), scene))
        .collect();
    let grasped: BTreeSet<ObjectId> =
        samples(&workspace.path("grasps")).iter().map(|sample| sample.id.subject).collect();
    let rejected = rejects(&two);
    let bodies = scenes.iter().flat_map(|(id, scene)| {
        (0..).zip(&scene.bodies).map(|(item, body)| (SampleId::of_object(*id, ItemId(item)), body.object))
    });
    let bodies: BTreeMap<SampleId, ObjectId> = bodies.collect();
    assert_eq!(bodies.len(), 9);
    for (sample, object) in &bodies {
        let reason = rejected.get(sample).map(String::as_str);
        assert_eq!(reason, (!grasped.contains(object)).then_some("no_stored_grasp"), "{sample:?}");
    }
    assert!(!rejected.is_empty() && found.len() + rejected.len() == 9);
    // Splits are those of the scenes.
    let (of_scenes, picks) = (reader(&workspace.path("scenes")), reader(&two));
    let split_of: BTreeMap<ObjectId, Split> = (samples(&workspace.path("scenes")).iter())
        .map(|sample| (sample.read::<Scene>().expect("a scene").id(), of_scenes.split(sample.index).expect("a split")))
        .collect();
    for sample in samples(&two) {
        assert_eq!(picks.split(sample.index), Some(split_of[&sample.id.subject]));
    }

    let read: (Vec<u64>, Vec<u64>, u64, u64) =
        Program::python_lines(READ).arg(&two).env("PYTHONPATH", repository_path("python")).succeed().json();
    assert_eq!((&read.0, read.2), (&read.1, read.3));
    assert!(read.0[0] > 0 && read.0[1..].iter().sum::<u64>() > 0, "{read:?}");
    let inspected = Program::on("inspect", &two).succeed().text();
    assert!(inspected.contains("of 9 bodies kept") && inspected.contains("lost to container"), "{inspected}");
    Program::on("report", &two).succeed();
    let page = workspace.read("two/report.html");
    assert!(page.contains("Grasps by result") && page.contains("Trials by verdict"));
    assert!(two.join("preview.mcap").exists());
}

/// A scene as the filter takes it, out of the stored records alone.
fn surroundings(scene: &Scene, shapes: &BTreeMap<ObjectId, TriMesh>) -> Surroundings {
    let surface = |mesh: &TriMesh| ContactSurface::new(mesh, InsideTest::WindingNumber).expect("a surface").into();
    let SceneContainer::Bin { inner, wall, .. } = scene.container else { panic!("scenes in bins") };
    let container = surface(&TriMesh::open_box(inner, wall));
    let object = |body: &graspmill::format::SceneBody| SceneObstacle {
        surface: surface(&shapes[&body.object]),
        scene_from_obstacle: *body.world_from_object.isometry(),
    };
    Surroundings {
        container: Some(SceneObstacle { surface: container, scene_from_obstacle: IsometryMatrix3::identity() }),
        ground: -wall,
        objects: scene.bodies.iter().map(object).collect(),
    }
}

#[test]
fn every_row_follows_from_the_stored_scene_and_grasp() {
    let workspace = with_inputs(false);
    let picks = workspace.make_dataset("picks", &picks_job("trials = 0\nrolls = 8"), &[]);
    assert!(!reader(&picks).manifest().channels().iter().any(|channel| channel.topic == "/picks/trials"));
    let scenes: BTreeMap<ObjectId, Scene> = (samples(&workspace.path("scenes")).iter())
        .map(|sample| sample.read::<Scene>().expect("a scene"))
        .map(|scene| (scene.id(), scene))
        .collect();
    let runs: BTreeMap<(ObjectId, u32), GraspRun> = (samples(&workspace.path("grasps")).iter())
        .map(|sample| ((sample.id.subject, sample.id.item.0), sample.read::<GraspRun>().expect("a run")))
        .collect();
    let stored = Shapes::open(&Folder::at(&picks)).expect("shapes");
    let shapes = (0..stored.objects()).map(|index| stored.object(index).expect("an object"));
    let shapes: BTreeMap<ObjectId, TriMesh> = shapes.map(|shape| (shape.object, shape.mesh)).collect();
    let model = open_hand(GRIPPER);
    let line = model.hand().closing_line().expect("a gripper");
    let (bodies, _) = model.bodies().expect("its bodies");
    let mut passage = HandPassage::new(&HandSearch::new(model.hand(), &bodies).expect("a hand"), 0.002);
    let (mut seen, mut rotated) = (BTreeMap::new(), 0);
    for sample in samples(&picks) {
        let record = candidates(&sample);
        let scene = &scenes[&sample.id.subject];
        let body = sample.id.item.0 as usize;
        assert_eq!(record.object(), scene.bodies[body].object);
        assert_eq!(record.container, scene.container);
        let surroundings = surroundings(scene, &shapes);
        let kept: u32 = (runs.iter().filter(|((object, _), _)| *object == record.object()))
            .map(|(_, run)| run.kept().count() as u32)
            .sum();
        assert_eq!((record.stored, record.rolls), (kept, 8));
        assert_eq!(record.candidates.len(), 60.min(8 * kept as usize));
        for candidate in &record.candidates {
            let grasp = &runs[&(record.object(), candidate.run)].grasps[candidate.rank as usize];
            // About the closing line through the mean of the contacts, by a quaternion.
            let points = grasp.contacts.iter().map(|contact| Vector3::from(contact.point));
            let middle = Point3::from(points.sum::<Vector3<f64>>() / grasp.contacts.len() as f64);
            let base = grasp.object_from_base.isometry();
            let axis = (base.rotation * line).normalize();
            let (sin, cos) = (TAU * f64::from(candidate.direction) / 16.0).sin_cos();
            let by = UnitQuaternion::from_quaternion(Quaternion::from_parts(cos, axis * sin));
            let at = middle + by * (Point3::from(base.translation.vector) - middle);
            let rotation = by.to_rotation_matrix() * base.rotation;
            let world = scene.bodies[body].world_from_object;
            let expected = world.isometry() * IsometryMatrix3::from_parts(at.coords.into(), rotation);
            let found = candidate.world_from_base.isometry();
            assert!((found.to_homogeneous() - expected.to_homogeneous()).amax() < 1e-12, "{candidate:?}");
            rotated += usize::from(candidate.direction > 0);
            // The filter, applied again: the same to the bit where the pose is, and nearly the same everywhere.
            let object_from_base = world.isometry().inverse() * found;
            let closed = passage.close(&surroundings.objects[body].surface, &object_from_base, &grasp.posture);
            let again = passage.follow(&surroundings, body, &closed);
            for (again, way) in [(again.shaped, candidate.ways.shaped), (again.opened, candidate.ways.opened)] {
                let blocked = again.blocked.map(|(stage, by)| {
                    let by = match by {
                        PathObstacle::Ground => PickObstacle::Ground,
                        PathObstacle::Container => PickObstacle::Container,
                        PathObstacle::Target => PickObstacle::Own,
                        PathObstacle::Neighbour(index) => PickObstacle::Neighbour(index as u32 + 1),
                    };
                    (stage, by)
                });
                assert_eq!(way.blocked.map(|blocked| (blocked.stage, blocked.by)), blocked, "{candidate:?}");
                assert!((again.clearance - way.clearance).abs() < 1e-6, "{} {candidate:?}", again.clearance);
            }
            // Where it begins to close, and while it closes, the hand is the same on both ways.
            let is_common = |way: PickPassage| way.blocked.is_some_and(|blocked| blocked.stage == PathStage::Pregrasp);
            assert_eq!(is_common(candidate.ways.shaped), is_common(candidate.ways.opened), "{candidate:?}");
            let end = candidate.ways.shaped.blocked.map_or("free", |blocked| PickObstacle::NAMES[by_index(blocked.by)]);
            *seen.entry(end).or_insert(0) += 1;
        }
        let facts = PickFacts::from_candidates(&record, None, None);
        assert_eq!(facts.free + facts.lost.iter().sum::<u32>(), facts.candidates);
        assert!(facts.free_either >= facts.free.max(facts.free_opened), "{facts:?}");
        assert!(facts.free_either <= facts.free + facts.free_opened, "{facts:?}");
    }
    assert!(rotated > 100 && seen.len() >= 3 && seen.contains_key("free"), "{rotated} {seen:?}");
}

fn by_index(by: PickObstacle) -> usize {
    match by {
        PickObstacle::Ground => 0,
        PickObstacle::Container => 1,
        PickObstacle::Own => 2,
        PickObstacle::Neighbour(_) => 3,
    }
}

#[test]
#[ignore = "slow: grasps with trials"]
fn stored_grasps_are_taken_by_their_verdicts_and_labels() {
    let workspace = with_inputs(true);
    let runs: Vec<Sample> = samples(&workspace.path("grasps"));
    let count = |take: &str, sample: &Sample| -> usize {
        let (run, trials) =
            (sample.read::<GraspRun>().expect("a run"), sample.find::<GraspTrials>().expect("readable"));
        let trials = trials.expect("trials").trials;
        match take {
            "kept" => run.kept().count(),
            "closed" => run.grasps.iter().filter(|grasp| grasp.verdict.is_closed()).count(),
            "tried" => trials.len(),
            _ => trials.iter().filter(|trial| trial.label() == GraspLabel::Held).count(),
        }
    };
    for take in ["kept", "closed", "tried", "held"] {
        let job = picks_job(&format!("trials = 0\nrolls = 1\ngrasps = \"{take}\""));
        let picks = workspace.make_dataset(&format!("picks-{take}"), &job, &[]);
        let mut bodies = 0;
        for record in samples(&picks).iter().map(candidates) {
            let of = runs.iter().filter(|run| run.id.subject == record.object());
            let expected: usize = of.map(|run| count(take, run)).sum();
            assert_eq!((record.stored as usize, record.take.name()), (expected, take));
            // Without a rotation every candidate is a stored grasp.
            assert!(record.candidates.iter().all(|candidate| candidate.direction == 0));
            bodies += 1;
        }
        assert!(bodies > 0, "{take}");
    }
    // Without a choice, those that held.
    let picks = workspace.make_dataset("picks", &picks_job("trials = 0"), &[]);
    assert!(samples(&picks).iter().map(candidates).all(|record| record.take.name() == "held" && record.rolls == 16));
    assert!(workspace.read("picks/job.toml").contains("trials_root"));
}

#[test]
fn mistakes_of_picks_are_said_with_key_and_remedy() {
    let workspace = with_inputs(false);
    workspace.make_dataset("others", &grasps_job(&["bowl-01"], ""), &[]);
    let said = |text: &str| {
        let file = workspace.write("job.toml", text);
        let out = workspace.path("none");
        let said = Program::run_job(file, &out).expect_code(2).stderr;
        assert!(!out.join("manifest.json").exists(), "{text}");
        std::fs::remove_dir_all(&out).ok();
        said
    };
    let fine = picks_job("trials = 0");
    let barrett = fine.replace("parallel_gripper", "barrett_bh8_280");
    assert!(barrett.contains(BARRETT.trim_start_matches("scenes/")), "{barrett}");
    for (text, expected) in [
        (fine.replace("dataset = \"scenes\"", "dataset = \"nowhere\""), ["scenes.dataset", "make one first"]),
        (fine.replace("dataset = \"grasps\"", "dataset = \"nowhere\""), ["grasps.dataset", "make one first"]),
        (fine.replace("dataset = \"grasps\"", "dataset = \"scenes\""), ["grasps.dataset", "not of grasps"]),
        (fine.replace("dataset = \"grasps\"", "dataset = \"others\""), ["grasps.dataset", "the same `[[objects]]`"]),
        (barrett.clone(), ["hand.model", "name the hand's description"]),
        (barrett.replace("trials = 0", "trials = 0\nrolls = 4"), ["picks.rolls", "remove `picks.rolls`"]),
        (fine.replace("trials = 0", "grasps = \"held\""), ["picks.grasps", "`[physics]`"]),
        (fine.replace("trials = 0", "margin = 0.01"), ["picks.margin", "0.009"]),
        (fine.replace("trials = 0", "movable = \"some\""), ["picks.movable", "near"]),
        (fine.replace("trials = 0", "physics = 1"), ["picks.physics", "picks"]),
        (
            fine.replace("dataset = \"scenes\"", &format!("dataset = \"scenes\"\nroot = \"{}\"", "0".repeat(64))),
            ["scenes.root", "remove `root` from the job"],
        ),
        (
            fine.replace("dataset = \"grasps\"", &format!("dataset = \"grasps\"\nroot = \"{}\"", "0".repeat(64))),
            ["grasps.root", "remove `root` from the job"],
        ),
    ] {
        let found = said(&text);
        assert!(expected.iter().all(|words| found.contains(words)), "{expected:?}\n{found}");
    }
}
