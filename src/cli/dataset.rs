//! Verbs that look at a dataset: status, inspect, report, export, digest.

use std::{fmt, path::Path};

use serde::Serialize;

use super::{
    args::{DatasetArgs, DigestArgs, ExportArgs, ExportFormat, ReportArgs},
    exit::{Exit, Failure},
    printer::Printer,
    set,
    submit::submitted,
    words,
};
use crate::{
    dataset::{Manifest, Selection, SetTable, Split, read_mark, scan_shards},
    export::{self, ExportError, ExportSelection, Format},
    ids::{Product, ranges},
    release,
};

/// How far a dataset is.
#[derive(Serialize)]
pub struct Status {
    dataset: String,
    state: &'static str,
    product: Product,
    job: String,
    samples: u64,
    shards: u32,
    shards_done: usize,
    /// As schedulers write arrays: `3,17-19`.
    shards_missing: String,
    shards_bad: Vec<String>,
    /// Temporary files that somebody writes, as far as locks tell.
    at_work: usize,
    leftovers: usize,
    bytes: u64,
    root: Option<String>,
}

/// `graspmill status`: reads the folder alone.
pub fn status(arguments: &DatasetArgs, printer: &Printer) -> Result<Exit, Failure> {
    let folder = &arguments.dir;
    if let Some(table) = SetTable::read(folder)? {
        return set::status(arguments, &table, printer);
    }
    let status = status_of(folder)?.ok_or_else(|| Failure::no_dataset(folder))?;
    if arguments.json {
        printer.json(&status)?;
    } else {
        printer.result(&status_words(&status));
    }
    Ok(Exit::Complete)
}

/// How far the dataset in a folder is; `None` where none was begun.
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
        shards_missing: ranges(&missing),
        shards_bad: scan.bad.iter().map(|bad| format!("{}: {}", bad.path.display(), bad.problem)).collect(),
        at_work: scan.at_work.len(),
        leftovers: scan.leftovers.len(),
        bytes: scan.done.values().map(|shard| shard.bytes).sum(),
        root: manifest.filter(|_| complete).map(|manifest| manifest.root.hex()),
    }))
}

/// The same for people.
pub fn status_words(status: &Status) -> String {
    let mut lines = vec![
        format!("{}: {}", status.dataset, status.state),
        format!("{} of {} shards done, {:.1} MB", status.shards_done, status.shards, status.bytes as f64 / 1e6),
        format!("{} {} planned, job {}", status.samples, words::samples(status.product), status.job),
    ];
    lines.extend(status.shards_bad.iter().map(|bad| format!("bad: {bad}")));
    match &status.root {
        Some(root) => lines.push(format!("root {root}")),
        None if status.shards_missing.is_empty() => lines.push(format!("close it: graspmill merge {}", status.dataset)),
        None => {
            lines.push(format!("missing: shards {}", status.shards_missing));
            if status.at_work > 0 {
                lines.push(format!("{} being written", status.at_work));
            }
            lines.push(match submitted(Path::new(&status.dataset)) {
                true => format!("what failed, again: graspmill submit --retry --out {}", status.dataset),
                false => "run the job again to resume".to_owned(),
            });
        }
    }
    lines.join("\n")
}

/// `graspmill inspect`.
pub fn inspect(arguments: &DatasetArgs, printer: &Printer) -> Result<Exit, Failure> {
    set::refuse(&arguments.dir)?;
    match Manifest::read(&arguments.dir)?.product {
        Product::Completion => show(&release::inspect(&arguments.dir)?, arguments.json, printer),
        Product::Reachability => show(&release::inspect_reachability(&arguments.dir)?, arguments.json, printer),
        Product::Grasps => show(&release::inspect_grasps(&arguments.dir)?, arguments.json, printer),
        Product::Patches => show(&release::inspect_patches(&arguments.dir)?, arguments.json, printer),
    }
}

fn show(facts: &(impl Serialize + fmt::Display), json: bool, printer: &Printer) -> Result<Exit, Failure> {
    if json {
        printer.json(facts)?
    } else {
        printer.result(&facts.to_string())
    }
    Ok(Exit::Complete)
}

/// `graspmill report`.
pub fn report(arguments: &ReportArgs, printer: &Printer) -> Result<Exit, Failure> {
    set::refuse(&arguments.dir)?;
    let summary = release::report(&arguments.dir, arguments.out.as_deref())?;
    printer.result(&format!("{} ({:.1} MB)", summary.path.display(), summary.bytes as f64 / 1e6));
    Ok(Exit::Complete)
}

/// `graspmill export`.
pub fn export(arguments: &ExportArgs, printer: &Printer) -> Result<Exit, Failure> {
    set::refuse(&arguments.dir)?;
    let split = arguments.split.as_deref().map(|name| {
        let known = Split::ALL.map(Split::name).join(", ");
        Split::from_name(name)
            .ok_or_else(|| Failure::message(Exit::BadSpec, format!("--split {name}: no such split; one of {known}")))
    });
    let selection = ExportSelection {
        samples: Selection { split: split.transpose()?, subset: None },
        objects: arguments.object.clone(),
        limit: arguments.limit,
    };
    let format = match arguments.to {
        ExportFormat::Npy => Format::Npy { packed: !arguments.unpacked },
        ExportFormat::Parquet => Format::Parquet,
        ExportFormat::Webdataset => Format::Webdataset,
        ExportFormat::Binvox => Format::Binvox,
        ExportFormat::Pcd => Format::Pcd,
        ExportFormat::Graspit => Format::Graspit,
        ExportFormat::Mujoco => Format::Mujoco,
    };
    let summary = export::export(&arguments.dir, format, &arguments.out, &selection).map_err(export_failure)?;
    let what = match format {
        Format::Graspit => "poses",
        Format::Mujoco => "grasps",
        _ => "samples",
    };
    printer.result(&format!("{} {what} in {} files, in {}", summary.samples, summary.files, summary.folder.display()));
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
    let root = match SetTable::read(&arguments.dir)? {
        Some(table) => set::root(&arguments.dir, &table)?,
        None => Manifest::read(&arguments.dir)?.root.hex(),
    };
    printer.result(&root);
    Ok(Exit::Complete)
}
