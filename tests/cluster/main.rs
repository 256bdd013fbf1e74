//! Datasets made by many tasks: the same bytes as by one process, whatever engine runs them and whatever goes wrong.
#![cfg(feature = "sim")]
#![expect(clippy::print_stdout, reason = "figures for the log")]

mod slurm;
#[path = "../tree/mod.rs"]
mod tree;

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use graspmill::dataset::Manifest;
use tree::tree;

/// Meshes of which one is refused, in fifteen shards.
const JOB: &str = r#"
name = "tasks"
seed = 5
views = { even = 40 }

[[objects]]
built_in = ["can-01", "bowl-01", "cup-01"]

[[objects]]
folder = "meshes"

[shards]
samples = 8
"#;

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    // Whatever runs these tests is no engine of theirs.
    for variable in ["SLURM_ARRAY_TASK_ID", "SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE", "PARALLEL_SEQ"] {
        command.env_remove(variable);
    }
    command
}

fn graspmill(arguments: &[&str]) -> Output {
    program().args(arguments).output().expect("graspmill starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs to an exit code; what it printed to stdout and to stderr.
fn ends_with(code: i32, arguments: &[&str]) -> (String, String) {
    let output = graspmill(arguments);
    let (out, talk) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {out}{talk}");
    (out, talk)
}

struct Place(tempfile::TempDir);

impl Place {
    fn new() -> Self {
        let place = tempfile::tempdir().expect("a temporary folder");
        fs::create_dir(place.path().join("meshes")).expect("a folder");
        fs::write(place.path().join("meshes/empty.stl"), "solid nothing\nendsolid nothing\n").expect("a file");
        fs::write(place.path().join("job.toml"), JOB).expect("a file");
        Self(place)
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_string_lossy().into_owned()
    }

    fn job(&self) -> String {
        self.path("job.toml")
    }

    /// The dataset by one process.
    fn plain(&self) -> String {
        let out = self.path("plain");
        ends_with(3, &["run", &self.job(), "--out", &out, "--progress", "none"]);
        out
    }
}

/// Every file of a folder by its path in it; notes about the run and scripts of engines aside, which are no part of a dataset.
fn content(folder: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = tree(folder);
    files.retain(|path, _| !path.starts_with("cluster") && path != Path::new("notes.json"));
    files
}

#[track_caller]
fn assert_same(first: &str, second: &str) {
    let (first, second) = (content(first), content(second));
    assert_eq!(first.keys().collect::<Vec<_>>(), second.keys().collect::<Vec<_>>());
    for (name, bytes) in &first {
        assert!(bytes == &second[name], "{} differs", name.display());
    }
}

#[test]
fn tasks_in_any_order_make_the_same_dataset() {
    let place = Place::new();
    let (plain, job, out) = (place.plain(), place.job(), place.path("tasks"));
    let task = |task: &str| ends_with(0, &["run", &job, "--out", &out, "--task", task, "--progress", "none"]).0;
    let first = task("2/4");
    assert!(first.contains("task 2 of 4: all of its 4 shards are there"), "{first}");
    task("0/4");
    assert!(task("2/4").contains("(4 of them before)"));
    let (_, gap) = ends_with(1, &["merge", &out]);
    assert!(gap.contains("7 of 15 shards are missing: 1,3,5,7,9,11,13"), "{gap}");
    assert!(gap.contains("--array=1,3,5,7,9,11,13") && gap.contains("--task env/15"), "{gap}");
    let (status, _) = ends_with(0, &["status", &out]);
    assert!(status.contains("missing: shards 1,3,5,7,9,11,13"), "{status}");
    // Another count of tasks may go on: the shards are the plan's.
    let mut rest = program();
    let asked = ["run", &job, "--out", &out, "--task", "env", "--progress", "none"];
    rest.args(asked).envs([
        ("SLURM_ARRAY_TASK_ID", "2"),
        ("SLURM_ARRAY_TASK_MIN", "1"),
        ("SLURM_ARRAY_TASK_MAX", "2"),
        ("SLURM_ARRAY_TASK_COUNT", "2"),
        ("SLURM_CPUS_PER_TASK", "1"),
    ]);
    let done = rest.output().expect("graspmill starts");
    let told = text(&done.stderr);
    assert!(done.status.success() && told.contains("task 1 of 2 (SLURM_ARRAY_TASK_ID=2)"), "{told}");
    assert!(text(&done.stdout).contains("on 1 threads"), "the engine's grant: {}", text(&done.stdout));
    let (status, _) = ends_with(0, &["status", &out]);
    assert!(status.contains("all shards are there") && status.contains("graspmill merge"), "{status}");
    // Like a plain run, the merge says that a mesh was refused.
    ends_with(3, &["merge", &out]);
    assert_same(&plain, &out);
    let (again, _) = ends_with(3, &["merge", &out]);
    assert!(again.contains("is complete already"), "{again}");
    assert!(task("1/4").contains("(4 of them before)"));
    assert_same(&plain, &out);
}

#[test]
fn tasks_at_the_same_time_do_each_other_no_harm() {
    let place = Place::new();
    let (plain, job, out) = (place.plain(), place.job(), place.path("tasks"));
    let start = |task: &str| {
        let mut command = program();
        command.args(["run", &job, "--out", &out, "--task", task, "--threads", "1", "--progress", "none"]);
        command.spawn().expect("graspmill starts")
    };
    let tasks: Vec<_> = ["0/2", "1/2", "0/2", "1/3", "0/1"].into_iter().map(start).collect();
    for mut task in tasks {
        assert!(task.wait().expect("it ends").success());
    }
    ends_with(3, &["merge", &out]);
    assert_same(&plain, &out);
}

#[test]
fn a_damaged_shard_is_a_gap_until_its_task_runs_again() {
    let place = Place::new();
    let (plain, job, out) = (place.plain(), place.job(), place.path("tasks"));
    let run = |task: &str| ends_with(0, &["run", &job, "--out", &out, "--task", task, "--progress", "none"]);
    run("0/1");
    let mut shards: Vec<_> = fs::read_dir(place.0.path().join("tasks/shards")).expect("shards").collect();
    shards.sort_by_key(|entry| entry.as_ref().expect("an entry").path());
    let damaged = shards[6].as_ref().expect("an entry").path();
    let mut bytes = fs::read(&damaged).expect("a shard");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&damaged, bytes).expect("written");
    let (_, gap) = ends_with(1, &["merge", &out]);
    assert!(gap.contains("1 of 15 shards are missing: 6") && gap.contains("its name says digest"), "{gap}");
    run("6/15");
    ends_with(3, &["merge", &out]);
    fs::remove_file(damaged.with_extension("mcap.bad")).expect("set aside");
    assert_same(&plain, &out);
}

#[test]
fn every_product_merges_to_the_same_bytes() {
    let place = Place::new();
    let short = ["--set", "annealing.steps=1500", "--set", "keep.space=force"];
    let coarse = ["--set", "poses.x.step=0.3", "--set", "poses.y.step=0.4", "--set", "shards.positions=16"];
    let cases: [(&str, &[&str]); 2] = [("jobs/grasps-quick.toml", &short), ("jobs/fetch-reachability.toml", &coarse)];
    for (number, (job, settings)) in cases.into_iter().enumerate() {
        let (plain, out) = (place.path(&format!("plain-{number}")), place.path(&format!("tasks-{number}")));
        ends_with(0, &[&["run", job, "--out", &plain, "--progress", "none"], settings].concat());
        for task in ["1/2", "0/2"] {
            ends_with(0, &[&["run", job, "--out", &out, "--task", task, "--progress", "none"], settings].concat());
        }
        ends_with(0, &["merge", &out]);
        assert_same(&plain, &out);
    }
}

#[test]
fn doubt_about_the_task_is_refused_before_anything_is_made() {
    let place = Place::new();
    let (job, out) = (place.job(), place.path("out"));
    for (asked, environment, told) in [
        ("3/3", None, "expected I/N with I from 0 to N - 1"),
        ("env", None, "no engine's variable is set"),
        ("env", Some(("JOB_COMPLETION_INDEX", "1")), "give --task env/N"),
        ("env/4", Some(("PARALLEL_SEQ", "5")), "number the array from 1"),
    ] {
        let mut command = program();
        command.args(["run", &job, "--out", &out, "--task", asked]).envs(environment);
        let done = command.output().expect("graspmill starts");
        let talk = text(&done.stderr);
        assert!(done.status.code() == Some(2) && talk.contains(told), "{asked}: {talk}");
    }
    assert!(!Path::new(&out).exists());
    let (_, talk) = ends_with(2, &["run", "jobs/everything-quick.toml", "--out", &out, "--task", "0/2"]);
    assert!(talk.contains("one after another"), "{talk}");
    let (_, talk) = ends_with(1, &["merge", &out]);
    assert!(talk.contains("no run.json"), "{talk}");
}

#[test]
fn a_script_of_this_machine_makes_the_dataset() {
    let place = Place::new();
    let (plain, job, out) = (place.plain(), place.job(), place.path("out"));
    let asked = ["submit", &job, "--out", &out, "--backend", "local", "--tasks", "4", "--at-once", "2", "--cpus", "1"];
    let (printed, _) = ends_with(0, &[&asked[..], &["--print"]].concat());
    assert!(printed.starts_with("#!/bin/bash") && !Path::new(&out).exists(), "{printed}");
    let (told, _) = ends_with(0, &asked);
    assert!(told.contains("4 of 4 tasks (0-3) for 15 shards"), "{told}");
    let script = format!("{out}/cluster/local.sh");
    assert_eq!(fs::read_to_string(&script).expect("a script"), printed);
    let run = |script: &str| Command::new("bash").arg(script).output().expect("bash starts").status.code();
    // The merge's own code: a mesh was refused.
    assert_eq!(run(&script), Some(3));
    assert_same(&plain, &out);
    let (told, _) = ends_with(0, &["submit", "--retry", "--out", &out]);
    assert!(told.contains("all 15 shards are there"), "{told}");
    // Two shards are lost, of which one task has both.
    fs::remove_file(format!("{out}/manifest.json")).expect("a manifest");
    for entry in fs::read_dir(format!("{out}/shards")).expect("shards") {
        let path = entry.expect("an entry").path();
        if ["-00002-of-", "-00006-of-"].iter().any(|number| path.to_string_lossy().contains(number)) {
            fs::remove_file(path).expect("a shard");
        }
    }
    let (told, _) = ends_with(0, &["submit", "--retry", "--out", &out]);
    assert!(told.contains("1 of 4 tasks (2) for 15 shards"), "{told}");
    // Nothing says any more that a mesh was refused, until a task has looked at them.
    assert_eq!(run(&script), Some(3));
    assert_same(&plain, &out);
    let (_, talk) = ends_with(2, &["submit", &job, "--set", "seed=6", "--out", &out, "--backend", "local"]);
    assert!(talk.contains("another job") || talk.contains("belongs to job"), "{talk}");
}

#[test]
fn what_engines_are_given_is_sound() {
    let place = Place::new();
    let (job, out) = (place.job(), place.path("a folder"));
    let submit = |more: &[&str]| {
        let asked = [&["submit", &job, "--out", &out, "--tasks", "3", "--print", "--backend"], more].concat();
        ends_with(0, &asked).0
    };
    for backend in ["slurm", "parallel", "local"] {
        let script = place.path("script.sh");
        fs::write(&script, submit(&[backend])).expect("a file");
        let checked = Command::new("bash").args(["-n", &script]).output().expect("bash starts");
        assert!(checked.status.success(), "{backend}: {}", text(&checked.stderr));
    }
    let slurm = submit(&["slurm", "--option=--partition=long", "--option=--account=me", "--at-once", "2"]);
    for line in ["#SBATCH --array=0-2%2", "#SBATCH --partition=long", "#SBATCH --account=me"] {
        assert!(slurm.lines().any(|found| found == line), "{line} in {slurm}");
    }
    let manifest = submit(&["kubernetes", "--image", "factory:1", "--claim", "data=/data"]);
    for line in ["  completions: 3", "image: \"factory:1\"", "args: [run, ", "--task, env/3,"] {
        assert!(manifest.contains(line), "{line} in {manifest}");
    }
    let (_, talk) = ends_with(2, &["submit", &job, "--out", &out, "--backend", "kubernetes"]);
    assert!(talk.contains("--image"), "{talk}");
    let bad = ["submit", &job, "--out", &out, "--backend", "kubernetes", "--image", "x", "--claim", "data"];
    assert!(ends_with(2, &bad).1.contains("NAME=PATH"));
}

fn root(folder: &str) -> String {
    Manifest::read(Path::new(folder)).expect("a manifest").root.hex()
}
