//! `graspmill merge`.

use std::{
    collections::BTreeMap,
    thread,
    time::{Duration, Instant},
};

use super::{
    args::MergeArgs,
    exit::{Exit, Failure},
    folder::refuse_set,
    jobs::{self, run_failure},
    machine,
    printer::Printer,
    run::{add_views, show},
};
use factory::{Cancel, RunContext, RunError, job::JobText, run};
use format::dataset::{layout, listed_shards, read_mark, read_pending};
use kernel::{
    files::Folder,
    words::{Show, number_ranges},
};

/// Time between two checks of the folder.
const PAUSE: Duration = Duration::from_secs(2);

/// Finishes a dataset whose shards were made by tasks. Reads its `job.toml`; the original job file is not needed.
pub fn merge(arguments: &MergeArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = &arguments.dir;
    refuse_set(folder)?;
    let began = Instant::now();
    let parallelism = machine::parallelism(arguments.threads)?;
    let cancel = machine::cancel_on_signals()?;
    wait(folder, Duration::from_secs(60 * u64::from(arguments.wait)), &cancel, printer)?;
    let text = JobText::of_dataset(folder, &[]).map_err(|error| {
        let what =
            format!("{}: run `graspmill run --task` first, which writes it", folder.path_of(layout::JOB).shown());
        Failure::from(anyhow::Error::new(error).context(what))
    })?;
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &|_| {} };
    let open = jobs::open(jobs::read(&text, &BTreeMap::new())?, &context)?;
    let mut header = open.header(folder.path());
    if let Some(pending) = read_pending(folder)? {
        header.refused = pending.refused;
        header.warnings = pending.warnings;
    }
    let summary = run::merge(&open.task(&header, folder), &context).map_err(gap)?;
    add_views(folder, &open, &summary, &parallelism, began)?;
    show(folder, &parallelism, &summary, began.elapsed().as_secs_f64(), arguments.json, printer)
}

/// Waits until every shard has its file, checking only names; without time to wait, reports missing shards at once.
fn wait(folder: &Folder, patience: Duration, cancel: &Cancel, printer: &Printer) -> Result<(), Failure> {
    let began = Instant::now();
    let mut said = String::new();
    loop {
        // `None`: no task has started.
        let missing = match read_mark(folder)? {
            None => None,
            Some(mark) => {
                let there = listed_shards(folder)?;
                let missing: Vec<u32> = (0..mark.shards).filter(|shard| !there.contains(shard)).collect();
                if missing.is_empty() {
                    return Ok(());
                }
                Some((missing, mark.shards))
            }
        };
        if began.elapsed() >= patience {
            return Err(match missing {
                None => Failure::no_dataset(folder),
                Some((missing, shards)) => gap(RunError::Gap { missing, shards, bad: Vec::new() }),
            });
        }
        if cancel.is_cancelled() {
            return Err(run_failure(RunError::Interrupted));
        }
        let awaited = missing.map_or("the first task".to_owned(), |(missing, _)| format!("{} shards", missing.len()));
        if awaited != said {
            printer.say(&format!("waiting for {awaited}"));
            said = awaited;
        }
        thread::sleep(PAUSE);
    }
}

/// Adds to an error which shards are missing, and how to make them.
fn gap(error: RunError) -> Failure {
    let remedy = match &error {
        RunError::Gap { missing, shards, .. } => {
            let array = number_ranges(missing).join(",");
            format!(
                "; make them with a job array of --array={array} and `run --task env/{shards}`, or with `submit --retry`, or run the job again without --task"
            )
        }
        _ => return run_failure(error),
    };
    Failure::message(Exit::Failed, format!("{error}{remedy}"))
}
