//! Scripts and manifests that have an engine run a job's tasks, and then the merge.

use std::{
    fmt,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::template::{fill, plain_name, shell_word};
use crate::ids::ranges;

/// What runs the tasks.
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

/// What one task is given.
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

/// How the work is cut.
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

/// What Kubernetes needs besides.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Container {
    /// The image, with the program in it.
    pub image: String,
    /// The claim of a volume that many pods may write to.
    pub claim: String,
    /// Where pods see it: job file, meshes and dataset lie below.
    pub mount: PathBuf,
}

/// A job sent to an engine; `submit.json` keeps it, so that what is missing can be sent again.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Submission {
    /// What runs it.
    pub backend: Backend,
    /// The job's name.
    pub name: String,
    /// The program; absolute, but for a container's.
    pub program: PathBuf,
    /// The folder in which it is started: packages of meshes lie below it.
    pub folder: PathBuf,
    /// The job file; absolute.
    pub job: PathBuf,
    /// What is laid over it, `key=value`.
    pub overrides: Vec<String>,
    /// The dataset's folder; absolute.
    pub out: PathBuf,
    /// How the work is cut.
    pub plan: TaskPlan,
    /// What a task is given.
    pub resources: Resources,
    /// Further options for Slurm, such as `--partition=long`.
    pub options: Vec<String>,
    /// Of Kubernetes.
    pub container: Option<Container>,
}

/// A file that an engine is given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubmissionFile {
    /// Its name, in the folder of the submission.
    pub name: &'static str,
    /// Its content.
    pub text: String,
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
    /// Time that a task should take, less where there is little to do [s]: starting costs little beside it, a lost
    /// one is soon made again, and schedulers are spared thousands of short ones.
    const TASK_SECONDS: f64 = 1800.0;

    /// Tasks of about half an hour for so much work [s of one processor], each with `cpus` processors.
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

    /// What the engine is given to run these tasks (ascending) and then the merge; what they print goes to the folder
    /// `logs`. Kubernetes runs all: those with nothing to do
    /// end at once.
    pub fn files(&self, tasks: &[u32], logs: &Path) -> Vec<SubmissionFile> {
        let values = self.values(tasks, logs);
        let file = |name, template| SubmissionFile { name, text: fill(template, &values) };
        match self.backend {
            Backend::Slurm => vec![
                file("tasks.sh", include_str!("../../jobs/cluster/slurm-tasks.sh")),
                file("merge.sh", include_str!("../../jobs/cluster/slurm-merge.sh")),
            ],
            Backend::Kubernetes => vec![file("kubernetes.yaml", include_str!("../../jobs/cluster/kubernetes.yaml"))],
            Backend::Parallel => vec![file("parallel.sh", include_str!("../../jobs/cluster/parallel.sh"))],
            Backend::Local => vec![file("local.sh", include_str!("../../jobs/cluster/local.sh"))],
        }
    }

    fn values(&self, tasks: &[u32], logs: &Path) -> Vec<(&'static str, String)> {
        let Self { backend, plan, resources: Resources { cpus, memory, minutes }, .. } = self;
        // A string of JSON is one of YAML.
        let word = |text: &str| match backend {
            Backend::Kubernetes => serde_json::Value::from(text).to_string(),
            _ => shell_word(text),
        };
        let path = |path: &Path| word(&path.to_string_lossy());
        let separator = if *backend == Backend::Kubernetes { ", " } else { " " };
        let mut job = vec![path(&self.job)];
        job.extend(self.overrides.iter().flat_map(|setting| [word("--set"), word(setting)]));
        let throttle = plan.at_once.map_or_else(String::new, |most| format!("%{most}"));
        let at_once = plan.at_once.unwrap_or(plan.tasks).min(plan.tasks);
        let numbers = match *tasks == *(0..plan.tasks).collect::<Vec<_>>() {
            true => format!("seq 0 {}", plan.tasks - 1),
            false => format!("printf '%s\\n' {}", tasks.iter().map(u32::to_string).collect::<Vec<_>>().join(" ")),
        };
        let memory_text = if *backend == Backend::Kubernetes { format!("{memory}Mi") } else { format!("{memory}M") };
        let options: Vec<String> = self.options.iter().map(|option| format!("#SBATCH {option}\n")).collect();
        let mut values = vec![
            ("name", plain_name(&format!("graspmill-{}", self.name))),
            ("array", format!("{}{throttle}", ranges(tasks))),
            ("tasks", plan.tasks.to_string()),
            ("at_once", at_once.to_string()),
            ("numbers", numbers),
            ("cpus", cpus.to_string()),
            ("memory", memory_text),
            ("minutes", minutes.to_string()),
            // As long as all tasks take one after another, and an hour.
            ("wait", (minutes.saturating_mul(plan.tasks.div_ceil(at_once)) + 60).to_string()),
            ("options", options.concat().trim_end().to_owned()),
            ("logs", path(logs)),
            ("folder", path(&self.folder)),
            ("program", path(&self.program)),
            ("job", job.join(separator)),
            ("out", path(&self.out)),
        ];
        if let Some(Container { image, claim, mount }) = &self.container {
            values.extend([("image", word(image)), ("claim", word(claim)), ("mount", path(mount))]);
        }
        values
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
            container: (backend == Backend::Kubernetes).then(|| Container {
                image: "registry/graspmill:0.1".to_owned(),
                claim: "data".to_owned(),
                mount: "/data".into(),
            }),
        }
    }

    #[test]
    fn every_place_of_every_template_is_filled() {
        for backend in [Backend::Slurm, Backend::Kubernetes, Backend::Parallel, Backend::Local] {
            for file in submission(backend).files(&(0..32).collect::<Vec<_>>(), Path::new("/data/out/logs")) {
                assert!(!file.text.contains("{{") && !file.text.contains("}}"), "{backend}: {}", file.text);
                assert!(file.text.contains("/data/out"), "{backend}: {}", file.text);
            }
        }
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
        let text = &submission.files(&tasks, Path::new("/data/out/logs"))[0].text;
        assert!(text.contains("\n#SBATCH --array=3-5,24%4\n"), "{text}");
        assert!(text.contains("\n#SBATCH --partition=long\n"), "{text}");
        assert!(text.contains("\ncd '/data/it'\\''s here' || exit 74\n"), "{text}");
    }
}
