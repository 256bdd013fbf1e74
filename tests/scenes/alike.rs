//! Datasets that come out alike however they are made.

use std::path::PathBuf;

use crate::support::{
    files::{FULL_CHECK, assert_intact},
    program::{Program, print_root},
    workspace::Workspace,
};

/// Makes the dataset `two` of a job, which is intact, with `regenerated` samples that are equal when made again. One
/// thread and seven tasks make the same. Returns the folder of the dataset.
pub fn make_alike(workspace: &Workspace, job: &str, regenerated: &str) -> PathBuf {
    let two = workspace.make_dataset("two", job, &[]);
    assert_intact(&two, FULL_CHECK);
    Program::on("verify", &two).option("--regenerate", regenerated).succeed();
    Program::run_job(workspace.path("two.toml"), workspace.path("one")).option("--threads", "1").succeed();
    assert_eq!(print_root(&two), print_root(workspace.path("one")));
    for task in [0, 5, 2, 6, 1, 4, 3] {
        workspace.run_job("two", "tasks").option("--task", format!("{task}/7")).succeed();
    }
    Program::on("merge", workspace.path("tasks")).succeed();
    assert_eq!(print_root(&two), print_root(workspace.path("tasks")));
    two
}

/// Makes the dataset `two` once more without vector instructions; its folder.
pub fn make_scalar(workspace: &Workspace) -> PathBuf {
    let scalar = workspace.path("scalar");
    Program::run_job(workspace.path("two.toml"), &scalar).env("GRASPMILL_SIMD", "scalar").succeed();
    scalar
}
