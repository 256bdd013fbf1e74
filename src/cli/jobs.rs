//! From a job file on the command line to a job with its plan, and the exit codes of errors on the way.

use std::{collections::BTreeMap, path::PathBuf};

use super::{
    args::JobArgs,
    exit::{Exit, Failure},
    machine,
    printer::Printer,
};
use factory::{
    ProduceError, RunContext, RunError,
    job::{self, JobContext, JobDraft, JobSet, JobText},
    run::{OpenError, OpenJob},
};
use form::FormErrors;
use kernel::words::Show;

/// Prints the JSON Schema of job files.
pub fn schema(printer: &Printer) -> Result<Exit, Failure> {
    printer.json(job::schema())?;
    Ok(Exit::Complete)
}

/// Reads the text of a job file or of a set.
pub fn text(arguments: &JobArgs) -> Result<JobText, Failure> {
    JobText::open(&arguments.job, &arguments.set).map_err(|error| {
        let error = anyhow::Error::new(error).context(arguments.job.shown().to_string());
        Failure::new(Exit::BadSpec, error)
    })
}

/// Reads the job of one dataset, prepares its meshes and makes the plan.
pub fn open_one(text: &JobText, context: &RunContext<'_>) -> Result<OpenJob, Failure> {
    if JobSet::is_one(text) {
        let message = format!("{} is a set of jobs, which only `run` accepts; give one of its jobs", text.label);
        return Err(Failure::message(Exit::BadSpec, message));
    }
    open(read(text, &BTreeMap::new())?, context)
}

/// Reads and checks a job file without opening its meshes. `inputs` are folders of datasets that replace those named in the file,
/// by the section that names each.
pub fn read(text: &JobText, inputs: &BTreeMap<String, PathBuf>) -> Result<JobDraft, Failure> {
    let context = JobContext { packages: machine::packages()?, ..JobContext::default() };
    JobDraft::read_with_inputs(text, inputs, &context).map_err(|errors| job_failure(&errors))
}

/// Prepares a job's meshes and makes its plan.
pub fn open(draft: JobDraft, context: &RunContext<'_>) -> Result<OpenJob, Failure> {
    if draft.work.draws_colours {
        machine::set_gl_environment()?;
    }
    OpenJob::resolve(draft, context).map_err(|error| match error {
        OpenError::Job(errors) => job_failure(&errors),
        OpenError::Run(error) => run_failure(error),
    })
}

/// Mistakes of a job as text.
pub fn job_failure(errors: &FormErrors) -> Failure {
    Failure::message(Exit::BadSpec, format!("\n{}", errors.render().trim_end()))
}

/// Exit code of a run that ended early.
pub fn run_failure(error: RunError) -> Failure {
    match &error {
        RunError::Interrupted => Failure::new(Exit::Interrupted, error),
        // The folder belongs to another job, or storing a sample or a table failed.
        RunError::Dataset(source) | RunError::Produce(ProduceError::Store(source)) if source.is_foreign() => {
            Failure::new(Exit::BadSpec, error)
        }
        RunError::WrongJob(_) => Failure::new(Exit::BadSpec, error),
        RunError::Dataset(_) | RunError::Produce(ProduceError::Store(_)) => Failure::from(error),
        RunError::Produce(_) | RunError::Panicked { .. } | RunError::Gap { .. } | RunError::Threads(_) => {
            Failure::new(Exit::Failed, error)
        }
    }
}
