//! Reachability datasets from the job file to the field: every verb, damage, resume, and bad input.

mod bad_input;
mod datasets;
mod looking;
mod misses;
mod on_sphere;

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::support::{jobs::fetch_table, program::Program, robots::FETCH, workspace::Workspace};
use serde_json::Value;

/// Grid of orientations by roll, pitch and yaw, of [`small_job`].
const ORIENTATIONS: &str = "roll = 2\npitch = 4\nyaw = 4\n";

/// A job for the robot `fetch.xml` in the same folder: 3 x 3 x 4 positions, and these orientations.
fn small_job(orientations: &str) -> String {
    format!(
        "product = \"reachability\"\nname = \"small\"\nseed = 3\n{}[poses]\n\
         x = {{ from = 0.4, to = 1.0, step = 0.2 }}\ny = {{ from = -0.3, to = 0.4, step = 0.3 }}\n\
         z = {{ from = 0.4, to = 1.2, step = 0.2 }}\n{orientations}[shards]\npositions = 7\n",
        fetch_table("fetch.xml".as_ref())
    )
}

/// A workspace with the robot and [`small_job`].
fn write_job(orientations: &str) -> Workspace {
    let workspace = Workspace::new();
    fs::copy(FETCH, workspace.path("fetch.xml")).expect("the robot is copied");
    workspace.write("job.toml", small_job(orientations));
    workspace
}

/// Changes the description of the workspace's robot.
fn change_robot(workspace: &Workspace, from: &str, to: &str) {
    let before = workspace.read("fetch.xml");
    let after = before.replace(from, to);
    assert_ne!(after, before);
    workspace.write("fetch.xml", after);
}

/// Makes the dataset `OUT`; its folder.
#[track_caller]
fn run(workspace: &Workspace, out: &str, arguments: &[&str]) -> PathBuf {
    workspace.run_job("job", out).args(arguments).succeed();
    workspace.path(out)
}

fn query(map: &Path, arguments: &[&str]) -> Program {
    Program::new("query").arg("reach").arg(map).args(arguments)
}

/// Makes `samples` samples again: all are unchanged. Returns the report of `verify`.
#[track_caller]
fn assert_regenerates(dataset: &Path, samples: u64) -> Value {
    let verified = Program::on("verify", dataset).option("--regenerate", samples.to_string()).read_json();
    assert_eq!((&verified["intact"], &verified["regenerated"]["samples"]), (&true.into(), &samples.into()));
    assert_eq!(verified["regenerated"]["differences"], Value::Array(Vec::new()));
    verified
}
