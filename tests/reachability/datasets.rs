//! Datasets as such: the same bytes everywhere, every verb, the robot's poses, and damage.

use std::{collections::BTreeMap, fs, path::Path, time::Duration};

use graspmill::{
    files::Folder,
    format::{
        Product, ReachabilityBlock,
        dataset::{DatasetReader, Selection, VerifyLevel, VerifyOptions, verify},
        extras::read_field,
    },
    geom::{EndEffector, METRES_PER_RADIAN, Pose, PoseLabel, Proof, World},
    ids::SampleIndex,
};
use nalgebra::Vector3;
use serde_json::Value;

use super::{ORIENTATIONS, assert_regenerates, change_robot, run, small_job, write_job};
use crate::support::{
    files::{FULL_CHECK, digest_dataset, flip_bit},
    program::{Program, print_root},
    robots::{FETCH_ARM, FETCH_SITE, max_difference, open_robot},
};

#[test]
fn threads_and_folders_change_no_byte_and_shards_no_root() {
    let (workspace, elsewhere) = (write_job(ORIENTATIONS), write_job(ORIENTATIONS));
    let first = run(&workspace, "first", &["--threads", "1"]);
    assert_eq!(digest_dataset(run(&workspace, "second", &["--threads", "2"])), digest_dataset(&first));
    assert_eq!(digest_dataset(run(&elsewhere, "deeper", &["--threads", "2"])), digest_dataset(&first));
    let other = run(&workspace, "other", &["--set", "shards.positions=36", "--set", "name=x"]);
    assert_eq!(print_root(&other), print_root(&first));
    assert_ne!(print_root(run(&workspace, "thesis", &["--set", "field.profile=thesis"])), print_root(&first));
    change_robot(&workspace, "-2.16 2.16", "-1.16 1.16");
    assert_ne!(print_root(run(&workspace, "robot", &[])), print_root(&first));
}

#[test]
fn a_dataset_goes_through_every_verb() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &[]);
    let status = Program::on("status", &data).read_json();
    assert_eq!((status["state"].as_str(), status["shards_done"].as_u64()), (Some("complete"), Some(6)));
    fs::remove_file(workspace.path("job.toml")).expect("the job file is not needed any more");
    assert_eq!(assert_regenerates(&data, 9)["payloads"], 36);
    let facts = Program::on("inspect", &data).read_json();
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
    let said = Program::on("export", &data).args(["--to", "npy", "--out", "x"]).fail().stderr;
    assert!(said.contains("npy") && !said.contains("panicked"), "{said}");
    let job = workspace.write("job.toml", small_job(ORIENTATIONS));
    assert_eq!(Program::on("estimate", &job).read_json()["samples"], 36);
    let said = workspace.run_job("job", "data").finish().stdout;
    assert!(said.contains("nothing to do") && said.contains("poses are reachable"), "{said}");
}

#[test]
fn a_killed_run_resumes_to_the_same_bytes() {
    let workspace = write_job(ORIENTATIONS);
    // Enough to be killed in the middle of: 31,104 poses.
    let finer = ["--set", "poses.yaw=24", "--set", "poses.pitch=18", "--set", "shards.positions=1"];
    let whole = run(&workspace, "whole", &finer);
    for kill in 0..5 {
        let run = workspace.run_job("job", "killed").args(finer).option("--threads", "2");
        run.kill_after(Duration::from_millis(20 + 300 * kill));
    }
    assert_eq!(digest_dataset(run(&workspace, "killed", &finer)), digest_dataset(whole));
}

#[test]
fn what_is_stored_is_what_the_robot_does() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &[]);
    let reader = DatasetReader::open(&Folder::at(&data)).expect("a dataset");
    assert_eq!(reader.manifest().product, Product::REACHABILITY);
    assert!(reader.splits().objects.is_empty() && reader.split(SampleIndex(0)).is_none());
    let field = read_field(&Folder::at(&data)).expect("a field");
    let header = &field.header;
    assert_eq!((header.robot.as_str(), header.target.as_str(), header.frame.as_str()), ("fetch", FETCH_SITE, "world"));
    assert_eq!(header.grid.shape(), [3, 3, 4, 2, 4, 4]);
    assert_eq!(header.joints, FETCH_ARM);
    assert_eq!(field.distances, header.distances(&field.labels));
    let robot = open_robot(workspace.path("fetch.xml"));
    let (mut cell, mut reachable) = (0, 0);
    for sample in reader.iter(Selection::default()) {
        let block = sample.expect("a sample").read::<ReachabilityBlock>().expect("a block");
        for (index, label) in block.labels.iter().enumerate() {
            assert_eq!(field.labels[cell], *label);
            if let Some(witness) = block.witness(index) {
                let wanted = Pose::<World, EndEffector>::from_xyz_rpy(header.grid.pose(cell));
                let values: Vec<(&str, f64)> = FETCH_ARM.into_iter().zip(witness.iter().copied()).collect();
                let found = robot.target_pose(&header.target, &values).expect("a pose");
                assert!(max_difference(&wanted, &found) < 1e-6, "cell {cell}");
                reachable += 1;
            }
            assert_eq!(*label == PoseLabel::Reachable, block.witness(index).is_some());
            cell += 1;
        }
    }
    assert_eq!(cell, header.grid.cells());
    let counts = &reader.manifest().counts;
    let cells: u64 = PoseLabel::ALL.iter().map(|label| counts.fact(label.name())).sum();
    assert_eq!((cells, counts.fact(PoseLabel::Reachable.name())), (cell as u64, reachable));
}

/// Labels, proofs and joint values of reachable poses, cell by cell.
fn read_cells(folder: &Path) -> Vec<(PoseLabel, Proof, Option<Vec<f64>>)> {
    let mut cells = Vec::new();
    for sample in DatasetReader::open(&Folder::at(folder)).expect("a dataset").iter(Selection::default()) {
        let block = sample.expect("a sample").read::<ReachabilityBlock>().expect("a block");
        let each = block.labels.iter().zip(&block.proofs).enumerate();
        cells.extend(each.map(|(index, (label, proof))| (*label, *proof, block.witness(index).map(<[f64]>::to_vec))));
    }
    cells
}

/// MuJoCo's verdict on the primitive Fetch: nearly ours, and never called more than a search.
#[test]
fn mujocos_contacts_decide_where_a_job_says_so() {
    let workspace = write_job(ORIENTATIONS);
    let finer = ["--set", "poses.pitch=8", "--set", "poses.yaw=8", "--threads"];
    let by_mujoco = [&["--set", "collisions=mujoco"][..], &finer].concat();
    let theirs = run(&workspace, "theirs", &[&by_mujoco[..], &["1"]].concat());
    assert_eq!(digest_dataset(run(&workspace, "again", &[&by_mujoco[..], &["2"]].concat())), digest_dataset(&theirs));
    let ours = run(&workspace, "ours", &[&finer[..], &["2"]].concat());
    assert_eq!(Program::on("inspect", &theirs).read_json()["collisions"], "mujoco");
    assert_regenerates(&theirs, 5);
    let manifest = DatasetReader::open(&Folder::at(&theirs)).expect("a dataset").manifest().clone();
    assert_eq!(manifest.platform["mujoco"], "3.17.0", "{:?}", manifest.platform);
    let robot = open_robot(workspace.path("fetch.xml"));
    let mut worker = robot.contact_worker(&FETCH_ARM, &BTreeMap::new()).expect("a worker");
    let (mut solutions, mut apart, mut differ) = (0, 0, 0);
    let (ours, theirs) = (read_cells(&ours), read_cells(&theirs));
    for ((label, _, solution), (their_label, their_proof, their_solution)) in ours.iter().zip(&theirs) {
        let proofs = match their_label {
            PoseLabel::NoSolution => &[Proof::Bound, Proof::IntervalEnds][..],
            PoseLabel::Colliding => &[Proof::Searched],
            PoseLabel::Reachable => &[Proof::Witness],
        };
        assert!(proofs.contains(their_proof), "{their_label:?} by {their_proof:?}");
        // Kinematics is the same.
        assert_eq!(*label == PoseLabel::NoSolution, *their_label == PoseLabel::NoSolution);
        assert!(their_solution.iter().all(|solution| worker.is_free(solution)));
        if let Some(solution) = solution {
            solutions += 1;
            apart += usize::from(!worker.is_free(solution));
        }
        differ += usize::from(label != their_label);
    }
    println!("{solutions} ways that are free by shapes; {apart} of them are not by MuJoCo; {differ} labels differ");
    assert!(solutions > 1000 && apart * 1000 <= solutions && differ * 1000 <= ours.len());
}

/// The poses of a grid in the torso's frame are those of the same grid next to it in the world's.
#[test]
fn poses_are_in_the_frame_that_a_job_names() {
    let workspace = write_job(ORIENTATIONS);
    let world = run(&workspace, "world", &["--set", "robot.frame=world"]);
    assert_eq!(print_root(run(&workspace, "unsaid", &[])), print_root(&world));
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
        let torso = run(&workspace, &format!("torso {collisions}"), &more);
        let world = run(&workspace, &format!("world {collisions}"), &["--set", &collide]);
        let header = read_field(&Folder::at(&torso)).expect("a field").header;
        assert_eq!(header.frame, "torso_lift_link");
        let (seen, plain) = (read_cells(&torso), read_cells(&world));
        let alike = seen.iter().zip(&plain).filter(|(one, other)| one.0 == other.0).count();
        assert!(seen.len() == plain.len() && alike * 100 >= 99 * seen.len(), "{alike} of {}", seen.len());
        let robot = open_robot(workspace.path("fetch.xml"));
        for (cell, (_, _, solution)) in seen.iter().enumerate() {
            let Some(solution) = solution else { continue };
            let values: Vec<(&str, f64)> = FETCH_ARM.into_iter().zip(solution.iter().copied()).collect();
            let found = robot.target_pose(&header.target, &values).expect("a pose");
            let wanted = Vector3::from_fn(|axis, _| header.grid.pose(cell)[axis] + origin[axis]);
            assert!((found.translation() - wanted).norm() < 1e-6, "cell {cell}");
        }
    }
    let wrong = |frame: &str| workspace.run_job("job", "x").set([format!("robot.frame={frame}")]).expect_code(2).stderr;
    assert!(wrong("torso_lift_lnk").contains("did you mean `torso_lift_link`?"));
    assert!(wrong("forearm_roll_link").contains("is moved by joint \"shoulder_pan_joint\""));
}

/// Every byte of the field, and every forty-first of a shard.
#[test]
fn a_flipped_byte_is_found() {
    let workspace = write_job(ORIENTATIONS);
    let data = run(&workspace, "data", &["--set", "shards.positions=18"]);
    let shard = DatasetReader::open(&Folder::at(&data)).expect("a dataset").manifest().shard_path(&data, 1);
    for (path, step, level) in
        [(data.join("field.mcap"), 17, VerifyLevel::Hashes), (shard.clone(), 41, VerifyLevel::Full)]
    {
        let whole = fs::read(&path).expect("a file");
        for index in (0..whole.len()).step_by(step) {
            let mut bytes = whole.clone();
            bytes[index] ^= 0x10;
            fs::write(&path, &bytes).expect("a damaged file");
            let options = VerifyOptions { level, threads: 1, ..FULL_CHECK };
            let report = verify(&Folder::at(&data), options, |_| {}).expect("a report");
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            assert!(report.problems.iter().any(|problem| problem.file.contains(&name)), "byte {index} of {name}");
        }
        fs::write(&path, &whole).expect("the whole file");
    }
    flip_bit(data.join("field.mcap"));
    let said = Program::on("verify", &data).expect_code(4).stdout;
    assert!(said.contains("field.mcap") && said.contains("delete manifest.json"), "{said}");
    // The remedy.
    let before = print_root(&data);
    fs::remove_file(data.join("manifest.json")).expect("a manifest");
    run(&workspace, "data", &["--set", "shards.positions=18"]);
    Program::on("verify", &data).succeed();
    assert_eq!(print_root(&data), before);
}
