//! Verbs that look at a dataset: status, inspect, report, export, digest.

use serde::Serialize;

use super::{
    args::{DatasetArgs, DigestArgs},
    exit::{Exit, Failure},
    printer::Printer,
};
use crate::dataset::{Manifest, read_mark, scan_shards};

/// How far a dataset is.
#[derive(Serialize)]
struct Status {
    dataset: String,
    state: &'static str,
    job: String,
    samples: u64,
    shards: u32,
    shards_done: usize,
    shards_bad: Vec<String>,
    leftovers: usize,
    bytes: u64,
    root: Option<String>,
}

/// `graspmill status`: reads the folder alone.
pub fn status(arguments: &DatasetArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = &arguments.dir;
    let mark = read_mark(folder)?
        .ok_or_else(|| Failure::message(Exit::Failed, format!("{}: no dataset (no run.json)", folder.display())))?;
    let scan = scan_shards(folder, &mark)?;
    let manifest = Manifest::read(folder).ok();
    let complete = manifest.is_some() && scan.done.len() == mark.shards as usize;
    let status = Status {
        dataset: folder.display().to_string(),
        state: if complete { "complete" } else { "unfinished" },
        job: mark.job.to_string(),
        samples: mark.samples,
        shards: mark.shards,
        shards_done: scan.done.len(),
        shards_bad: scan.bad.iter().map(|bad| format!("{}: {}", bad.path.display(), bad.problem)).collect(),
        leftovers: scan.leftovers.len(),
        bytes: scan.done.values().map(|shard| shard.bytes).sum(),
        root: manifest.filter(|_| complete).map(|manifest| manifest.root.hex()),
    };
    if arguments.json {
        printer.json(&status)?;
    } else {
        let mut lines = vec![
            format!("{}: {}", status.dataset, status.state),
            format!("{} of {} shards done, {:.1} MB", status.shards_done, status.shards, status.bytes as f64 / 1e6),
            format!("{} samples planned, job {}", status.samples, status.job),
        ];
        lines.extend(status.shards_bad.iter().map(|bad| format!("bad: {bad}")));
        match &status.root {
            Some(root) => lines.push(format!("root {root}")),
            None => lines.push("run the job again to resume".to_owned()),
        }
        printer.result(&lines.join("\n"));
    }
    Ok(Exit::Complete)
}

/// `graspmill digest`.
pub fn digest(arguments: &DigestArgs, printer: &Printer) -> Result<Exit, Failure> {
    printer.result(&Manifest::read(&arguments.dir)?.root.hex());
    Ok(Exit::Complete)
}
