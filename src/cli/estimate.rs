//! `graspmill estimate`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{
    args::EstimateArgs,
    exit::{Exit, Failure},
    jobs::{self, run_failure},
    machine,
    printer::Printer,
    progress::duration_text,
};
use factory::{
    Parallelism, RunContext,
    cluster::TaskPlan,
    job::Estimate,
    run::{OpenJob, PilotRate, pilot},
    work::{MeasuredCosts, WorkCosts},
};
use kernel::words::counted;

/// Samples of the pilot run.
const PILOT_SAMPLES: u64 = 1000;
/// Share of a sample's time that writing it takes on top of making it, by the `write` benches.
const WRITING: f64 = 0.15;

/// Estimate of a job, for machines.
#[derive(Serialize)]
struct EstimateJson {
    job: String,
    #[serde(flatten)]
    estimate: Estimate,
    core_hours: f64,
    threads: usize,
    /// Suggestions how to cut the work on a cluster.
    tasks: Vec<TaskSuggestion>,
    /// Rates on one thread.
    pilot: PilotRate,
    /// Processor time per sample that the pilot left out [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    left_out_seconds_per_sample: Option<f64>,
    refused_meshes: usize,
    /// Facts about the work of this product.
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

/// Size and cost of a job.
pub struct Costs {
    /// Counts, bytes, time.
    pub estimate: Estimate,
    /// Processor time of all of it [s].
    pub core_seconds: f64,
    /// Processor time of reading its meshes and making them ready, which every task pays [s].
    pub opening_seconds: f64,
    rate: PilotRate,
    /// Processor time per sample that the pilot left out [s].
    left_out_seconds: f64,
}

/// Says what a job would make and how long it would take here, from a pilot of a thousand samples.
pub fn estimate(arguments: &EstimateArgs, printer: &Printer) -> Result<Exit, Failure> {
    let parallelism = machine::parallelism(arguments.job.threads)?;
    let cancel = machine::cancel_on_signals()?;
    let text = jobs::text(&arguments.job)?;
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &|_| {} };
    let open = jobs::open_one(&text, &context)?;
    let costs = costs(&open, &context)?;
    if arguments.json {
        printer.json(&report(&open, &parallelism, &costs))?;
    } else {
        printer.result(&words(&open, &parallelism, &costs));
    }
    Ok(Exit::Complete)
}

/// Cost of a job on the threads of its context.
pub fn costs(open: &OpenJob, context: &RunContext<'_>) -> Result<Costs, Failure> {
    let OpenJob { job, plan, .. } = open;
    let RunContext { parallelism, cancel, .. } = *context;
    let WorkCosts { measured, left_out_seconds } = job.work.costs();
    let rate = match measured {
        Some(MeasuredCosts { sample_seconds, subject_seconds, sample_bytes }) => PilotRate {
            samples: 0,
            seconds_per_subject: subject_seconds,
            seconds_per_sample: sample_seconds,
            raw_bytes_per_sample: sample_bytes,
        },
        None => pilot(job, plan, PILOT_SAMPLES, parallelism.level, cancel).map_err(run_failure)?,
    };
    let subjects = job.work.subjects().len();
    let per_sample = rate.seconds_per_sample * (1.0 + WRITING) + left_out_seconds;
    let opening_seconds = subjects as f64 * rate.seconds_per_subject;
    let core_seconds = plan.samples as f64 * per_sample + 2.0 * opening_seconds;
    let wall = core_seconds / parallelism.threads as f64;
    let bytes = job.work.expected_bytes(rate.raw_bytes_per_sample);
    let rate_per_second = plan.samples as f64 / wall.max(f64::MIN_POSITIVE);
    let estimate = Estimate::new(subjects, plan.samples, plan.shards.len(), bytes, rate_per_second);
    Ok(Costs { estimate, core_seconds, opening_seconds, rate, left_out_seconds })
}

impl Costs {
    /// Best cut of the work into tasks of so many processors.
    pub fn tasks(&self, cpus: u16) -> TaskPlan {
        TaskPlan::suggested(self.core_seconds, cpus, self.estimate.shards as u32)
    }

    /// Time per task of `tasks` [s].
    pub fn task_seconds(&self, plan: &TaskPlan, cpus: u16) -> f64 {
        // The largest share: shards do not divide evenly.
        let shards = f64::from(plan.shards.div_ceil(plan.tasks)) / f64::from(plan.shards.max(1));
        (self.core_seconds * shards + self.opening_seconds) / f64::from(cpus)
    }
}

fn report(open: &OpenJob, parallelism: &Parallelism, costs: &Costs) -> impl Serialize {
    let Costs { estimate, core_seconds, rate, left_out_seconds, .. } = *costs;
    let job = &open.job;
    EstimateJson {
        job: open.digest.to_string(),
        estimate,
        core_hours: core_seconds / 3600.0,
        threads: parallelism.threads,
        tasks: suggestions(costs),
        pilot: rate,
        left_out_seconds_per_sample: (left_out_seconds > 0.0).then_some(left_out_seconds),
        refused_meshes: job.refused().len(),
        remarks: job.work.remarks(),
        figures: job.work.figures(),
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

fn words(open: &OpenJob, parallelism: &Parallelism, costs: &Costs) -> String {
    let (job, rate) = (&open.job, &costs.rate);
    let Estimate { subjects, samples, shards, bytes, seconds } = costs.estimate;
    let product = job.product();
    let left_out = match costs.left_out_seconds > 0.0 {
        true => format!(" and {:.0} ms that the pilot leaves out", 1e3 * costs.left_out_seconds),
        false => String::new(),
    };
    let tasks = match costs.tasks(1).tasks {
        1 => "one task is enough".to_owned(),
        _ => {
            let words = |TaskSuggestion { cpus, tasks, minutes }| {
                let (tasks_of, processors) =
                    (if tasks == 1 { "task" } else { "tasks" }, if cpus == 1 { "" } else { "s" });
                format!("{tasks} {tasks_of} of {cpus} processor{processors} and {} min", minutes.ceil())
            };
            suggestions(costs).into_iter().map(words).collect::<Vec<_>>().join(", or ")
        }
    };
    let source = if rate.samples > 0 {
        format!("over {} {}", rate.samples, product.samples.of(rate.samples))
    } else {
        "by constants".to_owned()
    };
    let mut lines = vec![
        format!(
            "{samples} {} of {subjects} {} in {shards} {}",
            product.samples.of(samples),
            product.subjects.of(subjects),
            if shards == 1 { "shard" } else { "shards" }
        ),
        format!("about {:.1} MB on disk", bytes / 1e6),
        format!(
            "about {} on {} threads here ({:.3} core-hours; {:.3} ms per {}{left_out}, {:.1} ms per {}, {source})",
            duration_text(std::time::Duration::from_secs_f64(seconds)),
            parallelism.threads,
            costs.core_seconds / 3600.0,
            1e3 * rate.seconds_per_sample,
            product.samples.one,
            1e3 * rate.seconds_per_subject,
            product.subjects.one,
        ),
        format!("on a cluster {tasks}"),
    ];
    lines.extend(job.work.remarks());
    if job.work.objects().is_some() {
        lines.push(format!("{} refused", counted(job.refused().len() as u64, "mesh")));
    }
    lines.push(format!("job {}", open.digest));
    lines.join("\n")
}
