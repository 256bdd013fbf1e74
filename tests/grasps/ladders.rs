//! Graded labels from job file to Parquet and Python.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use graspmill::{
    files::Folder,
    format::{
        Channel, FailureReason, GraspLadders, GraspRun, HeatmapPatch, LadderLabel, LadderLevel, LevelResult,
        dataset::{DatasetReader, Selection},
    },
    words::FreeWays,
};

use crate::support::{
    files::{FULL_CHECK, assert_intact, repository_path},
    program::Program,
    workspace::Workspace,
};

/// The Python package, and the tables of the export, give what the records hold.
const COMPARISON: &str = r#"
import sys, numpy as np
sys.path.insert(0, sys.argv[3])
import graspmill, pyarrow.parquet as parquet
data = graspmill.Dataset(sys.argv[1], graspmill.GraspSample)
frame = graspmill.grasp_frame(data)
table = parquet.read_table(sys.argv[2] + "/grasps.parquet").to_pandas()
assert list(frame.columns) == list(table.columns), set(frame.columns) ^ set(table.columns)
first = list(frame.columns).index("graded_label")
def plain(value):
    if isinstance(value, (list, np.ndarray)):
        return [plain(part) for part in value]
    return None if value is None or repr(value) == "<NA>" or value != value else value
for name in frame.columns[first:]:
    for ours, theirs in zip(frame[name], table[name], strict=True):
        assert plain(ours) == plain(theirs), (name, ours, theirs)
labels = np.concatenate([run.graded_labels() for run in data])
assert labels.tolist() == [label or "" for label in map(plain, frame["graded_label"])]
strict = np.concatenate([run.graded_labels(1.0) for run in data])
success = np.concatenate([run.success for run in data])
assert ((strict == "held") == (success == 1)).all() and ((labels == "held") == (success >= 0.75)).all()
assert all(len(run.ladder) == run.message("ladder")["ladders"].__len__() for run in data)
assert sum(len(run.trial_contacts) for run in data) > 0
"#;

/// ACRONYM's layout and the replay in plain MuJoCo have the graded labels, not the verdicts of the search.
const EXPORTED_LABELS: &str = r#"
import glob, json, sys, numpy as np, h5py
sys.path.insert(0, sys.argv[4])
import graspmill
held, shares = {}, {}
for run in graspmill.Dataset(sys.argv[1], graspmill.GraspSample):
    subject = str(run.id.subject)
    labels, success = run.graded_labels(), run.success
    for row in run.message("ladder")["ladders"]:
        key = (subject, run.id.item, row["grasp"])
        held[key], shares[key] = labels[row["grasp"]] == "held", success[row["grasp"]]
seen = 0
for path in glob.glob(sys.argv[2] + "/grasps/*.h5"):
    with h5py.File(path) as file:
        flex = file["grasps/qualities/flex/object_in_gripper"]
        assert flex.attrs["from"] == b"ladder"
        own = file["grasps/qualities/graspmill"]
        name = file["object/id"][()].decode()
        for in_gripper, item, rank, share in zip(flex, own["item"], own["rank"], own["success"], strict=True):
            key = (name, item, rank)
            assert bool(in_gripper) == held[key] and (share == shares[key] or share != share and shares[key] != shares[key])
            seen += 1
replayed = 0
for path in glob.glob(sys.argv[3] + "/*/grasps.json"):
    with open(path) as file:
        told = json.load(file)
    for grasp in told["grasps"]:
        key = (told["object"], grasp["item"], grasp["grasp"])
        assert (grasp["expected"]["label"] == "held") == held[key]
        assert grasp["expected"]["success"] == (None if shares[key] != shares[key] else shares[key])
        replayed += 1
assert seen == replayed == len(held) > 0, (seen, replayed, len(held))
"#;

/// A gripper on a box and a mug: most grasps hold at every level, levels are those of a bisection, and blocked grasps have
/// no trial.
#[test]
fn graded_labels_are_stored_exported_and_read() {
    let workspace = Workspace::new();
    let hand = repository_path("scenes/panda_hand.xml");
    let job = format!(
        "product = \"grasps\"\nseed = 2\nhand = {{ model = \"{}\" }}\nobjects = [{{ built_in = [\"box-01\", \"mug-01\"] }}]\n\
         [grasps]\nseeds = 1\nsampler = \"antipodal\"\n[antipodal]\npairs = 300\nbest = 6\nsupport = \"table\"\n\
         [physics]\nlabels = \"ladder\"\n[split]\nvalidation_objects = 0\ntest_objects = 0\n",
        hand.display()
    );
    workspace.write("job.toml", job);
    workspace.run_job("job", "data").succeed();
    let path = workspace.path("data");
    assert_intact(&path, FULL_CHECK);
    let reader = DatasetReader::open(&Folder::at(&path)).expect("a dataset");
    assert_eq!(reader.manifest().channels(), [Channel::GRASP_RUN, Channel::GRASP_LADDERS]);
    let (mut tried, mut held) = (0, 0);
    for sample in reader.iter(Selection::default()) {
        let sample = sample.expect("readable");
        let (run, ladders) =
            (sample.read::<GraspRun>().expect("a run"), sample.read::<GraspLadders>().expect("ladders"));
        for ladder in &ladders.ladders {
            let grasp = &run.grasps[ladder.grasp as usize];
            let pose = ladder.resting_pose.map(|pose| pose as usize);
            assert_eq!(Some(ladder.obstacles), grasp.obstacles(pose));
            if ladder.levels.is_none() {
                assert_eq!(grasp.free_ways(pose), FreeWays::None);
                assert_eq!((ladder.label(), ladder.trials()), (LadderLabel::Blocked, 0));
                assert_eq!(ladder.reason(), Some(FailureReason::Blocked));
                continue;
            }
            assert!((1..=3).contains(&ladder.trials()));
            let nominal = ladder.level(LadderLevel::Nominal).and_then(LevelResult::trial).expect("tried");
            assert_eq!(nominal.reason.is_none(), nominal.outcome.verdict.is_held());
            if nominal.outcome.verdict.is_held() {
                assert!(nominal.outcome.farthest < ladders.method.lost[0] && nominal.rotation < ladders.method.lost[1]);
                assert!(nominal.touched && nominal.closed_links >= 2 && ladder.closed.is_some());
            }
        }
        tried += ladders.ladders.len();
        held += ladders.ladders.iter().filter(|ladder| ladder.label() == LadderLabel::Held).count();
    }
    assert!(tried >= 6 && 2 * held > tried, "{held} of {tried}");
    let out = workspace.path("tables");
    Program::on("export", &path).option("--to", "parquet").option("--out", &out).succeed();
    Program::python_lines(COMPARISON).arg(&path).arg(&out).arg(repository_path("python")).succeed();
    let [acronym, replay] = ["acronym", "mujoco"].map(|format| {
        let out = workspace.path(format);
        Program::on("export", &path).option("--to", format).option("--out", &out).succeed();
        out
    });
    let read = Program::python_lines(EXPORTED_LABELS).arg(&path).arg(&acronym).arg(&replay);
    read.arg(repository_path("python")).succeed();
}

/// Patches take graded labels: held and failed states have them, partial ones are known not to count.
#[test]
fn patches_have_the_graded_labels_of_their_grasps() {
    let workspace = Workspace::new();
    let hand = repository_path("scenes/barrett_bh8_280.xml");
    let grasps = format!(
        "product = \"grasps\"\nseed = 1\nhand = {{ model = {hand:?} }}\nobjects = [{{ built_in = [\"can-01\"] }}]\n\
         grasps = {{ seeds = 1, sampler = \"uniform\" }}\nuniform = {{ poses = \"any\" }}\nphysics = {{ labels = \"ladder\" }}\n\
         split = {{ validation_objects = 0, test_objects = 0 }}\n"
    );
    let data = workspace.make_dataset("data", &grasps, &[]);
    let patches = format!(
        "product = \"patches\"\nhand = {{ model = {hand:?} }}\ngrasps = {{ dataset = {data:?} }}\nrender = {{ colour = false }}\n"
    );
    let patches = workspace.make_dataset("patches", &patches, &[]);
    let reader = |path: &Path| DatasetReader::open(&Folder::at(path)).expect("a dataset");
    let mut graded = BTreeMap::new();
    for sample in reader(&data).iter(Selection::default()) {
        let sample = sample.expect("readable");
        for ladder in sample.read::<GraspLadders>().expect("ladders").ladders {
            graded.insert((sample.id.item.0, ladder.grasp), ladder.label());
        }
    }
    let mut labels = BTreeSet::new();
    for sample in reader(&patches).iter(Selection::default()) {
        let sample = sample.expect("readable");
        let patch = sample.read::<HeatmapPatch>().expect("patches");
        let label = graded[&(patch.run, patch.rank)];
        let expected = match label {
            LadderLabel::Held => -1.0,
            LadderLabel::Failed => 1.0,
            _ => 0.0,
        };
        assert_eq!(patch.value.to_bits(), f32::to_bits(expected), "{label:?}");
        labels.insert(label);
    }
    assert!(
        labels.contains(&LadderLabel::Held) && labels.len() > 1 && !labels.contains(&LadderLabel::Blocked),
        "{labels:?}"
    );
}

/// Keys of the other method of labels contradict this one, and its own key leaves jobs without it as they are.
#[test]
fn keys_of_agreement_contradict_a_ladder() {
    let workspace = Workspace::new();
    let hand = repository_path("scenes/panda_hand.xml");
    let job = format!(
        "product = \"grasps\"\nhand = {{ model = \"{}\" }}\nobjects = [{{ built_in = [\"box-01\"] }}]\n\
         [physics]\nlabels = \"ladder\"\nconfirm = \"none\"\n",
        hand.display()
    );
    workspace.write("job.toml", job);
    let error = workspace.run_job("job", "data").expect_code(2).stderr;
    assert!(error.contains("physics.confirm") && error.contains("physics.labels = \"ladder\""), "{error}");
}
