//! `graspmill run --task`: one task's share of a dataset.

use std::{collections::BTreeMap, path::Path};

use serde::Serialize;

use super::{
    args::RunArgs,
    exit::{Exit, Failure},
    jobs::{self, run_failure},
    local_path::in_shell,
    machine,
    printer::Printer,
    progress::{ProgressView, rate_text},
};
use factory::{
    Event, RunContext,
    cluster::{TaskChoice, TaskFound},
    job::{JobSet, JobText},
    plan::Share,
    run::{ShareSummary, run_share},
};
use format::dataset::listed_shards;
use kernel::words::{Show, counted};

/// Report of a task as JSON.
#[derive(Serialize)]
struct TaskReport {
    dataset: String,
    task: u32,
    tasks: u32,
    /// Environment variable of the engine that selected the task.
    from: Option<String>,
    #[serde(flatten)]
    summary: ShareSummary,
    samples_per_second: f64,
    /// Shards of the dataset, and the number of finished ones, by their names.
    dataset_shards: usize,
    dataset_shards_there: usize,
    threads: usize,
    peak_memory_bytes: Option<u64>,
}

/// Makes one task's share of the shards. Refused meshes do not fail a task: the merge reports them.
pub fn run(arguments: &RunArgs, choice: TaskChoice, text: &JobText, printer: &Printer) -> Result<Exit, Failure> {
    if JobSet::is_one(text) {
        let message = format!(
            "{}: --task does not accept a set, whose datasets are made one after another; give one of its jobs",
            arguments.job.job.shown()
        );
        return Err(Failure::message(Exit::BadSpec, message));
    }
    let found = choice.find(&machine::variable).map_err(|error| Failure::new(Exit::BadSpec, error))?;
    let TaskFound { task, tasks, from } = &found;
    let share = Share::new(*task, *tasks).expect("a task that was found is one of them");
    let parallelism = machine::parallelism(arguments.job.threads)?;
    let cancel = machine::cancel_on_signals()?;
    printer.say(&found.to_string());
    let view = ProgressView::new(arguments.progress(), printer);
    let listener = |event: Event| view.show(printer, &event);
    let folder = &arguments.out;
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &listener };
    let open = jobs::open(jobs::read(text, &BTreeMap::new())?, &context)?;
    let made = run_share(&open.task(&open.header(folder.path()), folder), share, &context).map_err(run_failure);
    view.finish(printer, &made);
    let summary = made?;
    let report = TaskReport {
        dataset: folder.path().display().to_string(),
        task: *task,
        tasks: *tasks,
        from: from.clone(),
        summary,
        samples_per_second: if summary.made > 0 { summary.made as f64 / summary.seconds } else { 0.0 },
        dataset_shards: open.plan.shards.len(),
        dataset_shards_there: listed_shards(folder)?.len(),
        threads: parallelism.threads,
        peak_memory_bytes: machine::peak_memory(),
    };
    if arguments.json {
        printer.json(&report)?;
    } else {
        printer.result(&self::words(&report, open.job.product().samples.many));
    }
    Ok(Exit::Complete)
}

fn words(report: &TaskReport, samples: &str) -> String {
    let TaskReport { task, tasks, dataset, dataset_shards, dataset_shards_there, threads, .. } = report;
    let ShareSummary { shards, shards_before, made, seconds } = report.summary;
    let before = if shards_before > 0 { format!(" ({shards_before} of them before)") } else { String::new() };
    let there = match shards {
        1 => "its shard is complete".to_owned(),
        _ => format!("all of its {shards} shards are complete"),
    };
    let mut lines = vec![format!("task {task} of {tasks}: {there}{before}")];
    if made > 0 {
        let rate = rate_text(report.samples_per_second);
        lines.push(format!("{made} {samples} in {seconds:.1} s: {rate} {samples}/s on {threads} threads"));
    }
    let shards = counted(*dataset_shards as u64, "shard");
    lines.push(format!("{dataset_shards_there} of {shards} of {}", dataset.shown()));
    if dataset_shards_there == dataset_shards {
        lines.push(format!(
            "all shards are complete; finish the dataset: graspmill merge {}",
            in_shell(Path::new(dataset))
        ));
    }
    lines.join("\n")
}
