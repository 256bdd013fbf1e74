//! Clocks that are wrong, tasks that disagree about their count, shards that are cut, too little memory, and a user
//! without permission to read: clear errors with the documented exit code, and no finished work is lost.

use std::{
    fs::{self, File, Permissions},
    os::unix::fs::{PermissionsExt, chown},
    path::{Path, PathBuf},
    process::{self, Command},
    time::{Duration, SystemTime},
};

use crate::support::{
    files::{list_shards, read_tree, repository_path},
    jobs::{ABOUT, NO_SPLIT, small_folder, small_jobs},
    program::{Outcome, Program, print_root},
    workspace::Workspace,
};

/// Pairs in fifteen shards.
fn job() -> String {
    format!(
        "views = {{ even = 40 }}\nobjects = [{{ built_in = [\"can-01\", \"bowl-01\", \"cup-01\"] }}]\n[grid]\n\
         resolution = 20\n[gate]\nmin_partial_cells = 1\n[shards]\nsamples = 8\n{NO_SPLIT}"
    )
}

/// A workspace with the job `job` and the dataset `whole` of it.
fn make_whole() -> Workspace {
    let workspace = Workspace::new();
    workspace.write("job.toml", job());
    workspace.run_job("job", "whole").succeed();
    workspace
}

#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn print(group: &str, tried: usize) {
    println!("{group:20} tried {tried:4} passed {tried:4}");
}

/// Gives every file below a folder, and the folders, a time.
fn set_times(folder: &Path, time: SystemTime) {
    for path in read_tree(folder).keys() {
        File::open(folder.join(path)).expect("a file").set_modified(time).expect("a time");
    }
    for name in ["shards", "."] {
        File::open(folder.join(name)).expect("a folder").set_modified(time).expect("a time");
    }
}

#[test]
fn no_clock_changes_what_is_made_or_lost() {
    let workspace = make_whole();
    let root = print_root(workspace.path("whole"));
    let year = Duration::from_secs(365 * 24 * 3600);
    let times = [SystemTime::UNIX_EPOCH, SystemTime::UNIX_EPOCH + 40 * year, SystemTime::now() + 60 * year];
    let mut tried = 0;
    for (number, time) in times.into_iter().enumerate() {
        let name = format!("skewed-{number}");
        let data = workspace.path(&name);
        workspace.run_job("job", &name).option("--task", "0/2").succeed();
        // A leftover of a killed writer is removed, whatever its time stamp; finished shards stay.
        let leftover = data.join("shards/.completion-00001-of-00015.1-1-0.tmp");
        fs::write(&leftover, "half a shard").expect("a file");
        let shards = list_shards(&data).len();
        set_times(&data, time);
        let said = workspace.run_job("job", &name).succeed().stdout;
        assert!(said.contains("56 samples in") && shards == 9, "{shards} shards before: {said}");
        assert!(!leftover.exists());
        set_times(&data, time);
        assert_eq!(print_root(&data), root);
        for verb in ["verify", "status", "inspect", "report"] {
            Program::on(verb, &data).succeed();
        }
        let said = workspace.run_job("job", &name).succeed().stdout;
        assert!(said.contains("nothing to do"), "{said}");
        tried += 6;
    }
    print("clocks", tried);
}

#[test]
fn tasks_that_disagree_about_their_count_leave_gaps_and_no_harm() {
    let workspace = make_whole();
    let root = print_root(workspace.path("whole"));
    let task = |out: &str, task: &str| workspace.run_job("job", out).option("--task", task);
    // Of 15 shards: those of 1/3 and of 3/4.
    task("data", "1/3").succeed();
    task("data", "3/4").succeed();
    let data = workspace.path("data");
    let gap = Program::on("merge", &data).expect_code(1).stderr;
    assert!(gap.contains("8 of 15 shards are missing: 0,2,5-6,8-9,12,14"), "{gap}");
    // More tasks than shards: those above have nothing to do.
    let said = task("data", "99/100").succeed().stdout;
    assert!(said.contains("all of its 0 shards are complete"), "{said}");
    // Another size of shards is another plan.
    let other = task("data", "0/2").set(["shards.samples=16"]).expect_code(2).stderr;
    assert!(other.contains("15 shards of 8") && other.contains("same shard size"), "{other}");
    let other = task("data", "0/2").set(["seed=9"]).expect_code(2).stderr;
    assert!(other.contains("another --out"), "{other}");
    // A cut shard, an empty one and one that has grown are gaps as well, once there is a file for each.
    task("data", "0/1").succeed();
    for number in [0, 2, 4] {
        let shard = &list_shards(&data)[number];
        let content = fs::read(shard).expect("a shard");
        let changed = match number {
            0 => content[..content.len() / 2].to_vec(),
            2 => Vec::new(),
            _ => [&content[..], b"\0"].concat(),
        };
        fs::write(shard, changed).expect("a shard");
    }
    let gap = Program::on("merge", &data).expect_code(1).stderr;
    assert!(gap.contains("3 of 15 shards are missing: 0,2,4") && gap.contains("its name has digest"), "{gap}");
    // The whole run makes what is missing, and the merge after it has nothing to do.
    workspace.run_job("job", "data").succeed();
    assert_eq!(print_root(&data), root);
    Program::on("merge", &data).succeed();
    Program::on("verify", &data).succeed();
    print("tasks", 10);
}

/// Limits of the address space [MiB]: from what the program hardly starts with to what is enough.
const LIMITS: [u64; 12] = [8, 16, 24, 32, 48, 64, 80, 96, 128, 192, 256, 1024];

/// Runs a small job again and again, each time with more memory: each end is one of a run that has too little, and the last
/// one is the undisturbed dataset.
fn starve(workspace: &Workspace, name: &str) -> usize {
    let whole = small_folder().join(name);
    let data = workspace.path(format!("{name}-starved"));
    let mut ends = Vec::new();
    for limit in LIMITS {
        let program = Program::of_system("prlimit").arg(format!("--as={}", limit << 20));
        let program =
            program.args([env!("CARGO_BIN_EXE_graspmill"), "run"]).arg(workspace.path(format!("{name}.toml")));
        let Outcome { code, stderr, .. } =
            program.option("--out", &data).args(["--progress", "none", "--threads", "2"]).finish();
        // No signal but that of memory that is refused, and no word of a panic of ours.
        let is_clear = match code {
            // MuJoCo's reader of XML has a second word for memory that ends inside an attribute.
            Some(2) => {
                ["Could not allocate memory", "unknown error in attribute"].iter().any(|words| stderr.contains(words))
            }
            Some(code) => [0, 1, 74, 127].contains(&code),
            // An abort: by Rust's allocator, by the C library (`Fatal glibc error: ... out of memory`) or by C++.
            None => {
                let aborts = ["memory allocation of", "out of memory", "bad_alloc"];
                stderr.is_empty() || aborts.iter().any(|words| stderr.contains(words))
            }
        };
        // The standard library panics where a starting thread finds no memory for its second stack; no other code may.
        let [panics, of_threads] =
            ["panicked", "failed to allocate an alternative stack"].map(|words| stderr.matches(words).count());
        assert!(is_clear && panics == of_threads, "{name}, {limit} MiB: {code:?} {stderr}");
        ends.push((limit, code));
    }
    workspace.run_job(name, &format!("{name}-starved")).succeed();
    assert_eq!(print_root(&data), print_root(&whole), "{name}: {ends:?}");
    let said = Program::on("verify", &data).succeed().stdout;
    assert!(!said.contains("note: "), "{name}: {said}");
    LIMITS.len()
}

#[test]
#[ignore = "slow: make test-all"]
fn too_little_memory_ends_a_run_and_loses_nothing() {
    let workspace = Workspace::new();
    let mut tried = 0;
    for (name, text) in small_jobs(small_folder()) {
        workspace.write(format!("{name}.toml"), text);
        tried += starve(&workspace, name);
    }
    print("memory", tried);
}

/// A group of processes with its own limit of memory, removed on drop; only root can make one.
struct MemoryGroup {
    folder: PathBuf,
    limit: PathBuf,
}

impl MemoryGroup {
    /// `None` where no group can be made.
    fn new() -> Option<Self> {
        let name = format!("graspmill-test-{}", process::id());
        let versions = [("/sys/fs/cgroup/memory", "memory.limit_in_bytes"), ("/sys/fs/cgroup", "memory.max")];
        versions.into_iter().find_map(|(root, limit)| {
            let folder = Path::new(root).join(&name);
            fs::create_dir(&folder).ok()?;
            let group = Self { limit: folder.join(limit), folder };
            group.limit.exists().then_some(group)
        })
    }

    /// Runs the program with this much memory, swap not counted [MiB].
    fn run(&self, limit: u64, arguments: &[&str]) -> Outcome {
        fs::write(&self.limit, (limit << 20).to_string()).expect("a limit");
        let script = format!("echo $$ > {}/cgroup.procs && exec \"$0\" \"$@\"", self.folder.display());
        Program::of_system("sh").option("-c", script).arg(env!("CARGO_BIN_EXE_graspmill")).args(arguments).finish()
    }
}

impl Drop for MemoryGroup {
    fn drop(&mut self) {
        _ = fs::remove_dir(&self.folder);
    }
}

#[test]
fn a_run_that_the_kernel_kills_for_its_memory_goes_on_where_it_was() {
    let Some(group) = MemoryGroup::new() else {
        println!("no group with a limit of memory can be made here");
        return;
    };
    let workspace = make_whole();
    let (job, data) = (workspace.path("job.toml"), workspace.path("data"));
    let [job, out] = [&job, &data].map(|path| path.to_str().expect("UTF-8"));
    let limits = [4, 8, 10, 12, 14, 16, 20, 64];
    for limit in limits {
        let Outcome { code, stderr, .. } = group.run(limit, &["run", job, "--out", out, "--quiet"]);
        assert!([None, Some(0)].contains(&code) && !stderr.contains("panicked"), "{limit} MiB: {code:?} {stderr}");
    }
    workspace.run_job("job", "data").succeed();
    assert_eq!(print_root(&data), print_root(workspace.path("whole")));
    Program::on("verify", &data).succeed();
    print("memory of a group", limits.len());
}

/// The user that owns nothing.
const NOBODY: u32 = 65534;

/// A program of that user, which root alone can become; `None` for all others, who are it themselves.
fn as_nobody(arguments: &[&str]) -> Program {
    let plain = || Program::of_system(env!("CARGO_BIN_EXE_graspmill"));
    let program = if is_root() {
        let user = format!("--reuid={NOBODY}");
        Program::of_system("setpriv").args([&user, "--clear-groups", env!("CARGO_BIN_EXE_graspmill")])
    } else {
        plain()
    };
    program.args(arguments)
}

fn is_root() -> bool {
    let user = Command::new("id").arg("-u").output().expect("id");
    String::from_utf8_lossy(&user.stdout).trim() == "0"
}

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).expect("a mode");
}

#[test]
fn a_user_who_may_not_read_or_write_is_told_so_and_loses_nothing() {
    let workspace = Workspace::new();
    workspace.write("about.toml", format!("{ABOUT}[licences]\none = \"CC0-1.0\"\n"));
    workspace.write("meshes/one.stl", fs::read(repository_path("meshes/bottle.stl")).expect("a mesh"));
    let job =
        format!("views = {{ even = 6 }}\nobjects = [{{ folder = \"meshes\" }}]\n[shards]\nsamples = 2\n{NO_SPLIT}");
    workspace.write("job.toml", job);
    workspace.run_job("job", "data").succeed();
    let root = print_root(workspace.path("data"));
    if is_root() {
        let give = |path: &Path| chown(path, Some(NOBODY), Some(NOBODY)).expect("an owner");
        give(workspace.folder());
        for path in read_tree(workspace.folder()).keys() {
            path.ancestors().filter(|part| *part != Path::new("")).for_each(|part| give(&workspace.path(part)));
        }
    }
    let at = |path: &str| workspace.path(path).display().to_string();
    let (data, out, about, toml) = (at("data"), at("out"), at("about.toml"), at("job.toml"));
    // Where the program cannot be started by that user, nothing can be tried.
    if as_nobody(&["version"]).finish().code != Some(0) {
        println!("the program can't be started by another user here");
        return;
    }
    let shard = list_shards(workspace.path("data"))[1].strip_prefix(workspace.folder()).expect("inside").to_owned();
    let shard = shard.to_str().expect("UTF-8");
    // What may not be read, the verb, its exit code, and whether its text names the file.
    let cases: [(&str, &[&str], i32); 20] = [
        ("job.toml", &["run", &toml, "--out", &out], 2),
        ("job.toml", &["estimate", &toml], 2),
        ("meshes", &["run", &toml, "--out", &out], 2),
        ("meshes/one.stl", &["run", &toml, "--out", &out], 2),
        ("meshes/one.stl", &["meshes", "check", &at("meshes/one.stl")], 3),
        ("data", &["status", &data], 74),
        ("data", &["verify", &data], 74),
        ("data/manifest.json", &["verify", &data], 74),
        ("data/manifest.json", &["inspect", &data], 74),
        ("data/manifest.json", &["report", &data, "--out", &out], 74),
        ("data/run.json", &["verify", &data], 4),
        ("data/run.json", &["run", &toml, "--out", &data], 74),
        ("data/assets.json", &["verify", &data], 4),
        ("data/assets.json", &["inspect", &data], 74),
        (shard, &["verify", &data], 4),
        (shard, &["inspect", &data], 74),
        (shard, &["run", &toml, "--out", &data], 74),
        (shard, &["export", &data, "--to", "npy", "--out", &out], 74),
        ("about.toml", &["release", &data, "--about", &about, "--out", &out], 2),
        ("data/shards", &["verify", &data], 74),
    ];
    for (file, arguments, code) in &cases {
        let path = workspace.path(file);
        let mode = fs::metadata(&path).expect("a file").permissions().mode();
        set_mode(&path, 0);
        let outcome = as_nobody(arguments).finish();
        set_mode(&path, mode);
        let said = outcome.text();
        assert_eq!(outcome.code, Some(*code), "{file}, {arguments:?}: {said}");
        assert!(said.to_lowercase().contains("permission denied"), "{file}, {arguments:?}: {said}");
        assert!(!workspace.path("out").exists(), "{file}, {arguments:?}");
    }
    // The same for writing: a folder that is there, and may not be written.
    let readonly = workspace.make_folder("readonly");
    set_mode(&readonly, 0o555);
    let inside = at("readonly/data");
    let writes: [&[&str]; 4] = [
        &["run", &toml, "--out", &inside],
        &["report", &data, "--out", &inside],
        &["export", &data, "--to", "npy", "--out", &inside],
        &["release", &data, "--about", &about, "--out", &inside],
    ];
    for arguments in writes {
        let outcome = as_nobody(arguments).finish();
        let said = outcome.text();
        assert!(outcome.code == Some(74) && said.contains("Permission denied"), "{arguments:?}: {said}");
    }
    set_mode(&readonly, 0o755);
    assert_eq!(print_root(workspace.path("data")), root);
    Program::on("verify", workspace.path("data")).succeed();
    print("unprivileged user", cases.len() + writes.len());
}

/// The program's threads have their own stacks: the `ulimit -s` of its first thread does not matter.
#[test]
fn a_small_stack_is_enough() {
    let workspace = Workspace::new();
    let job = workspace.write("job.toml", job());
    let out = workspace.path("data").display().to_string();
    let verbs = ["version", "schema", &format!("run {} --out {out} --threads 2 --progress none", job.display())];
    for (kilobytes, verb) in [32, 48, 64, 96, 256].iter().flat_map(|kilobytes| verbs.map(|verb| (kilobytes, verb))) {
        _ = fs::remove_dir_all(workspace.path("data"));
        let line = format!("ulimit -s {kilobytes}; exec \"$0\" {verb}");
        let shell = Program::of_system("bash").option("-c", line).arg(env!("CARGO_BIN_EXE_graspmill"));
        // Some systems start no program at all with so little: the arguments take a quarter of the stack.
        let outcome = shell.env("RUST_MIN_STACK", "16384").finish();
        let starts = !outcome.text().contains("Argument list too long") && outcome.code != Some(126);
        assert!(!starts || outcome.code == Some(0), "{kilobytes} kB, {verb}: {:?} {}", outcome.code, outcome.text());
    }
}
