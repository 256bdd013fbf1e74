//! Datasets made by many tasks: the same bytes as by one process, with every engine and after every failure.

mod hostile;
mod slurm;
mod tasks;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::support::{
    files::read_tree,
    program::{Outcome, Program},
    workspace::Workspace,
};

/// Meshes with one that is refused, in fifteen shards.
const JOB: &str = r#"
name = "tasks"
seed = 5
views = { even = 10 }

[[objects]]
built_in = ["can-01", "bowl-01", "cup-01"]

[[objects]]
folder = "meshes"

[shards]
samples = 2
"#;

/// A workspace with a job and a mesh in `meshes` that is refused.
fn write_job(job: &str) -> Workspace {
    let workspace = Workspace::new();
    workspace.write("meshes/empty.stl", "solid nothing\nendsolid nothing\n");
    workspace.write("job.toml", job);
    workspace
}

/// Makes the dataset `plain` by one process, which reports a refused mesh.
fn make_plain(workspace: &Workspace) -> PathBuf {
    workspace.run_job("job", "plain").expect_code(3);
    workspace.path("plain")
}

/// `graspmill submit` of the workspace's job.
fn submit(workspace: &Workspace, out: &Path) -> Program {
    Program::on("submit", workspace.path("job.toml")).option("--out", out)
}

/// Ends with 3, as a plain run does: a mesh was refused.
#[track_caller]
fn merge(out: &Path) -> Outcome {
    Program::on("merge", out).expect_code(3)
}

/// All files of a dataset by their paths: without notes about the run and scripts of engines, which are no part of it.
fn read_content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = read_tree(folder);
    files.retain(|path, _| !path.starts_with("cluster") && path != Path::new("notes.json"));
    files
}

#[track_caller]
fn assert_same(first: &Path, second: &Path) {
    let (first, second) = (read_content(first), read_content(second));
    assert_eq!(first.keys().collect::<Vec<_>>(), second.keys().collect::<Vec<_>>());
    for (name, bytes) in &first {
        assert!(bytes == &second[name], "{} differs", name.display());
    }
}
