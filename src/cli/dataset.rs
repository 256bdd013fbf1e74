//! Verbs that read a dataset: status, inspect, report, export, digest.

use super::{
    args::{DatasetArgs, DigestArgs, ExportArgs, ReportArgs},
    exit::{Exit, Failure},
    folder::refuse_set,
    local_path::in_shell,
    machine,
    printer::Printer,
    submit::{Waiting, submitted},
};
use format::{
    Product,
    dataset::{Manifest, Selection, read_mark, scan_shards},
};
use kernel::words::{Split, counted, number_ranges, size_in_words};
use publish::{
    ReportSummary,
    export::{self, ExportError, ExportSelection},
};
use serde::Serialize;
use std::path::{self, Path};

/// Progress of a dataset.
#[derive(Serialize)]
pub struct Status {
    dataset: String,
    state: &'static str,
    product: Product,
    job: String,
    samples: u64,
    shards: u32,
    shards_done: usize,
    /// Missing shards as schedulers write arrays: `3,17-19`.
    shards_missing: String,
    shards_bad: Vec<String>,
    /// Temporary files that somebody writes, as far as locks show.
    at_work: usize,
    leftovers: usize,
    bytes: u64,
    root: Option<String>,
}

/// `graspmill status`: reads the folder alone.
pub fn status(arguments: &DatasetArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = &arguments.dir;
    let Some(status) = status_of(folder)? else {
        let waiting = Waiting::read(folder)?.ok_or_else(|| Failure::no_dataset(folder))?;
        return print(&waiting, waiting.words(), arguments, printer);
    };
    print(&status, status_words(&status), arguments, printer)
}

/// Prints progress as JSON or in words.
fn print(status: &impl Serialize, words: String, arguments: &DatasetArgs, printer: &Printer) -> Result<Exit, Failure> {
    if arguments.json {
        printer.json(status)?;
    } else {
        printer.result(&words);
    }
    Ok(Exit::Complete)
}

/// Progress of the dataset in a folder; `None` where none was begun.
pub fn status_of(folder: &Path) -> Result<Option<Status>, Failure> {
    let Some(mark) = read_mark(folder)? else { return Ok(None) };
    let scan = scan_shards(folder, &mark)?;
    let manifest = Manifest::read(folder).ok();
    let missing = scan.missing(mark.shards);
    let complete = manifest.is_some() && scan.done.len() == mark.shards as usize;
    Ok(Some(Status {
        dataset: folder.display().to_string(),
        state: match (complete, missing.is_empty()) {
            (true, _) => "complete",
            (false, true) => "all shards are there",
            (false, false) => "unfinished",
        },
        product: mark.product,
        job: mark.job.to_string(),
        samples: mark.samples,
        shards: mark.shards,
        shards_done: scan.done.len(),
        shards_missing: number_ranges(&missing).join(","),
        shards_bad: scan.bad.iter().map(|bad| format!("{}: {}", bad.path.display(), bad.problem)).collect(),
        at_work: scan.at_work.len(),
        leftovers: scan.leftovers.len(),
        bytes: scan.done.values().map(|shard| shard.bytes).sum(),
        root: manifest.filter(|_| complete).map(|manifest| manifest.root.hex()),
    }))
}

/// Progress in words, for people.
pub fn status_words(status: &Status) -> String {
    let mut lines = vec![
        format!("{}: {}", status.dataset, status.state),
        format!(
            "{} of {} done, {}",
            status.shards_done,
            counted(status.shards.into(), "shard"),
            size_in_words(status.bytes)
        ),
        format!("{} {} planned, job {}", status.samples, status.product.samples.many, status.job),
    ];
    let folder = in_shell(Path::new(&status.dataset));
    lines.extend(status.shards_bad.iter().map(|bad| format!("bad: {bad}")));
    match &status.root {
        Some(root) => lines.push(format!("root {root}")),
        None if status.shards_missing.is_empty() => lines.push(format!("close it: graspmill merge {folder}")),
        None => {
            lines.push(format!("missing: shards {}", status.shards_missing));
            if status.at_work > 0 {
                lines.push(format!("{} being written", status.at_work));
            }
            lines.push(match submitted(Path::new(&status.dataset)) {
                true => format!("what failed, again: graspmill submit --retry --out {folder}"),
                false => "run the job again to resume".to_owned(),
            });
        }
    }
    lines.join("\n")
}

/// `graspmill inspect`.
pub fn inspect(arguments: &DatasetArgs, printer: &Printer) -> Result<Exit, Failure> {
    refuse_set(&arguments.dir)?;
    let inspection = publish::inspect(&arguments.dir)?;
    if arguments.json {
        printer.json(&inspection)?;
    } else {
        printer.result(&inspection.to_string());
    }
    Ok(Exit::Complete)
}

/// `graspmill report`.
pub fn report(arguments: &ReportArgs, printer: &Printer) -> Result<Exit, Failure> {
    let summary = publish::report(&arguments.dir, arguments.out.as_deref())?;
    printer.result(&page_words(&summary));
    if arguments.open {
        show_page(&summary.path)?;
    }
    Ok(Exit::Complete)
}

/// A page that was written, in words.
pub fn page_words(summary: &ReportSummary) -> String {
    format!("{} ({})", summary.path.display(), size_in_words(summary.bytes))
}

/// Shows a page in the first program of `BROWSER` that starts, else by the desktop's own; does not wait until it is closed.
pub fn show_page(path: &Path) -> Result<(), Failure> {
    let shown = path::absolute(path).and_then(|path| {
        let browsers = machine::variable("BROWSER").unwrap_or_default();
        let mut browsers = browsers.split(':').filter(|browser| !browser.is_empty());
        if browsers.any(|browser| open::with_detached(&path, browser).is_ok()) {
            Ok(())
        } else {
            open::that_detached(&path)
        }
    });
    shown.map_err(|error| {
        let path = path.display();
        Failure::message(Exit::Failed, format!("{path}: no program to show it: {error}; open it in a browser"))
    })
}

/// `graspmill export`.
pub fn export(arguments: &ExportArgs, printer: &Printer) -> Result<Exit, Failure> {
    refuse_set(&arguments.dir)?;
    let split = arguments.split.as_deref().map(|name| {
        let known = Split::ALL.map(Split::name).join(", ");
        Split::from_name(name)
            .ok_or_else(|| Failure::message(Exit::BadSpec, format!("--split {name}: no such split; one of {known}")))
    });
    let selection = ExportSelection {
        samples: Selection { split: split.transpose()?, subset: None },
        objects: arguments.object.clone(),
        limit: arguments.limit,
        unpacked: arguments.unpacked,
        numbers: arguments.set.iter().cloned().collect(),
    };
    let format = arguments.to.0;
    let summary = export::export(&arguments.dir, format, &arguments.out, &selection).map_err(export_failure)?;
    let counted = summary.counted.of(summary.count);
    printer.result(&format!("{} {counted} in {} files, in {}", summary.count, summary.files, summary.folder.display()));
    Ok(Exit::Complete)
}

fn export_failure(error: ExportError) -> Failure {
    match &error {
        ExportError::Dataset(source) if !source.is_foreign() => Failure::from(error),
        ExportError::Io { .. } => Failure::new(Exit::InputOutput, error),
        _ => Failure::new(Exit::BadSpec, error),
    }
}

/// `graspmill digest`.
pub fn digest(arguments: &DigestArgs, printer: &Printer) -> Result<Exit, Failure> {
    printer.result(&Manifest::read(&arguments.dir)?.root.hex());
    Ok(Exit::Complete)
}
