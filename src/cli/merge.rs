//! `graspmill merge`.

use std::{
    path::Path,
    thread,
    time::{Duration, Instant},
};

use super::{
    args::MergeArgs,
    exit::{Exit, Failure},
    jobs::{self, OpenJob, run_failure},
    machine,
    printer::Printer,
    run::{add_views, show},
    set,
};
use crate::{
    dataset::{listed_shards, read_mark, read_pending},
    ids::ranges,
    job::JobText,
    run::{self, Cancel, Crew, RunError, RunTask},
};

/// Between two looks at the folder.
const PAUSE: Duration = Duration::from_secs(2);

/// Closes a dataset whose shards were made by tasks. Its `job.toml` says the rest; the job's own file is not needed.
pub fn merge(arguments: &MergeArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = &arguments.dir;
    set::refuse(folder)?;
    let began = Instant::now();
    let crew = Crew { threads: machine::threads(arguments.threads), level: machine::simd_level()? };
    let cancel = machine::cancel_on_signals()?;
    wait(folder, Duration::from_secs(60 * u64::from(arguments.wait)), &cancel, printer)?;
    let text = JobText::open(&folder.join("job.toml"), &[]).map_err(|error| {
        let told = format!("{}/job.toml: {error}; `run --task` writes it", folder.display());
        Failure::message(Exit::Failed, told)
    })?;
    let open = jobs::open_text(&text, None, &crew, &cancel, &|_| {})?;
    let OpenJob { job, plan, digest, sides } = &open;
    let mut header = run::dataset_header(job, sides.as_ref(), folder);
    if let Some(pending) = read_pending(folder)? {
        header.refused = pending.refused;
        header.warnings = pending.warnings;
    }
    let task = RunTask { job, plan, digest: *digest, header: &header, folder };
    let summary = run::merge(&task, &crew, &cancel, &|_| {}).map_err(gap)?;
    add_views(folder, &open, &summary, &crew, began)?;
    show(folder, &crew, &summary, began.elapsed().as_secs_f64(), arguments.json, printer)
}

/// Waits until every shard has its file, by their names alone; says at once what is missing where there is no time to wait.
fn wait(folder: &Path, patience: Duration, cancel: &Cancel, printer: &Printer) -> Result<(), Failure> {
    let began = Instant::now();
    let mut told = usize::MAX;
    loop {
        let mark = read_mark(folder)?;
        let missing: Vec<u32> = match &mark {
            Some(mark) => {
                let there = listed_shards(folder)?;
                (0..mark.shards).filter(|shard| !there.contains(shard)).collect()
            }
            None if patience.is_zero() => {
                let told = format!("{}: no dataset (no run.json)", folder.display());
                return Err(Failure::message(Exit::Failed, told));
            }
            None => vec![0],
        };
        if missing.is_empty() {
            return Ok(());
        }
        if began.elapsed() >= patience {
            let shards = mark.map_or(0, |mark| mark.shards);
            return Err(gap(RunError::Gap { missing, shards, bad: Vec::new() }));
        }
        if cancel.is_cancelled() {
            return Err(run_failure(RunError::Interrupted));
        }
        if missing.len() < told {
            told = missing.len();
            printer.say(&format!("waiting for {told} shards"));
        }
        thread::sleep(PAUSE);
    }
}

/// What is missing, and how to send for it.
fn gap(error: RunError) -> Failure {
    let remedy = match &error {
        RunError::Gap { missing, shards, .. } => {
            let array = ranges(missing);
            format!(
                "; make them with an array of --array={array} and `run --task env/{shards}`, or with `submit --retry`, or run the \
                 job again without --task"
            )
        }
        _ => return run_failure(error),
    };
    Failure::message(Exit::Failed, format!("{error}{remedy}"))
}
