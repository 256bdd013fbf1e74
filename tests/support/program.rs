//! The built program, called as a user calls it, and the programs that its results are compared with.

use std::{
    ffi::OsStr,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::files::{ROOT, repository_path};

/// A program that runs longer than this hangs, and is killed.
const TIME_LIMIT: Duration = Duration::from_secs(45 * 60);

/// Variables by which cluster engines identify tasks. The engine that runs the tests must not set them for the programs
/// under test.
const ENGINE_VARIABLES: [&str; 4] =
    ["SLURM_ARRAY_TASK_ID", "SLURM_CPUS_PER_TASK", "SLURM_CPUS_ON_NODE", "PARALLEL_SEQ"];

/// A command line, from the repository's root by default.
#[derive(Debug)]
pub struct Program(Command);

impl Program {
    /// `graspmill VERB`.
    pub fn new(verb: &str) -> Self {
        Self::of_build(env!("CARGO_BIN_EXE_graspmill"), verb)
    }

    /// `PROGRAM VERB`, where the program is another build of graspmill.
    pub fn of_build(program: impl AsRef<OsStr>, verb: &str) -> Self {
        let mut program = Self::of_system(program).arg(verb);
        for variable in ENGINE_VARIABLES {
            program.0.env_remove(variable);
        }
        program
    }

    /// `graspmill VERB PATH`.
    pub fn on(verb: &str, path: impl AsRef<OsStr>) -> Self {
        Self::new(verb).arg(path)
    }

    /// `graspmill run JOB --out OUT`, without progress.
    pub fn run_job(job: impl AsRef<OsStr>, out: impl AsRef<OsStr>) -> Self {
        Self::on("run", job).option("--out", out).option("--progress", "none")
    }

    /// Python with the packages of `tests/requirements.txt`.
    pub fn python() -> Self {
        Self::peer("venv/bin/python")
    }

    /// These lines of Python.
    pub fn python_lines(lines: &str) -> Self {
        Self::python().option("-c", lines)
    }

    /// A program under `.deps/`, by its path there.
    pub fn peer(path: &str) -> Self {
        let program = repository_path(".deps").join(path);
        // The larger programs are installed with the benchmarks' peers.
        assert!(
            program.exists(),
            "{} is missing: run `make deps-test`, for slow tests `make test-all`",
            program.display()
        );
        Self::of_system(program)
    }

    /// A program by its path, or by its name on the system's path.
    pub fn of_system(program: impl AsRef<OsStr>) -> Self {
        let mut command = Command::new(program);
        command.current_dir(ROOT);
        Self(command)
    }

    pub fn arg(mut self, argument: impl AsRef<OsStr>) -> Self {
        self.0.arg(argument);
        self
    }

    pub fn args(mut self, arguments: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Self {
        self.0.args(arguments);
        self
    }

    /// Two arguments: a name and its value.
    pub fn option(self, name: &str, value: impl AsRef<OsStr>) -> Self {
        self.arg(name).arg(value)
    }

    /// `--set SETTING` for each of these.
    pub fn set(self, settings: impl IntoIterator<Item = impl AsRef<OsStr>>) -> Self {
        settings.into_iter().fold(self, |program, setting| program.option("--set", setting))
    }

    pub fn env(mut self, name: &str, value: impl AsRef<OsStr>) -> Self {
        self.0.env(name, value);
        self
    }

    /// Finds no driver for EGL, as on a machine without one.
    pub fn without_egl(self) -> Self {
        self.env("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent.json")
    }

    pub fn current_dir(mut self, folder: impl AsRef<Path>) -> Self {
        self.0.current_dir(folder);
        self
    }

    /// Runs to its end, with any result.
    pub fn finish(self) -> Outcome {
        let line = format!("{:?}", self.0);
        let output = assert_cmd::Command::from_std(self.0).timeout(TIME_LIMIT).output();
        let output = output.unwrap_or_else(|error| panic!("{line}: {error}"));
        let [stdout, stderr] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        Outcome { line, code: output.status.code(), stdout, stderr }
    }

    /// Runs to an end with this exit code.
    #[track_caller]
    pub fn expect_code(self, code: i32) -> Outcome {
        let outcome = self.finish();
        assert_eq!(outcome.code, Some(code), "{}: {}", outcome.line, outcome.text());
        outcome
    }

    /// Runs to an end without a fault.
    #[track_caller]
    pub fn succeed(self) -> Outcome {
        self.expect_code(0)
    }

    /// Runs to an end with any exit code but 0.
    #[track_caller]
    pub fn fail(self) -> Outcome {
        let outcome = self.finish();
        let failed = outcome.code.is_some_and(|code| code != 0);
        assert!(failed, "{}: {:?} {}", outcome.line, outcome.code, outcome.text());
        outcome
    }

    /// Succeeds, and prints JSON when it is given `--json`.
    #[track_caller]
    pub fn read_json(self) -> Value {
        self.arg("--json").succeed().json()
    }

    /// Starts, and runs parallel to the test. Its output is dropped.
    pub fn start(mut self) -> Child {
        self.0.stdout(Stdio::null()).stderr(Stdio::null());
        self.0.spawn().unwrap_or_else(|error| panic!("{:?}: {error}", self.0))
    }

    /// Begins, and can be sent signals. Its output is dropped.
    pub fn start_running(self) -> Running {
        Running(self.start())
    }

    /// Kills it after this time; whether it was still at work.
    pub fn kill_after(self, time: Duration) -> bool {
        let mut running = self.start_running();
        thread::sleep(time);
        let at_work = running.is_at_work();
        running.signal("KILL");
        running.wait();
        at_work
    }
}

/// A program that runs parallel to the test.
#[derive(Debug)]
pub struct Running(Child);

impl Running {
    /// Whether it has not ended yet.
    pub fn is_at_work(&mut self) -> bool {
        self.0.try_wait().expect("a state").is_none()
    }

    /// Sends a signal by its name: `KILL`. A program that has ended ignores it.
    pub fn signal(&self, name: &str) {
        let line = format!("kill -s {name} {} 2>/dev/null", self.0.id());
        Program::of_system("sh").option("-c", line).finish();
    }

    /// Waits for its end: the exit code, `None` where a signal ended it.
    pub fn wait(mut self) -> Option<i32> {
        self.0.wait().expect("an end").code()
    }
}

/// An end of a program: its exit code (none where a signal ended it) and its output.
#[derive(Clone, Debug)]
pub struct Outcome {
    line: String,
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Outcome {
    /// Both outputs, one after the other.
    pub fn text(&self) -> String {
        format!("{}{}", self.stdout, self.stderr)
    }

    /// All of stdout as one value.
    #[track_caller]
    pub fn json<T: DeserializeOwned>(&self) -> T {
        serde_json::from_str(&self.stdout).unwrap_or_else(|error| panic!("{}: {error}: {}", self.line, self.text()))
    }

    /// A value per line of stdout.
    #[track_caller]
    pub fn json_lines<T: DeserializeOwned>(&self) -> Vec<T> {
        let read = |line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{}: {error}: {line}", self.line));
        self.stdout.lines().map(read).collect()
    }
}

/// The root digest of a dataset, as the program prints it.
#[track_caller]
pub fn print_root(folder: impl AsRef<OsStr>) -> String {
    Program::on("digest", folder).succeed().stdout.trim().to_owned()
}

/// The entities of a preview, as Rerun prints them.
pub fn print_by_rerun(preview: &Path) -> String {
    let converted = preview.with_extension("rrd");
    let rerun = |arguments: &[&str]| Program::peer("peers/bin/rerun").args(arguments);
    rerun(&["analytics", "disable"]).succeed();
    rerun(&["mcap", "check"]).arg(preview).succeed();
    rerun(&["mcap", "convert"]).arg(preview).option("-o", &converted).succeed();
    rerun(&["rrd", "print", "-vv"]).arg(&converted).succeed().stdout
}
