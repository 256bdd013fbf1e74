//! Names that a shell would take for commands: each reaches the program as one argument, or is refused.

use std::{
    env, fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

use super::{JOB, submit};
use crate::support::{
    files::{read_text, repository_path},
    program::Program,
    workspace::Workspace,
};

/// Names of folders that mean something to a shell, to Slurm or to GNU parallel.
const NAMES: [&str; 8] =
    ["two words", "it's", "a \"b\"", "$(touch x)", "`touch x`", "a; touch x", "a & touch x #", "%j {} * \\"];

/// A workspace with the job in a folder of this name, and a program that writes down its arguments, one per line.
fn write_job_in(name: &str) -> (Workspace, PathBuf) {
    let workspace = Workspace::new();
    let job = workspace.write(Path::new(name).join("job.toml"), JOB.replace("folder = \"meshes\"", "folder = \".\""));
    workspace.write(Path::new(name).join("empty.stl"), "solid nothing\nendsolid nothing\n");
    (workspace, job)
}

/// Writes a program that is found under this path of the workspace.
fn write_program(workspace: &Workspace, name: &str, lines: &str) -> PathBuf {
    let path = workspace.write(name, format!("#!/bin/bash\n{lines}\n"));
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a mode");
    path
}

/// The scripts that `submit --print` shows for a job and a dataset in folders of a name, with a recorder in place of the
/// program; it appends its arguments to `arguments.txt`, and a line `END`.
fn print_scripts(workspace: &Workspace, job: &Path, out: &Path, backend: &str) -> Vec<String> {
    let record = workspace.path("arguments.txt");
    let recorder = write_program(workspace, "recorder", &format!("printf '%s\\n' \"$@\" END >> {}", record.display()));
    let asked = ["--print", "--backend", backend, "--tasks", "4", "--cpus", "1"];
    let printed = Program::on("submit", job).option("--out", out).args(asked).succeed().stdout;
    let printed = printed.replace(env!("CARGO_BIN_EXE_graspmill"), recorder.to_str().expect("UTF-8"));
    printed.split("#!/bin/bash\n").skip(1).map(str::to_owned).collect()
}

/// Runs a script as an engine would, with a stand-in for GNU parallel; returns the arguments of each call of the program.
fn run_script(workspace: &Workspace, script: &str) -> Vec<Vec<String>> {
    let record = workspace.path("arguments.txt");
    _ = fs::remove_file(&record);
    // What GNU parallel does with the task numbers that it reads: it calls the exported function with each.
    write_program(workspace, "bin/parallel", "while read -r task; do run_task \"$task\" || exit; done");
    let path = format!("{}:{}", workspace.path("bin").display(), env::var("PATH").expect("a path"));
    let script = workspace.write("script.sh", script);
    let bash = Program::of_system("bash").arg(script).env("SLURM_ARRAY_TASK_ID", "2").env("PATH", path);
    bash.current_dir(workspace.folder()).succeed();
    let calls = read_text(&record);
    calls.split_terminator("END\n").map(|call| call.lines().map(str::to_owned).collect()).collect()
}

#[test]
#[ignore = "slow: a run per name"]
fn hostile_names_reach_the_program_as_one_argument() {
    for name in NAMES {
        let (workspace, job) = write_job_in(name);
        let out = workspace.path(name).join("data");
        let [job_text, out_text] = [&job, &out].map(|path| path.to_str().expect("UTF-8"));
        let task = |task: &str, progress: &str| {
            let words = ["run", job_text, "--out", out_text, "--task", task, "--threads", "1", "--progress", progress];
            words.map(str::to_owned).to_vec()
        };
        let [tasks, merge]: [String; 2] =
            print_scripts(&workspace, &job, &out, "slurm").try_into().expect("tasks and merge");
        assert_eq!(run_script(&workspace, &tasks), [task("2/4", "plain")], "{name}");
        let merge_words = ["merge", out_text, "--threads", "1"].map(str::to_owned).to_vec();
        assert_eq!(run_script(&workspace, &merge), [merge_words], "{name}");

        let [parallel]: [String; 1] = print_scripts(&workspace, &job, &out, "parallel").try_into().expect("one script");
        let mut expected: Vec<_> = (0..4).map(|number| task(&format!("{number}/4"), "none")).collect();
        expected.push(["merge", out_text].map(str::to_owned).to_vec());
        assert_eq!(run_script(&workspace, &parallel), expected, "{name}");
        for folder in [workspace.folder(), &repository_path("")] {
            assert!(!folder.join("x").exists(), "{name}: it was run as a command");
        }
    }
}

#[test]
fn control_characters_are_refused_before_anything_is_written() {
    for character in ['\n', '\r', '\t', '\u{1b}', '\u{7f}', '\u{85}', '\u{2028}'] {
        let name = format!("a{character}b");
        let (workspace, job) = write_job_in(&name);
        let plain = workspace.write("job.toml", "objects = [{ built_in = [\"can-01\"] }]\nviews = { even = 4 }\n");
        for backend in ["slurm", "parallel", "local"] {
            for (job, out) in [(&job, workspace.path("data")), (&plain, workspace.path("out").join(&name))] {
                let asked = ["--backend", backend, "--tasks", "2", "--cpus", "1"];
                let said = Program::on("submit", job).option("--out", &out).args(asked).expect_code(2).stderr;
                let number = format!("U+{:04X}", u32::from(character));
                assert!(said.contains("control character") && said.contains(&number), "{backend}: {said}");
                assert!(!out.exists(), "{backend}: something was written");
            }
        }
    }
}

#[test]
fn a_job_by_a_name_with_a_control_character_is_refused() {
    let (workspace, _) = write_job_in("plain");
    fs::rename(workspace.path("plain"), workspace.path("meshes")).expect("renamed");
    workspace.write("job.toml", JOB.replacen("name = \"tasks\"", "name = \"ta\\nsks\"", 1));
    let asked = ["--backend", "local", "--tasks", "2", "--cpus", "1"];
    let said = submit(&workspace, &workspace.path("out")).args(asked).expect_code(2).stderr;
    assert!(said.contains("the job's name") && said.contains("U+000A"), "{said}");
}
