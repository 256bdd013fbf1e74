//! Scripts and manifests that have an engine run a job's tasks, and then the merge.

use std::{
    borrow::Cow,
    fmt,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::template::{Verbatim, fill, plain_name};
use kernel::words::{Show, number_ranges};

/// Engine that runs the tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Backend {
    /// An array of Slurm, and a job that depends on it.
    Slurm,
    /// An Indexed Job of Kubernetes, and a Job that waits for it.
    Kubernetes,
    /// GNU parallel.
    Parallel,
    /// Processes of this machine.
    Local,
}

/// Resources of one task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Resources {
    /// Processors.
    pub cpus: u16,
    /// Memory [MiB].
    pub memory: u32,
    /// Most time [minutes].
    pub minutes: u32,
}

/// Cut of the work into tasks.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskPlan {
    /// Tasks.
    pub tasks: u32,
    /// Shards of the dataset.
    pub shards: u32,
    /// Most tasks at once; `None` as many as the engine will.
    pub at_once: Option<u32>,
}

/// Kubernetes' further needs: image and volume.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PodContainer {
    /// The image, with the program in it.
    pub image: String,
    /// The claim of a volume that many pods may write to.
    pub claim: String,
    /// Path of the folder of job file, meshes and dataset, as pods see it.
    pub mount: PathBuf,
}

/// A job sent to an engine; `submit.json` keeps it, so that what is missing can be sent again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Submission {
    /// Engine that runs it.
    pub backend: Backend,
    /// The job's name.
    pub name: String,
    /// The program; absolute, but for a container's.
    pub program: PathBuf,
    /// The folder in which it is started: packages of meshes lie below it.
    pub folder: PathBuf,
    /// The job file; absolute.
    pub job: PathBuf,
    /// Settings laid over the job, `key=value`.
    pub overrides: Vec<String>,
    /// The dataset's folder; absolute.
    pub out: PathBuf,
    /// Cut of the work into tasks.
    pub plan: TaskPlan,
    /// Resources of one task.
    pub resources: Resources,
    /// Further options for Slurm, such as `--partition=long`.
    pub options: Vec<String>,
    /// Container, for Kubernetes.
    pub container: Option<PodContainer>,
}

/// A file that an engine is given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubmissionFile {
    /// Name, in the folder of the submission.
    pub name: &'static str,
    /// Content.
    pub text: String,
}

/// Why no script can be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SubmissionError {
    /// A character that would end a line of a script, or hide in one.
    #[error(
        "{argument}: {text:?} holds the control character U+{:04X}, which scripts must not contain; use another name",
        *character as u32
    )]
    ControlCharacter {
        /// Argument that gives the text.
        argument: &'static str,
        /// Text of the argument.
        text: String,
        /// The character.
        character: char,
    },
    /// A path that no script can name.
    #[error("{argument}: {} is not UTF-8, the encoding of scripts; use another name", path.shown())]
    NotText {
        /// Argument that gives the path.
        argument: &'static str,
        /// The path.
        path: PathBuf,
    },
}

impl fmt::Display for Backend {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Slurm => "slurm",
            Self::Kubernetes => "kubernetes",
            Self::Parallel => "parallel",
            Self::Local => "local",
        })
    }
}

impl TaskPlan {
    /// Time that a task should take, less for small jobs [s]: starting costs little in comparison, a lost task is soon
    /// made again, and schedulers are spared thousands of short ones.
    const TASK_SECONDS: f64 = 1800.0;

    /// Tasks of about half an hour for this work [s of one processor], each with `cpus` processors.
    pub fn suggested(core_seconds: f64, cpus: u16, shards: u32) -> Self {
        let tasks = (core_seconds / f64::from(cpus.max(1)) / Self::TASK_SECONDS).ceil();
        // A count that is no number, or larger than any array, ends at the count of shards.
        let tasks = if tasks.is_finite() { tasks.clamp(1.0, f64::from(u32::MAX)) as u32 } else { 1 };
        Self { tasks: tasks.clamp(1, shards.max(1)), shards, at_once: None }
    }
}

impl Submission {
    /// Tasks that hold at least one of these shards, ascending.
    pub fn tasks_of(&self, shards: &[u32]) -> Vec<u32> {
        let mut tasks: Vec<u32> = shards.iter().map(|shard| shard % self.plan.tasks).collect();
        tasks.sort_unstable();
        tasks.dedup();
        tasks
    }

    /// Scripts or manifests for the engine, to run these tasks (ascending) and then the merge; what they print goes to the
    /// folder `logs`. Kubernetes runs all tasks: one with nothing to do ends at once.
    ///
    /// # Errors
    /// When a name, a path or an option holds a control character, or a path is not UTF-8.
    pub fn files(&self, tasks: &[u32], logs: &Path) -> Result<Vec<SubmissionFile>, SubmissionError> {
        self.check(logs)?;
        let view = ScriptView::of(self, tasks, logs);
        let file = |name, template| SubmissionFile { name, text: fill(template, &view) };
        Ok(match self.backend {
            Backend::Slurm => vec![file("tasks.sh", "slurm-tasks.sh"), file("merge.sh", "slurm-merge.sh")],
            Backend::Kubernetes => vec![file("kubernetes.yaml", "kubernetes.yaml")],
            Backend::Parallel => vec![file("parallel.sh", "parallel.sh")],
            Backend::Local => vec![file("local.sh", "local.sh")],
        })
    }

    /// Refuses what would end a line of a script; [`Self::files`] does so as well.
    ///
    /// # Errors
    /// When a name, a path or an option holds a control character, or a path is not UTF-8.
    pub fn check(&self, logs: &Path) -> Result<(), SubmissionError> {
        let paths = [
            ("the path of graspmill", self.program.as_path()),
            ("the working folder", &self.folder),
            ("JOB", &self.job),
            ("--out", &self.out),
            ("--out", logs),
        ];
        let mount = self.container.iter().map(|container| ("--claim", container.mount.as_path()));
        for (argument, path) in paths.into_iter().chain(mount) {
            let text = path.to_str().ok_or_else(|| SubmissionError::NotText { argument, path: path.to_owned() })?;
            check_text(argument, text)?;
        }
        check_text("the job's name", &self.name)?;
        self.overrides.iter().try_for_each(|setting| check_text("--set", setting))?;
        self.options.iter().try_for_each(|option| check_text("--option", option))?;
        self.container.iter().try_for_each(|PodContainer { image, claim, .. }| {
            check_text("--image", image)?;
            check_text("--claim", claim)
        })
    }
}

/// Control characters, and the two that some readers of YAML take for line ends.
fn check_text(argument: &'static str, text: &str) -> Result<(), SubmissionError> {
    let is_control = |character: &char| character.is_control() || matches!(character, '\u{2028}' | '\u{2029}');
    match text.chars().find(is_control) {
        Some(character) => Err(SubmissionError::ControlCharacter { argument, text: text.to_owned(), character }),
        None => Ok(()),
    }
}

/// Everything that the templates of scripts name.
#[derive(Serialize)]
struct ScriptView<'a> {
    name: Verbatim,
    /// The tasks, as Slurm writes arrays.
    array: Verbatim,
    /// Largest number of simultaneous tasks, if the user sets one.
    limit: Option<u32>,
    tasks: u32,
    /// Number of the last task.
    last: u32,
    /// Numbers of the tasks to run; empty where it is all of them.
    some: &'a [u32],
    at_once: u32,
    cpus: u16,
    /// Memory of a task [MiB].
    memory: u32,
    minutes: u32,
    /// Time for which the merge waits [minutes].
    wait: u32,
    options: Vec<Verbatim>,
    logs: Cow<'a, str>,
    folder: Cow<'a, str>,
    program: Cow<'a, str>,
    job: Cow<'a, str>,
    overrides: &'a [String],
    out: Cow<'a, str>,
    image: Option<&'a str>,
    claim: Option<&'a str>,
    mount: Option<Cow<'a, str>>,
}

impl<'a> ScriptView<'a> {
    fn of(submission: &'a Submission, tasks: &'a [u32], logs: &'a Path) -> Self {
        let Submission { plan, resources: Resources { cpus, memory, minutes }, container, .. } = submission;
        let at_once = plan.at_once.unwrap_or(plan.tasks).min(plan.tasks);
        let is_all = *tasks == *(0..plan.tasks).collect::<Vec<_>>();
        Self {
            name: plain_name(&format!("graspmill-{}", submission.name)),
            array: Verbatim(number_ranges(tasks).join(",")),
            limit: plan.at_once,
            tasks: plan.tasks,
            last: plan.tasks - 1,
            some: if is_all { &[] } else { tasks },
            at_once,
            cpus: *cpus,
            memory: *memory,
            minutes: *minutes,
            // As long as all tasks take one after another, and an hour.
            wait: minutes.saturating_mul(plan.tasks.div_ceil(at_once)).saturating_add(60),
            options: submission.options.iter().cloned().map(Verbatim).collect(),
            logs: logs.to_string_lossy(),
            folder: submission.folder.to_string_lossy(),
            program: submission.program.to_string_lossy(),
            job: submission.job.to_string_lossy(),
            overrides: &submission.overrides,
            out: submission.out.to_string_lossy(),
            image: container.as_ref().map(|container| container.image.as_str()),
            claim: container.as_ref().map(|container| container.claim.as_str()),
            mount: container.as_ref().map(|container| container.mount.to_string_lossy()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn submission(backend: Backend) -> Submission {
        Submission {
            backend,
            name: "My mugs".to_owned(),
            program: "/opt/bin/graspmill".into(),
            folder: "/data/it's here".into(),
            job: "/data/it's here/mugs.toml".into(),
            overrides: vec!["grid.resolution=64".to_owned(), "name=\"a b\"".to_owned()],
            out: "/data/out".into(),
            plan: TaskPlan { tasks: 32, shards: 153, at_once: Some(4) },
            resources: Resources { cpus: 8, memory: 4096, minutes: 90 },
            options: vec!["--partition=long".to_owned()],
            container: (backend == Backend::Kubernetes).then(|| PodContainer {
                image: "registry/graspmill:0.1".to_owned(),
                claim: "data".to_owned(),
                mount: "/data".into(),
            }),
        }
    }

    const LOGS: &str = "/data/out/logs";

    fn texts(submission: &Submission, tasks: &[u32]) -> Vec<String> {
        let files = submission.files(tasks, Path::new(LOGS)).expect("plain names");
        files.into_iter().map(|file| file.text).collect()
    }

    #[test]
    fn every_branch_of_every_template_is_filled() {
        for backend in [Backend::Slurm, Backend::Kubernetes, Backend::Parallel, Backend::Local] {
            let mut submission = submission(backend);
            let every: Vec<u32> = (0..32).collect();
            for text in texts(&submission, &every) {
                assert!(!text.contains("{{") && !text.contains("}}") && !text.contains("{%"), "{backend}: {text}");
                assert!(text.contains("/data/out"), "{backend}: {text}");
            }
            (submission.plan.at_once, submission.options, submission.overrides) = (None, Vec::new(), Vec::new());
            let some = texts(&submission, &[3, 5]).concat();
            assert!(
                !some.contains("--set") && !some.contains("%4") && !some.contains("partition"),
                "{backend}: {some}"
            );
            let asked = match backend {
                Backend::Slurm => "--array=3,5\n",
                Backend::Kubernetes => "completions: 32\n",
                Backend::Parallel | Backend::Local => "printf '%s\\n' 3 5 | ",
            };
            assert!(some.contains(asked), "{backend}: {some}");
        }
    }

    /// Any text is one unchanged word to a shell and to a reader of YAML.
    #[test]
    fn hostile_texts_stay_one_word() {
        let hostile = [
            "it's",
            "a b",
            "$(touch x)",
            "`touch x`",
            "\"q\"",
            "a;b|c&d",
            "{}",
            "{%}",
            "{{ job }}",
            "\\",
            "%j",
            "$HOME",
            "#x",
            "-",
            "'\"'\"",
            "!x",
            "~",
            "*",
            "é\u{202e}",
        ];
        for text in hostile {
            for backend in [Backend::Slurm, Backend::Kubernetes, Backend::Parallel, Backend::Local] {
                let mut submission = submission(backend);
                submission.overrides = vec![text.to_owned()];
                submission.job = Path::new("/data").join(text);
                submission.out = submission.job.clone();
                let (job, files) = (submission.job.display().to_string(), texts(&submission, &[0]));
                if backend == Backend::Kubernetes {
                    let in_yaml = |text: &str| serde_json::Value::from(text.replace('$', "$$")).to_string();
                    let (job, set) = (in_yaml(&job), in_yaml(text));
                    let run = format!("args: [run, {job}, \"--set\", {set}, --out, {job}, --task, env/32,");
                    assert!(files[0].contains(&run), "{text}: {}", files[0]);
                    continue;
                }
                let lines =
                    files.iter().flat_map(|file| file.lines()).filter(|line| line.contains("/opt/bin/graspmill"));
                let words: Vec<String> = lines.flat_map(|line| shlex::split(line).expect("words")).collect();
                let run = ["run", &job, "--set", text, "--out", &job, "--task"];
                assert!(words.windows(7).any(|found| found == run), "{text}: {words:?}");
                assert!(words.windows(2).any(|found| found == ["merge", &job]), "{text}: {words:?}");
            }
        }
    }

    #[test]
    fn control_characters_are_refused_with_their_argument() {
        type Change = fn(&mut Submission, &str);
        let changes: [(&str, Change); 9] = [
            ("the path of graspmill", |submission, text| submission.program = text.into()),
            ("the working folder", |submission, text| submission.folder = text.into()),
            ("JOB", |submission, text| submission.job = text.into()),
            ("--out", |submission, text| submission.out = text.into()),
            ("the job's name", |submission, text| submission.name = text.to_owned()),
            ("--set", |submission, text| submission.overrides.push(text.to_owned())),
            ("--option", |submission, text| submission.options.push(text.to_owned())),
            ("--image", |submission, text| submission.container.as_mut().expect("one").image = text.to_owned()),
            ("--claim", |submission, text| submission.container.as_mut().expect("one").claim = text.to_owned()),
        ];
        for (argument, change) in changes {
            for (text, code) in [("a\nb", "U+000A"), ("a\0", "U+0000"), ("\u{1b}[2J", "U+001B"), ("\u{2028}", "U+2028")]
            {
                let mut submission = submission(Backend::Kubernetes);
                change(&mut submission, text);
                let message = submission.files(&[0], Path::new(LOGS)).expect_err(argument).to_string();
                assert!(message.starts_with(argument) && message.contains(code), "{message}");
            }
        }
        let message = submission(Backend::Local).files(&[0], Path::new("/data\t/logs")).expect_err("logs").to_string();
        assert!(message.starts_with("--out: "), "{message}");
    }

    #[test]
    fn names_of_logs_are_no_patterns() {
        let files = submission(Backend::Slurm).files(&[0], Path::new("/data/100%j of it/logs")).expect("plain names");
        assert!(
            files[0].text.contains("\n#SBATCH --output='/data/100%%j of it/logs'/%A_%a.log\n"),
            "{}",
            files[0].text
        );
    }

    #[test]
    fn tasks_take_half_an_hour() {
        let tasks = |hours: f64, cpus, shards| TaskPlan::suggested(3600.0 * hours, cpus, shards).tasks;
        assert_eq!([tasks(0.01, 4, 153), tasks(16.0, 4, 153), tasks(1000.0, 1, 153)], [1, 8, 153]);
        assert_eq!(tasks(16.0, 4, 0), 1);
    }

    #[test]
    fn missing_shards_are_sent_to_the_tasks_that_hold_them() {
        let submission = submission(Backend::Slurm);
        let tasks = submission.tasks_of(&[3, 35, 36, 69, 152]);
        assert_eq!(tasks, [3, 4, 5, 24]);
        let text = &texts(&submission, &tasks)[0];
        assert!(text.contains("\n#SBATCH --array=3-5,24%4\n"), "{text}");
        assert!(text.contains("\n#SBATCH --partition=long\n"), "{text}");
        assert!(text.contains("\ncd \"/data/it's here\" || exit 74\n"), "{text}");
    }
}
