//! `graspmill submit`.

use std::{
    env, io,
    path::{Path, PathBuf},
    process::Stdio,
    time::Duration,
};

use serde::{Deserialize, Serialize};

use super::{
    args::{EngineName, JobArgs, SubmitArgs},
    estimate::{Costs, TimedJob},
    exit::{Exit, Failure},
    jobs,
    local_path::{absolute, in_shell},
    machine,
    printer::Printer,
    progress::duration_text,
};
use factory::{
    RunContext,
    cluster::{Backend, PodContainer, Resources, Submission, SubmissionFile, TaskPlan},
};
use format::dataset::{DatasetError, layout, read_mark, scan_shards};
use kernel::{
    files::{self, Bound, Folder, Temporary},
    words::{Show, counted, number_ranges},
};

/// Record of the submission, in the folder [`layout::CLUSTER`] with the scripts and [`LOGS`].
const RECORD: &str = "submit.json";
/// Folder of the tasks' output.
const LOGS: &str = "logs";

/// Report of a submission as JSON.
#[derive(Serialize)]
struct SubmitReport<'a> {
    submission: &'a Submission,
    /// The tasks in the array syntax of schedulers.
    array: String,
    files: Vec<PathBuf>,
    /// Job numbers of the array and of the merge in the engine.
    #[serde(skip_serializing_if = "Option::is_none")]
    sent: Option<Sent>,
}

#[derive(Serialize)]
struct Sent {
    tasks: String,
    merge: String,
}

/// Content of `submit.json`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Record {
    submission: Submission,
}

/// Whether the dataset in a folder was submitted.
pub fn submitted(out: &Folder) -> bool {
    out.subfolder(layout::CLUSTER).contains(RECORD)
}

/// A submitted dataset that no task has started.
#[derive(Serialize)]
pub struct Waiting {
    dataset: String,
    state: &'static str,
    /// The job's name.
    job: String,
    backend: Backend,
    tasks: u32,
    shards: u32,
    /// Command that starts the tasks, if they are not in a queue.
    #[serde(skip_serializing_if = "Option::is_none")]
    start: Option<String>,
}

impl Waiting {
    /// Reads the submission of a folder; `None` if there is none.
    pub fn read(out: &Folder) -> Result<Option<Self>, Failure> {
        if !submitted(out) {
            return Ok(None);
        }
        let submission = read_record(out)?;
        let scripts = out.subfolder(layout::CLUSTER);
        let files = submission.files(&[], &absolute(&scripts.path_of(LOGS))?);
        let files = files.map_err(|error| Failure::new(Exit::Failed, error))?;
        Ok(Some(Self {
            dataset: out.path().display().to_string(),
            state: "submitted",
            job: submission.name,
            backend: submission.backend,
            tasks: submission.plan.tasks,
            shards: submission.plan.shards,
            start: files.first().and_then(|file| start(submission.backend, &scripts.path_of(file.name))),
        }))
    }

    /// Text for people.
    pub fn words(&self) -> String {
        let Self { dataset, job, .. } = self;
        let (tasks, shards) = (counted(self.tasks.into(), "task"), counted(self.shards.into(), "shard"));
        let next = match &self.start {
            Some(command) => format!("if nothing is running, start it: {command}"),
            None => {
                let folder = in_shell(Path::new(dataset));
                format!("see the queue with squeue; if it is empty: graspmill submit --retry --out {folder}")
            }
        };
        format!("{dataset}: submitted; no task has started\n{tasks} for {shards}, job {job}\n{next}")
    }
}

/// Command that starts the tasks of a script; `None` if the engine already has them.
fn start(backend: Backend, script: &Path) -> Option<String> {
    match backend {
        Backend::Slurm => None,
        Backend::Kubernetes => Some(format!("kubectl apply -f {}", in_shell(script))),
        Backend::Parallel | Backend::Local => Some(format!("bash {}", in_shell(script))),
    }
}

/// Writes the scripts with which an engine makes a job's dataset; sends them if the engine is Slurm.
pub fn submit(arguments: &SubmitArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = arguments.out.subfolder(layout::CLUSTER);
    let (submission, tasks) = if arguments.retry { again(arguments)? } else { anew(arguments, printer)? };
    if tasks.is_empty() {
        printer.result(&format!(
            "{}: all {} shards are complete; finish the dataset: graspmill merge {}",
            arguments.out.path().shown(),
            submission.plan.shards,
            in_shell(arguments.out.path())
        ));
        return Ok(Exit::Complete);
    }
    let files = submission.files(&tasks, &absolute(&folder.path_of(LOGS))?);
    let files = files.map_err(|error| Failure::new(Exit::BadSpec, error))?;
    if arguments.print {
        printer.result(&files.iter().map(|file| file.text.as_str()).collect::<Vec<_>>().join("\n"));
        return Ok(Exit::Complete);
    }
    let written = write(&folder, &submission, &files)?;
    let sent = if submission.backend == Backend::Slurm { Some(send(&written)?) } else { None };
    let report = SubmitReport { submission: &submission, array: number_ranges(&tasks).join(","), files: written, sent };
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&words(&report, tasks.len()));
    }
    Ok(Exit::Complete)
}

/// Submission of a new job with all of its tasks.
fn anew(arguments: &SubmitArgs, printer: &Printer) -> Result<(Submission, Vec<u32>), Failure> {
    let (Some(job), Some(backend)) = (&arguments.job, arguments.backend) else {
        return Err(Failure::message(Exit::BadSpec, "give a job file and --backend, or --retry"));
    };
    let parallelism = machine::parallelism(None)?;
    let cancel = machine::cancel_on_signals()?;
    let text = jobs::text(&JobArgs { job: job.clone(), set: arguments.set.clone(), threads: None })?;
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &|_| {} };
    let job_to_send = TimedJob::open(&text, &context)?;
    let open = &job_to_send.open;
    if let Some(mark) = read_mark(&arguments.out)?
        && mark.job != open.digest
    {
        let (folder, found) = (arguments.out.path().to_owned(), mark.job);
        return Err(jobs::run_failure(DatasetError::ForeignJob { folder, found, expected: open.digest }.into()));
    }
    let cpus = arguments.cpus;
    let backend = match backend {
        EngineName::Slurm => Backend::Slurm,
        EngineName::Kubernetes => Backend::Kubernetes,
        EngineName::Parallel => Backend::Parallel,
        EngineName::Local => Backend::Local,
    };
    let container = container(arguments)?;
    // In a container, the image determines the path of the program.
    let program = if container.is_some() { "graspmill".into() } else { env::current_exe()? };
    let mut submission = Submission {
        backend,
        name: open.job.name.clone(),
        program,
        folder: env::current_dir()?,
        job: absolute(job)?,
        overrides: arguments.set.clone(),
        out: absolute(arguments.out.path())?,
        // Until the pilot has run.
        plan: TaskPlan::suggested(0.0, cpus, 1),
        resources: Resources { cpus, memory: arguments.memory, minutes: arguments.minutes.unwrap_or(0) },
        options: arguments.option.clone(),
        container,
    };
    // A name that a script must not contain is refused before the pilot, which takes seconds.
    let logs = absolute(&arguments.out.subfolder(layout::CLUSTER).path_of(LOGS))?;
    submission.check(&logs).map_err(|error| Failure::new(Exit::BadSpec, error))?;
    let costs = Costs::measure(job_to_send, &context)?;
    let mut plan = costs.tasks(cpus);
    if let Some(asked) = arguments.tasks {
        plan.tasks = asked.min(plan.shards.max(1));
        if plan.tasks < asked {
            printer.say(&format!("limited to {}, one per shard", counted(plan.tasks.into(), "task")));
        }
    }
    plan.at_once = arguments.at_once;
    let seconds = costs.task_seconds(&plan, cpus);
    let expected = duration_text(Duration::from_secs_f64(seconds));
    let processors = counted(cpus.into(), "processor");
    printer.say(&format!("about {expected} per task of {processors}, at this machine's speed"));
    if arguments.minutes.is_none() {
        submission.resources.minutes = ((4.0 * seconds / 60.0).ceil() as u32).max(60);
    }
    let tasks = (0..plan.tasks).collect();
    submission.plan = plan;
    Ok((submission, tasks))
}

fn container(arguments: &SubmitArgs) -> Result<Option<PodContainer>, Failure> {
    if arguments.backend != Some(EngineName::Kubernetes) {
        return Ok(None);
    }
    let claim = arguments.claim.as_deref().and_then(|claim| claim.split_once('='));
    let Some((image, (claim, mount))) = arguments.image.clone().zip(claim) else {
        return Err(Failure::message(Exit::BadSpec, "--claim: expected NAME=PATH, such as data=/data"));
    };
    Ok(Some(PodContainer { image, claim: claim.to_owned(), mount: mount.into() }))
}

/// Reads the earlier submission, and the tasks whose shards are missing.
fn again(arguments: &SubmitArgs) -> Result<(Submission, Vec<u32>), Failure> {
    let submission = read_record(&arguments.out)?;
    let Some(mark) = read_mark(&arguments.out)? else {
        let tasks = (0..submission.plan.tasks).collect();
        return Ok((submission, tasks));
    };
    let tasks = submission.tasks_of(&scan_shards(&arguments.out, &mark)?.missing(mark.shards));
    Ok((submission, tasks))
}

/// Reads the record of a submission.
fn read_record(out: &Folder) -> Result<Submission, Failure> {
    let folder = out.subfolder(layout::CLUSTER);
    let path = folder.path_of(RECORD);
    let text = folder.read(RECORD, Bound::SUBMISSION).map_err(|error| {
        // A dataset that was not submitted cannot be resubmitted: the argument is wrong.
        let is_absent = files::is_absent(&error);
        let out = in_shell(out.path());
        let what =
            format!("{}: no job was submitted to {out}; use `submit JOB --out {out} --backend ...`", path.shown());
        let error = anyhow::Error::new(error).context(what);
        if is_absent { Failure::new(Exit::BadSpec, error) } else { Failure::from(error) }
    })?;
    let Record { submission } = serde_json::from_slice(&text)
        .map_err(|error| Failure::message(Exit::Failed, format!("{}: {error}; submit the job again", path.shown())))?;
    Ok(submission)
}

/// Writes the scripts and the record; returns the paths of the scripts.
fn write(folder: &Folder, submission: &Submission, files: &[SubmissionFile]) -> Result<Vec<PathBuf>, Failure> {
    let logs = folder.subfolder(LOGS);
    let failed = |path: &Path| {
        let path = path.shown().to_string();
        move |error: io::Error| Failure::from(anyhow::Error::new(error).context(path))
    };
    logs.create().map_err(failed(logs.path()))?;
    let record = serde_json::to_string_pretty(&Record { submission: submission.clone() })? + "\n";
    let mut written = Vec::new();
    for (name, text) in files.iter().map(|file| (file.name, &file.text)).chain([(RECORD, &record)]) {
        let path = absolute(&folder.path_of(name))?;
        Temporary::write(folder, name, text.as_bytes()).map_err(failed(&path))?;
        written.push(path);
    }
    written.pop();
    Ok(written)
}

/// Sends the tasks and the merge that depends on them to Slurm.
fn send(files: &[PathBuf]) -> Result<Sent, Failure> {
    let [tasks, merge] = files else { unreachable!("Slurm receives two scripts") };
    let tasks = sbatch(&[tasks.as_os_str()])?;
    let dependency = format!("--dependency=afterok:{tasks}");
    let merge = sbatch(&[dependency.as_ref(), "--kill-on-invalid-dep=yes".as_ref(), merge.as_os_str()])?;
    Ok(Sent { tasks, merge })
}

/// Calls sbatch and returns the job number.
fn sbatch(arguments: &[&std::ffi::OsStr]) -> Result<String, Failure> {
    let failed = |why: String| {
        let message = format!(
            "sbatch: {why}; the scripts are written: submit them where Slurm is installed, first the tasks, then the merge"
        );
        Failure::message(Exit::Failed, message)
    };
    let mut sbatch = machine::program("sbatch").ok_or_else(|| failed("no such program on PATH".to_owned()))?;
    let output = sbatch.arg("--parsable").args(arguments).stdin(Stdio::null()).output();
    let output = output.map_err(|error| failed(error.to_string()))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(Failure::message(Exit::Failed, format!("sbatch: {}", said.trim())));
    }
    // `number;cluster` if there are several clusters.
    let printed = String::from_utf8_lossy(&output.stdout);
    Ok(printed.trim().split(';').next().unwrap_or_default().to_owned())
}

fn words(report: &SubmitReport, count: usize) -> String {
    let SubmitReport { submission, array, files, sent } = report;
    let TaskPlan { tasks, shards, .. } = submission.plan;
    let out = submission.out.shown();
    let mut lines = vec![format!(
        "{count} of {} ({array}) for {} of {out}",
        counted(tasks.into(), "task"),
        counted(shards.into(), "shard")
    )];
    lines.extend(files.iter().map(|file| format!("wrote {}", file.shown())));
    let command = files.first().and_then(|script| start(submission.backend, script));
    lines.extend(command.map(|command| format!("start it: {command}")));
    if let Some(Sent { tasks, merge }) = sent {
        lines.push(format!("sent: tasks {tasks}, then the merge {merge}"));
    }
    let out = in_shell(&submission.out);
    lines.push(format!(
        "progress: graspmill status {out}; to resubmit failed tasks: graspmill submit --retry --out {out}"
    ));
    lines.join("\n")
}
