//! `graspmill estimate`.

use std::{collections::BTreeMap, time::Duration};

use serde::Serialize;

use super::{
    args::EstimateArgs,
    exit::{Exit, Failure},
    jobs::{self, run_failure},
    machine,
    printer::Printer,
    progress::duration_text,
    run::MOST_WARNINGS,
};
use factory::{
    Parallelism, RunContext,
    cluster::TaskPlan,
    job::JobText,
    run::{Estimate, OpenJob, PilotLimits, PilotRate, pilot},
};
use kernel::words::{capped, counted, size_in_words};

/// Limits of the pilot run.
const PILOT: PilotLimits = PilotLimits { samples: 2000, time: Duration::from_secs(8) };

/// Estimate of a job as JSON.
#[derive(Serialize)]
struct EstimateJson {
    job: String,
    #[serde(flatten)]
    estimate: Estimate,
    core_hours: f64,
    threads: usize,
    /// Suggested divisions of the work on a cluster.
    tasks: Vec<TaskSuggestion>,
    pilot: PilotRate,
    refused_meshes: usize,
    warnings: Vec<String>,
    /// Remarks about the work for this product.
    remarks: Vec<String>,
    figures: BTreeMap<&'static str, f64>,
}

/// Tasks of about half an hour.
#[derive(Serialize)]
struct TaskSuggestion {
    cpus: u16,
    tasks: u32,
    /// Minutes per task.
    minutes: f64,
}

/// A job, its size and its cost.
pub struct Costs {
    /// The job.
    pub open: OpenJob,
    /// Counts, bytes, time.
    pub estimate: Estimate,
    rate: PilotRate,
}

/// Estimates from a pilot of a few samples what a job would make and how long it would take on this machine.
pub fn estimate(arguments: &EstimateArgs, printer: &Printer) -> Result<Exit, Failure> {
    let parallelism = machine::parallelism(arguments.job.threads)?;
    let cancel = machine::cancel_on_signals()?;
    let text = jobs::text(&arguments.job)?;
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &|_| {} };
    let costs = Costs::measure(TimedJob::open(&text, &context)?, &context)?;
    if arguments.json {
        printer.json(&report(&costs, &parallelism))?;
    } else {
        printer.result(&words(&costs, &parallelism));
    }
    Ok(if costs.open.job.refused().is_empty() { Exit::Complete } else { Exit::Refused })
}

/// An open job, and the processor time that opening took.
pub struct TimedJob {
    /// The job.
    pub open: OpenJob,
    opening: Duration,
}

impl TimedJob {
    /// Opens the job of one dataset and measures the processor time of opening.
    pub fn open(text: &JobText, context: &RunContext<'_>) -> Result<Self, Failure> {
        let began = machine::processor_time();
        let open = jobs::open_one(text, context)?;
        Ok(Self { open, opening: machine::processor_time() - began })
    }
}

impl Costs {
    /// Runs a pilot of a job on the threads of its context.
    pub fn measure(TimedJob { open, opening }: TimedJob, context: &RunContext<'_>) -> Result<Self, Failure> {
        let rate = pilot(&open, PILOT, context).map_err(run_failure)?;
        let estimate = Estimate::new(&open, opening, &rate, context.parallelism.threads);
        Ok(Self { open, estimate, rate })
    }

    /// Best division of the work into tasks with this number of processors.
    pub fn tasks(&self, cpus: u16) -> TaskPlan {
        TaskPlan::suggested(self.estimate.core_seconds, cpus, self.estimate.shards as u32)
    }

    /// Time per task of `plan` [s].
    pub fn task_seconds(&self, plan: &TaskPlan, cpus: u16) -> f64 {
        // The largest task counts: shards do not divide evenly.
        let shards = f64::from(plan.shards.div_ceil(plan.tasks)) / f64::from(plan.shards.max(1));
        (self.estimate.core_seconds * shards + self.estimate.opening_seconds) / f64::from(cpus)
    }
}

fn report(costs: &Costs, parallelism: &Parallelism) -> impl Serialize {
    let Costs { open, estimate, rate } = costs;
    EstimateJson {
        job: open.digest.to_string(),
        estimate: *estimate,
        core_hours: estimate.core_seconds / 3600.0,
        threads: parallelism.threads,
        tasks: suggestions(costs),
        pilot: *rate,
        refused_meshes: open.job.refused().len(),
        warnings: open.warnings(),
        remarks: open.job.work.remarks(),
        figures: open.job.work.figures(),
    }
}

/// Tasks of 1, 4 and 16 processors.
fn suggestions(costs: &Costs) -> Vec<TaskSuggestion> {
    let suggestion = |cpus: u16| {
        let plan = costs.tasks(cpus);
        TaskSuggestion { cpus, tasks: plan.tasks, minutes: costs.task_seconds(&plan, cpus) / 60.0 }
    };
    [1, 4, 16].map(suggestion).into()
}

fn words(costs: &Costs, parallelism: &Parallelism) -> String {
    let Costs { open, estimate, rate } = costs;
    let Estimate { subjects, samples, shards, bytes, core_seconds, seconds, .. } = *estimate;
    let product = open.job.product();
    let tasks = match costs.tasks(1).tasks {
        1 => "one task is enough".to_owned(),
        _ => {
            let words = |TaskSuggestion { cpus, tasks, minutes }| {
                let (tasks, cpus) = (counted(tasks.into(), "task"), counted(cpus.into(), "processor"));
                format!("{tasks} of {cpus} and {} min", minutes.ceil())
            };
            suggestions(costs).into_iter().map(words).collect::<Vec<_>>().join(", or ")
        }
    };
    let mut lines = vec![
        format!(
            "{samples} {} of {subjects} {} in {}",
            product.samples.for_count(samples),
            product.subjects.for_count(subjects),
            counted(shards, "shard")
        ),
        format!("about {} on disk, without preview and report", size_in_words(bytes as u64)),
        format!(
            "about {} on {} here ({:.3} core-hours; {:.3} ms per {}, {:.1} ms per {}, measured on {} {} in processor time)",
            duration_text(Duration::from_secs_f64(seconds)),
            counted(parallelism.threads as u64, "thread"),
            core_seconds / 3600.0,
            1e3 * rate.seconds_per_sample,
            product.samples.one,
            1e3 * rate.seconds_per_subject,
            product.subjects.one,
            rate.samples,
            product.samples.for_count(rate.samples),
        ),
        format!("on a cluster {tasks}"),
    ];
    lines.extend(open.job.work.remarks());
    let remarks = open.warnings();
    let remarks = remarks.iter().map(|remark| publish::remark_in_words(remark));
    lines.extend(capped(remarks, MOST_WARNINGS, "remarks"));
    lines.push(format!("job {}", open.digest));
    lines.join("\n")
}
