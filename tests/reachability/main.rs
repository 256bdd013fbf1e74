//! Reachability datasets from the job file to the field: every verb, damage, resume, and bad input.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output, Stdio},
    thread,
    time::Duration,
};

use graspmill::{
    dataset::{DatasetReader, Selection, VerifyLevel, VerifyOptions, read_field, verify},
    geom::{EndEffector, METRES_PER_RADIAN, Pose, PoseLabel, Proof, World, rotation_from_rpy},
    ids::{Digest, Product},
    sim::RobotModel,
};
use serde_json::Value;

mod bad_input;
#[path = "../fetch/mod.rs"]
mod fetch;
mod looking;
mod misses;
mod on_sphere;
#[path = "../python/mod.rs"]
mod python;

use fetch::ARM;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// A folder with a robot and a job: 3 x 3 x 4 positions, 2 x 4 x 4 orientations.
struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = Self(tempfile::tempdir().expect("a temporary folder"));
        fs::copy(Path::new(ROOT).join("scenes/fetch.xml"), place.path("fetch.xml")).expect("the robot is copied");
        fs::write(place.path("job.toml"), place.job()).expect("a job file");
        place
    }

    fn job(&self) -> String {
        format!(
            "product = \"reachability\"\nname = \"small\"\nseed = 3\n[robot]\nscene = \"fetch.xml\"\njoints = {ARM:?}\n\
             target = \"wrist_roll_link\"\n[poses]\nx = {{ from = 0.4, to = 1.0, step = 0.2 }}\n\
             y = {{ from = -0.3, to = 0.4, step = 0.3 }}\nz = {{ from = 0.4, to = 1.2, step = 0.2 }}\n\
             roll = 2\npitch = 4\nyaw = 4\n[shards]\npositions = 7\n"
        )
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, out: &str, more: &[&str]) -> PathBuf {
        let out = self.path(out);
        let done = command(&["run"]).arg(self.path("job.toml")).arg("--out").arg(&out).args(more).output();
        let done = done.expect("graspmill starts");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        out
    }
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.args(arguments);
    command
}

fn on(verb: &[&str], folder: &Path) -> Output {
    command(verb).arg(folder).output().expect("graspmill starts")
}

fn json(verb: &[&str], folder: &Path) -> Value {
    let done = on(&[verb, &["--json"]].concat(), folder);
    assert!(done.status.success(), "{verb:?}: {}", String::from_utf8_lossy(&done.stderr));
    serde_json::from_slice(&done.stdout).expect("JSON on stdout")
}

/// All files of a dataset but what its run tells about itself: name and content.
fn files(folder: &Path) -> Vec<(String, Digest)> {
    let mut files = Vec::new();
    for place in [folder.to_owned(), folder.join("shards")] {
        for entry in fs::read_dir(place).expect("a folder") {
            let path = entry.expect("an entry").path();
            let name = path.strip_prefix(folder).expect("below").display().to_string();
            if path.is_file() && name != "notes.json" {
                files.push((name, Digest::of(&fs::read(path).expect("a file"))));
            }
        }
    }
    files.sort();
    files
}

fn root(folder: &Path) -> String {
    String::from_utf8(on(&["digest"], folder).stdout).expect("text").trim().to_owned()
}

#[test]
fn threads_and_folders_change_no_byte_and_shards_no_root() {
    let (place, elsewhere) = (Place::new(), Place::new());
    let first = place.run("first", &["--threads", "1"]);
    assert_eq!(files(&place.run("second", &["--threads", "2"])), files(&first));
    assert_eq!(files(&elsewhere.run("deeper", &["--threads", "2"])), files(&first));
    let other = place.run("other", &["--set", "shards.positions=36", "--set", "name=x"]);
    assert_eq!(root(&other), root(&first));
    assert_ne!(root(&place.run("thesis", &["--set", "field.profile=thesis"])), root(&first));
    let text = fs::read_to_string(place.path("fetch.xml")).expect("the robot");
    fs::write(place.path("fetch.xml"), text.replace("-2.16 2.16", "-1.16 1.16")).expect("another robot");
    assert_ne!(root(&place.run("robot", &[])), root(&first));
}

#[test]
fn a_dataset_goes_through_every_verb() {
    let place = Place::new();
    let data = place.run("data", &[]);
    let status = json(&["status"], &data);
    assert_eq!((status["state"].as_str(), status["shards_done"].as_u64()), (Some("complete"), Some(6)));
    fs::remove_file(place.path("job.toml")).expect("the job file is not needed any more");
    let verified = json(&["verify", "--regenerate", "9"], &data);
    assert_eq!((&verified["intact"], &verified["payloads"]), (&true.into(), &36.into()));
    assert_eq!(verified["regenerated"]["samples"], 9);
    assert_eq!(verified["regenerated"]["differences"], Value::Array(Vec::new()));
    let facts = json(&["inspect"], &data);
    assert_eq!((&facts["poses"], &facts["positions"]), (&1152.into(), &36.into()));
    assert_eq!((&facts["axes"][5]["unit"], &facts["axes"][5]["periodic"]), (&"rad".into(), &true.into()));
    assert_eq!((&facts["axes"][0]["unit"], &facts["axes"][0]["periodic"]), (&"m".into(), &false.into()));
    assert_eq!(
        (&facts["field"]["radian_weight"], &facts["field"]["unit"]),
        (&METRES_PER_RADIAN.into(), &"metres".into())
    );
    assert_eq!((&facts["solver"], &facts["collisions"]), (&"auto".into(), &"exact".into()));
    let labels = facts["labels"].as_object().expect("counts");
    assert_eq!(labels.values().filter_map(Value::as_u64).sum::<u64>(), 1152);
    assert!(labels["reachable"].as_u64() > Some(100) && labels["no_solution"].as_u64() > Some(100), "{labels:?}");
    let refused = on(&["export", "--to", "npy", "--out", "x"], &data);
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("npy") && !said.contains("panicked"), "{said}");
    fs::write(place.path("job.toml"), place.job()).expect("a job file");
    assert_eq!(json(&["estimate"], &place.path("job.toml"))["samples"], 36);
    let again =
        command(&["run"]).arg(place.path("job.toml")).arg("--out").arg(&data).output().expect("graspmill starts");
    let said = String::from_utf8_lossy(&again.stdout).into_owned();
    assert!(said.contains("nothing to do") && said.contains("1152 poses at 36 positions"), "{said}");
}

#[test]
fn a_killed_run_resumes_to_the_same_bytes() {
    let place = Place::new();
    // Enough to be killed in the middle of: 31,104 poses.
    let finer = ["--set", "poses.yaw=24", "--set", "poses.pitch=18", "--set", "shards.positions=1"];
    let whole = place.run("whole", &finer);
    let out = place.path("killed");
    for kill in 0..5 {
        let mut child = command(&["run", "--threads", "2", "--progress", "none"])
            .arg(place.path("job.toml"))
            .arg("--out")
            .arg(&out)
            .args(finer)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("graspmill starts");
        thread::sleep(Duration::from_millis(20 + 300 * kill));
        // On Unix this is SIGKILL: nothing is cleaned up.
        child.kill().expect("a kill");
        child.wait().expect("an end");
    }
    place.run("killed", &finer);
    assert_eq!(files(&out), files(&whole));
}

#[test]
fn what_is_stored_is_what_the_robot_does() {
    let place = Place::new();
    let data = place.run("data", &[]);
    let reader = DatasetReader::open(&data).expect("a dataset");
    assert_eq!(reader.manifest().product, Product::Reachability);
    assert!(reader.splits().objects.is_empty() && reader.split(graspmill::ids::SampleIndex(0)).is_none());
    let field = read_field(&data).expect("a field");
    let header = &field.header;
    assert_eq!(
        (header.robot.as_str(), header.target.as_str(), header.frame.as_str()),
        ("fetch", "wrist_roll_link", "world")
    );
    assert_eq!(header.grid.shape(), [3, 3, 4, 2, 4, 4]);
    assert_eq!(header.joints, ARM);
    assert_eq!(field.distances, header.distances(&field.labels));
    let robot = RobotModel::open(&place.path("fetch.xml")).expect("the robot");
    let (mut cell, mut reachable) = (0, 0);
    for sample in reader.iter(Selection::default()) {
        let block = sample.expect("a sample").block().expect("a block");
        for (place, label) in block.labels.iter().enumerate() {
            assert_eq!(field.labels[cell], *label);
            if let Some(witness) = block.witness(place) {
                let [x, y, z, roll, pitch, yaw] = header.grid.pose(cell);
                let wanted: Pose<World, EndEffector> =
                    Pose::new(rotation_from_rpy(roll, pitch, yaw), nalgebra::Vector3::new(x, y, z));
                let values: Vec<(&str, f64)> = ARM.into_iter().zip(witness.iter().copied()).collect();
                let found = robot.site_pose(&header.target, &values).expect("a pose");
                let off = wanted.to_rows().into_iter().zip(found.to_rows()).map(|(a, b)| (a - b).abs());
                assert!(off.fold(0.0, f64::max) < 1e-6, "cell {cell}");
                reachable += 1;
            }
            assert_eq!(*label == PoseLabel::Reachable, block.witness(place).is_some());
            cell += 1;
        }
    }
    assert_eq!(cell, header.grid.cells());
    let counts = reader.manifest().counts.poses.clone().expect("counts of poses");
    assert_eq!((counts.cells(), counts.of_label(PoseLabel::Reachable)), (cell as u64, reachable));
}

/// Labels, proofs and the joint values of reachable poses, cell by cell.
fn cells(folder: &Path) -> Vec<(PoseLabel, Proof, Option<Vec<f64>>)> {
    let mut cells = Vec::new();
    for sample in DatasetReader::open(folder).expect("a dataset").iter(Selection::default()) {
        let block = sample.expect("a sample").block().expect("a block");
        let each = block.labels.iter().zip(&block.proofs).enumerate();
        cells.extend(each.map(|(place, (label, proof))| (*label, *proof, block.witness(place).map(<[f64]>::to_vec))));
    }
    cells
}

/// MuJoCo's verdict on the primitive Fetch: nearly ours, and never said to be more than a search.
#[test]
fn mujocos_contacts_decide_where_a_job_says_so() {
    let place = Place::new();
    let finer = ["--set", "poses.pitch=8", "--set", "poses.yaw=8", "--threads"];
    let by_mujoco = [&["--set", "collisions=mujoco"][..], &finer].concat();
    let theirs = place.run("theirs", &[&by_mujoco[..], &["1"]].concat());
    assert_eq!(files(&place.run("again", &[&by_mujoco[..], &["2"]].concat())), files(&theirs));
    let ours = place.run("ours", &[&finer[..], &["2"]].concat());
    assert_eq!(json(&["inspect"], &theirs)["collisions"], "mujoco");
    assert_eq!(json(&["verify", "--regenerate", "5"], &theirs)["regenerated"]["samples"], 5);
    let manifest = DatasetReader::open(&theirs).expect("a dataset").manifest().clone();
    assert_eq!(manifest.platform["mujoco"], "3.17.0", "{:?}", manifest.platform);
    let robot = RobotModel::open(&place.path("fetch.xml")).expect("the robot");
    let mut worker = robot.contact_worker(&ARM, &std::collections::BTreeMap::new()).expect("a worker");
    let (mut ways, mut apart, mut differ) = (0, 0, 0);
    let (ours, theirs) = (cells(&ours), cells(&theirs));
    for ((label, _, way), (their_label, their_proof, their_way)) in ours.iter().zip(&theirs) {
        let proofs = match their_label {
            PoseLabel::NoSolution => &[Proof::Bound, Proof::IntervalEnds][..],
            PoseLabel::Colliding => &[Proof::Searched],
            PoseLabel::Reachable => &[Proof::Witness],
        };
        assert!(proofs.contains(their_proof), "{their_label:?} by {their_proof:?}");
        // Kinematics is the same.
        assert_eq!(*label == PoseLabel::NoSolution, *their_label == PoseLabel::NoSolution);
        assert!(their_way.iter().all(|way| worker.is_free(way)));
        if let Some(way) = way {
            ways += 1;
            apart += usize::from(!worker.is_free(way));
        }
        differ += usize::from(label != their_label);
    }
    println!("{ways} ways that are free by shapes; {apart} of them are not by MuJoCo; {differ} labels differ");
    assert!(ways > 1000 && apart * 1000 <= ways && differ * 1000 <= ours.len());
}

/// The poses of a grid in the torso's frame are those of the same grid beside it in the world's.
#[test]
fn poses_are_in_the_frame_that_a_job_names() {
    let place = Place::new();
    let world = place.run("world", &["--set", "robot.frame=world"]);
    assert_eq!(root(&place.run("unsaid", &[])), root(&world));
    let spans = |[x, y, z]: [f64; 3]| {
        [("x", 0.4 - x, 1.0 - x), ("y", -0.3 - y, 0.4 - y), ("z", 0.4 - z, 1.2 - z)].map(|(axis, from, to)| {
            format!("poses.{axis}={{from={from},to={to},step={}}}", if axis == "y" { 0.3 } else { 0.2 })
        })
    };
    let origin = [-0.086875, 0.0, 0.37743];
    let [x, y, z] = spans(origin);
    for collisions in ["exact", "mujoco", "none"] {
        let collide = format!("collisions={collisions}");
        let more = ["--set", &x, "--set", &y, "--set", &z, "--set", "robot.frame=torso_lift_link", "--set", &collide];
        let torso = place.run(&format!("torso {collisions}"), &more);
        let world = place.run(&format!("world {collisions}"), &["--set", &collide]);
        let header = read_field(&torso).expect("a field").header;
        assert_eq!(header.frame, "torso_lift_link");
        let (seen, plain) = (cells(&torso), cells(&world));
        let alike = seen.iter().zip(&plain).filter(|(one, other)| one.0 == other.0).count();
        assert!(seen.len() == plain.len() && alike * 100 >= 99 * seen.len(), "{alike} of {}", seen.len());
        let robot = RobotModel::open(&place.path("fetch.xml")).expect("the robot");
        for (cell, (_, _, way)) in seen.iter().enumerate() {
            let Some(way) = way else { continue };
            let values: Vec<(&str, f64)> = ARM.into_iter().zip(way.iter().copied()).collect();
            let found = robot.site_pose(&header.target, &values).expect("a pose");
            let wanted = nalgebra::Vector3::from_fn(|axis, _| header.grid.pose(cell)[axis] + origin[axis]);
            assert!((found.translation() - wanted).norm() < 1e-6, "cell {cell}");
        }
    }
    let wrong = |frame: &str| {
        let frame = format!("robot.frame={frame}");
        let done = command(&["run"]).arg(place.path("job.toml")).args(["--set", &frame, "--out", "x"]).output();
        let done = done.expect("graspmill starts");
        assert_eq!(done.status.code(), Some(2));
        String::from_utf8_lossy(&done.stderr).into_owned()
    };
    assert!(wrong("torso_lift_lnk").contains("did you mean `torso_lift_link`?"));
    assert!(wrong("forearm_roll_link").contains("is moved by joint \"shoulder_pan_joint\""));
}

/// Every byte of the field, and every forty-first of a shard.
#[test]
fn a_flipped_byte_is_found() {
    let place = Place::new();
    let data = place.run("data", &["--set", "shards.positions=18"]);
    let shard = DatasetReader::open(&data).expect("a dataset").manifest().shard_path(&data, 1);
    for (path, step, level) in
        [(data.join("field.mcap"), 17, VerifyLevel::Hashes), (shard.clone(), 41, VerifyLevel::Full)]
    {
        let whole = fs::read(&path).expect("a file");
        for place in (0..whole.len()).step_by(step) {
            let mut bytes = whole.clone();
            bytes[place] ^= 0x10;
            fs::write(&path, &bytes).expect("a damaged file");
            let options = VerifyOptions { level, partial_inside_complete: false, threads: 1 };
            let report = verify(&data, options, |_| {}).expect("a report");
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            assert!(report.problems.iter().any(|problem| problem.file.contains(&name)), "byte {place} of {name}");
        }
        fs::write(&path, &whole).expect("the whole file");
    }
    let mut bytes = fs::read(data.join("field.mcap")).expect("a field");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(data.join("field.mcap"), bytes).expect("a damaged field");
    let found = on(&["verify"], &data);
    let said = String::from_utf8_lossy(&found.stdout).into_owned();
    assert_eq!(found.status.code(), Some(4));
    assert!(said.contains("field.mcap") && said.contains("delete manifest.json"), "{said}");
    // The remedy.
    let before = root(&data);
    fs::remove_file(data.join("manifest.json")).expect("a manifest");
    place.run("data", &["--set", "shards.positions=18"]);
    assert_eq!((on(&["verify"], &data).status.code(), root(&data)), (Some(0), before));
}
