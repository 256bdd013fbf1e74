//! Tasks in any order, at one time, damaged and in doubt; scripts and manifests of engines.

use std::fs;

use super::{JOB, assert_same, make_plain, merge, submit, write_job};
use crate::support::{
    files::{flip_bit, list_shards, read_text},
    jobs::SHORT_SEARCH,
    program::Program,
    workspace::Workspace,
};

#[test]
fn tasks_in_any_order_make_the_same_dataset() {
    let workspace = write_job(JOB);
    let (plain, out) = (make_plain(&workspace), workspace.path("tasks"));
    let task = |task: &str| workspace.run_job("job", "tasks").option("--task", task).succeed().stdout;
    let first = task("2/4");
    assert!(first.contains("task 2 of 4: all of its 4 shards are complete"), "{first}");
    task("0/4");
    assert!(task("2/4").contains("(4 of them before)"));
    let gap = Program::on("merge", &out).expect_code(1).stderr;
    assert!(gap.contains("7 of 15 shards are missing: 1,3,5,7,9,11,13"), "{gap}");
    assert!(gap.contains("--array=1,3,5,7,9,11,13") && gap.contains("--task env/15"), "{gap}");
    let status = Program::on("status", &out).succeed().stdout;
    assert!(status.contains("missing: shards 1,3,5,7,9,11,13"), "{status}");
    // Another number of tasks may continue: the shards are the plan's.
    let rest = workspace.run_job("job", "tasks").option("--task", "env").env("SLURM_ARRAY_TASK_ID", "2");
    let rest = rest.env("SLURM_ARRAY_TASK_MIN", "1").env("SLURM_ARRAY_TASK_MAX", "2");
    let done = rest.env("SLURM_ARRAY_TASK_COUNT", "2").env("SLURM_CPUS_PER_TASK", "1").succeed();
    assert!(done.stderr.contains("task 1 of 2 (SLURM_ARRAY_TASK_ID=2)"), "{}", done.stderr);
    assert!(done.stdout.contains("on 1 threads"), "the engine's grant: {}", done.stdout);
    let status = Program::on("status", &out).succeed().stdout;
    assert!(status.contains("all shards are complete") && status.contains("graspmill merge"), "{status}");
    // Like a plain run, the merge reports the refused mesh.
    merge(&out);
    assert_same(&plain, &out);
    let again = merge(&out).stdout;
    assert!(again.contains("is already complete"), "{again}");
    assert!(task("1/4").contains("(4 of them before)"));
    assert_same(&plain, &out);
}

#[test]
fn tasks_at_the_same_time_do_each_other_no_harm() {
    let workspace = write_job(JOB);
    let (plain, out) = (make_plain(&workspace), workspace.path("tasks"));
    let start = |task: &str| workspace.run_job("job", "tasks").option("--task", task).option("--threads", "1").start();
    let tasks: Vec<_> = ["0/2", "1/2", "0/2", "1/3", "0/1"].into_iter().map(start).collect();
    for mut task in tasks {
        assert!(task.wait().expect("it ends").success());
    }
    merge(&out);
    assert_same(&plain, &out);
}

#[test]
fn a_damaged_shard_is_a_gap_until_its_task_runs_again() {
    let workspace = write_job(JOB);
    let (plain, out) = (make_plain(&workspace), workspace.path("tasks"));
    let run = |task: &str| workspace.run_job("job", "tasks").option("--task", task).succeed();
    run("0/1");
    let damaged = &list_shards(&out)[6];
    flip_bit(damaged);
    let gap = Program::on("merge", &out).expect_code(1).stderr;
    assert!(gap.contains("1 of 15 shards are missing: 6") && gap.contains("its name has digest"), "{gap}");
    run("6/15");
    merge(&out);
    fs::remove_file(damaged.with_extension("mcap.bad")).expect("set aside");
    assert_same(&plain, &out);
}

#[test]
#[ignore = "slow: tasks of every product"]
fn every_product_merges_to_the_same_bytes() {
    let workspace = Workspace::new();
    let coarse = ["poses.x.step=0.3", "poses.y.step=0.4", "shards.positions=16"];
    let cases: [(&str, &[&str]); 2] =
        [("jobs/grasps-quick.toml", &SHORT_SEARCH), ("jobs/fetch-reachability.toml", &coarse)];
    for (number, (job, settings)) in cases.into_iter().enumerate() {
        let [plain, out] = ["plain", "tasks"].map(|name| workspace.path(format!("{name}-{number}")));
        Program::run_job(job, &plain).set(settings).succeed();
        for task in ["1/2", "0/2"] {
            Program::run_job(job, &out).set(settings).option("--task", task).succeed();
        }
        Program::on("merge", &out).succeed();
        assert_same(&plain, &out);
    }
}

#[test]
fn doubt_about_the_task_is_refused_before_anything_is_made() {
    let workspace = write_job(JOB);
    let out = workspace.path("out");
    for (asked, environment, said) in [
        ("3/3", None, "expected I/N with I from 0 to N - 1"),
        ("env", None, "no engine's variable is set"),
        ("env", Some(("JOB_COMPLETION_INDEX", "1")), "give --task env/N"),
        ("env/4", Some(("PARALLEL_SEQ", "5")), "number the array from 1"),
    ] {
        let run = workspace.run_job("job", "out").option("--task", asked);
        let run = environment.into_iter().fold(run, |run, (name, value)| run.env(name, value));
        let talk = run.expect_code(2).stderr;
        assert!(talk.contains(said), "{asked}: {talk}");
    }
    assert!(!out.exists());
    let talk = Program::run_job("jobs/everything-quick.toml", &out).option("--task", "0/2").expect_code(2).stderr;
    assert!(talk.contains("one after another"), "{talk}");
    let talk = Program::on("merge", &out).expect_code(2).stderr;
    assert!(talk.contains("no such folder"), "{talk}");
}

#[test]
fn a_script_of_this_machine_makes_the_dataset() {
    let workspace = write_job(JOB);
    let (plain, out) = (make_plain(&workspace), workspace.path("out"));
    let asked = ["--backend", "local", "--tasks", "4", "--at-once", "2", "--cpus", "1"];
    let printed = submit(&workspace, &out).args(asked).arg("--print").succeed().stdout;
    assert!(printed.starts_with("#!/bin/bash") && !out.exists(), "{printed}");
    let said = submit(&workspace, &out).args(asked).succeed().stdout;
    assert!(said.contains("4 of 4 tasks (0-3) for 15 shards"), "{said}");
    let script = out.join("cluster/local.sh");
    assert_eq!(read_text(&script), printed);
    // No task has started: `status` reports what was submitted and the command that starts it, which is the one below.
    let status = Program::on("status", &out).succeed().stdout;
    assert!(status.contains("submitted; no task has started\n4 tasks for 15 shards"), "{status}");
    assert!(status.contains(&format!("start it: bash {}", script.display())), "{status}");
    let status: serde_json::Value = Program::on("status", &out).arg("--json").succeed().json();
    assert_eq!((&status["state"], &status["backend"]), (&"submitted".into(), &"local".into()));
    // Ends with the merge's own code: a mesh was refused.
    let run_script = || Program::of_system("bash").arg(&script).expect_code(3);
    run_script();
    assert_same(&plain, &out);
    let retry = || Program::new("submit").arg("--retry").option("--out", &out).succeed().stdout;
    let said = retry();
    assert!(said.contains("all 15 shards are complete"), "{said}");
    // Two shards are lost; one task has both.
    fs::remove_file(out.join("manifest.json")).expect("a manifest");
    for path in list_shards(&out) {
        if ["-00002-of-", "-00006-of-"].iter().any(|number| path.to_string_lossy().contains(number)) {
            fs::remove_file(path).expect("a shard");
        }
    }
    let said = retry();
    assert!(said.contains("1 of 4 tasks (2) for 15 shards"), "{said}");
    // No record of the refused mesh remains until a task has read the meshes.
    run_script();
    assert_same(&plain, &out);
    let status = Program::on("status", &out).succeed().stdout;
    assert!(status.contains(": complete\n15 of 15 shards done"), "{status}");
    let talk = submit(&workspace, &out).set(["seed=6"]).args(["--backend", "local"]).expect_code(2).stderr;
    assert!(talk.contains("another job") || talk.contains("belongs to job"), "{talk}");
}

#[test]
fn what_engines_are_given_is_sound() {
    let workspace = write_job(JOB);
    let out = workspace.path("a folder");
    let print = |asked: &[&str]| {
        submit(&workspace, &out).args(["--tasks", "3", "--print", "--backend"]).args(asked).succeed().stdout
    };
    for backend in ["slurm", "parallel", "local"] {
        let script = workspace.write("script.sh", print(&[backend]));
        Program::of_system("bash").option("-n", script).succeed();
    }
    let slurm = print(&["slurm", "--option=--partition=long", "--option=--account=me", "--at-once", "2"]);
    for line in ["#SBATCH --array=0-2%2", "#SBATCH --partition=long", "#SBATCH --account=me"] {
        assert!(slurm.lines().any(|found| found == line), "{line} in {slurm}");
    }
    let manifest = print(&["kubernetes", "--image", "factory:1", "--claim", "data=/data"]);
    for line in ["  completions: 3", "image: \"factory:1\"", "args: [run, ", "--task, env/3,"] {
        assert!(manifest.contains(line), "{line} in {manifest}");
    }
    let refused =
        |asked: &[&str]| submit(&workspace, &out).args(["--backend", "kubernetes"]).args(asked).expect_code(2).stderr;
    let talk = refused(&[]);
    assert!(talk.contains("--image"), "{talk}");
    assert!(refused(&["--image", "x", "--claim", "data"]).contains("NAME=PATH"));
}
