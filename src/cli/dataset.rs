//! Commands that read a dataset: status, inspect, report, export, digest.

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
    dataset::{Manifest, Selection, layout, read_mark, scan_shards},
};
use kernel::{
    files::Folder,
    words::{Show, Split, capped, counted, number_ranges, size_in_words},
};
use publish::{
    ReportSummary,
    export::{self, ExportError, ExportSelection},
};
use serde::Serialize;
use std::{
    os::unix::process::CommandExt,
    path::{self, Path},
    process::Stdio,
};

/// Largest number of bad shards that the text form shows.
const MOST_BAD: usize = 50;

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
    /// Missing shards in the array syntax of schedulers: `3,17-19`.
    shards_missing: String,
    shards_bad: Vec<String>,
    /// Files among the shards whose names no run writes.
    shards_strange: Vec<String>,
    /// Temporary files that are being written, according to their locks.
    at_work: usize,
    leftovers: usize,
    bytes: u64,
    root: Option<String>,
}

/// `graspmill status`: reads only the folder.
pub fn status(arguments: &DatasetArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = &arguments.dir;
    let Some(status) = status_of(folder)? else {
        let waiting = Waiting::read(folder)?.ok_or_else(|| Failure::no_dataset(folder))?;
        return print(&waiting, waiting.words(), arguments, printer);
    };
    print(&status, status_words(folder, &status), arguments, printer)
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

/// Progress of the dataset in a folder; `None` if none was started.
pub fn status_of(folder: &Folder) -> Result<Option<Status>, Failure> {
    let Some(mark) = read_mark(folder)? else { return Ok(None) };
    let scan = scan_shards(folder, &mark)?;
    let manifest = Manifest::read(folder).ok();
    let missing = scan.missing(mark.shards);
    let complete = manifest.is_some() && scan.done.len() == mark.shards as usize;
    Ok(Some(Status {
        dataset: folder.path().display().to_string(),
        state: match (complete, missing.is_empty()) {
            (true, _) => "complete",
            (false, true) => "all shards are complete",
            (false, false) => "unfinished",
        },
        product: mark.product,
        job: mark.job.to_string(),
        samples: mark.samples,
        shards: mark.shards,
        shards_done: scan.done.len(),
        shards_missing: number_ranges(&missing).join(","),
        shards_bad: scan.bad.iter().map(ToString::to_string).collect(),
        shards_strange: scan.strange.clone(),
        at_work: scan.at_work.len(),
        leftovers: scan.leftovers.len(),
        bytes: scan.done.values().map(|shard| shard.bytes).sum(),
        root: manifest.filter(|_| complete).map(|manifest| manifest.root.hex()),
    }))
}

/// Progress as text.
pub fn status_words(folder: &Folder, status: &Status) -> String {
    let mut lines = vec![
        format!("{}: {}", folder.path().shown(), status.state),
        format!(
            "{} of {} done, {}",
            status.shards_done,
            counted(status.shards.into(), "shard"),
            size_in_words(status.bytes)
        ),
        format!("{} {} planned, job {}", status.samples, status.product.samples.many, status.job),
    ];
    lines.extend(capped(status.shards_bad.iter().map(|bad| format!("bad: {}", bad.shown())), MOST_BAD, "bad shards"));
    let strange = status
        .shards_strange
        .iter()
        .map(|name| format!("strange: {}/{}: not a file of this dataset; move it away", layout::SHARDS, name.shown()));
    lines.extend(capped(strange, MOST_BAD, "strange names"));
    let in_words = in_shell(folder.path());
    match &status.root {
        Some(root) => lines.push(format!("root {root}")),
        None if status.shards_missing.is_empty() => lines.push(format!("finish it: graspmill merge {in_words}")),
        None => {
            lines.push(format!("missing: shards {}", status.shards_missing));
            if status.at_work > 0 {
                lines.push(format!("{} being written", status.at_work));
            }
            lines.push(match submitted(folder) {
                true => format!("to resubmit failed tasks: graspmill submit --retry --out {in_words}"),
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
    if arguments.cover.is_some() {
        let message =
            format!("--cover: {} is a dataset; only the page of a set has a cover", arguments.dir.path().shown());
        return Err(Failure::message(Exit::BadSpec, message));
    }
    let summary = publish::report(&arguments.dir, arguments.out.as_deref())?;
    printer.result(&page_words(&summary));
    if arguments.open {
        show_page(&summary.path)?;
    }
    Ok(Exit::Complete)
}

/// Text about a written page.
pub fn page_words(summary: &ReportSummary) -> String {
    format!("{} ({})", summary.path.shown(), size_in_words(summary.bytes))
}

/// Desktop programs that open a file, with the arguments that precede it.
const DESKTOPS: [(&str, &[&str]); 5] =
    [("xdg-open", &[]), ("gio", &["open"]), ("gnome-open", &[]), ("kde-open", &[]), ("wslview", &[])];

/// Opens a page in the first program of `BROWSER` that starts, or else in the desktop's default; does not wait until it is
/// closed.
pub fn show_page(path: &Path) -> Result<(), Failure> {
    let path = path::absolute(path)?;
    let browsers = machine::variable("BROWSER").unwrap_or_default();
    let browsers = browsers.split(':').filter(|browser| !browser.is_empty()).map(|browser| (browser, &[][..]));
    if browsers.chain(DESKTOPS).any(|(program, arguments)| starts(program, arguments, &path)) {
        return Ok(());
    }
    let message = format!("{}: no program found to open it; open it in a browser", path.shown());
    Err(Failure::message(Exit::Failed, message))
}

/// Starts a program on a file, detached from this process.
fn starts(program: &str, arguments: &[&str], path: &Path) -> bool {
    let Some(mut command) = machine::program(program) else { return false };
    command.args(arguments).arg(path).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    // Desktop openers also read BROWSER, and resolve a relative path in it against the current folder.
    command.env_remove("BROWSER").current_dir("/");
    command.process_group(0).spawn().is_ok()
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
    let counted = summary.counted.for_count(summary.count);
    printer.result(&format!("{} {counted} in {} files, in {}", summary.count, summary.files, summary.folder.shown()));
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
