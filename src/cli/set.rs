//! The verbs on sets: several datasets in one folder. Each does with every dataset what it does with one.

use std::{
    collections::BTreeMap,
    path::{self, Path},
};

use serde::Serialize;

use super::{
    args::{DatasetArgs, RunArgs, VerifyArgs},
    dataset,
    exit::{Exit, Failure},
    jobs, machine,
    printer::Printer,
    progress::ProgressView,
    run, verify,
};
use crate::{
    dataset::{DatasetError, SetContent, SetEntry, SetTable},
    job::{JobSet, JobText, SetMember},
    run::{Crew, RunError},
};

/// A set and what a verb found of its datasets, for machines.
#[derive(Serialize)]
struct SetJson<'a, T> {
    set: String,
    #[serde(flatten)]
    table: &'a SetTable,
    datasets: BTreeMap<String, T>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    problems: Vec<String>,
}

/// Makes the datasets of a set, one after another, or what is missing of them.
pub fn run(arguments: &RunArgs, text: &JobText, printer: &Printer) -> Result<Exit, Failure> {
    let crew = Crew { threads: machine::threads(arguments.job.threads), level: machine::simd_level()? };
    let set = JobSet::read(text).map_err(|errors| jobs::job_failure(&errors))?;
    // Colours want the program to start again: rather now than between two datasets.
    #[cfg(feature = "sim")]
    if set.jobs.iter().any(|job| job.product == crate::ids::Product::Patches) {
        machine::set_gl_environment()?;
    }
    // Nothing is begun before every job that can be read is free of mistakes; the others need what is made on the way.
    for job in set.jobs.iter().filter(|job| job.grasps.is_none()) {
        jobs::read(&job.text, None)?;
    }
    let entry = |job: &SetMember| SetEntry { name: job.name.clone(), product: job.product };
    let mut table = SetTable::new(&set.name, set.jobs.iter().map(entry).collect());
    table.begin(&arguments.out).map_err(failure)?;
    let cancel = machine::cancel_on_signals()?;
    let (mut exit, mut texts, mut reports) = (Exit::Complete, Vec::new(), BTreeMap::new());
    for job in &set.jobs {
        let folder = arguments.out.join(&job.name);
        let grasps = job.grasps.as_ref().map(|grasps| path::absolute(arguments.out.join(grasps))).transpose()?;
        let view = ProgressView::new(arguments.progress, printer);
        view.name(printer, &job.name);
        let made = run::make(&job.text, grasps.as_deref(), &folder, &crew, &cancel, |event| view.show(printer, event));
        view.finish();
        let (summary, seconds) = made?;
        if summary.manifest.counts.refused_meshes > 0 {
            exit = Exit::Refused;
        }
        texts.push(format!("{}\n{}", job.name, run::text(&folder, &crew, &summary, seconds)));
        let report = serde_json::to_value(run::report(&folder, &crew, &summary, seconds))?;
        reports.insert(job.name.clone(), report);
    }
    table.finish(&arguments.out).map_err(failure)?;
    if arguments.json {
        show(&arguments.out, &table, reports, Vec::new(), printer)?;
    } else {
        texts.extend(words(&arguments.out, &table));
        printer.result(&texts.join("\n\n"));
    }
    Ok(exit)
}

/// How far the datasets of a set are.
pub fn status(arguments: &DatasetArgs, table: &SetTable, printer: &Printer) -> Result<Exit, Failure> {
    let (mut texts, mut found) = (Vec::new(), BTreeMap::new());
    for job in &table.jobs {
        let folder = arguments.dir.join(&job.name);
        let status = dataset::status_of(&folder)?;
        let begun = status.as_ref().map(dataset::status_words);
        texts.push(begun.unwrap_or_else(|| format!("{}: not begun\nrun the set again to resume", folder.display())));
        found.insert(job.name.clone(), status);
    }
    if arguments.json {
        show(&arguments.dir, table, found, Vec::new(), printer)?;
    } else {
        texts.extend(words(&arguments.dir, table));
        printer.result(&texts.join("\n\n"));
    }
    Ok(Exit::Complete)
}

/// Checks every dataset of a set, and that `set.json` says what they hold.
pub fn verify(arguments: &VerifyArgs, table: &SetTable, printer: &Printer) -> Result<Exit, Failure> {
    let crew = Crew { threads: machine::threads(None), level: machine::simd_level()? };
    let cancel = machine::cancel_on_signals()?;
    let (mut exit, mut texts, mut reports) = (Exit::Complete, Vec::new(), BTreeMap::new());
    for job in &table.jobs {
        let checked = verify::check(arguments, &arguments.dir.join(&job.name), &crew, &cancel)?;
        exit = if checked.exit == Exit::Complete { exit } else { checked.exit };
        texts.push(checked.words());
        reports.insert(job.name.clone(), serde_json::to_value(checked.json())?);
    }
    let mut problems = Vec::new();
    let said = match SetContent::of(&arguments.dir, &table.jobs) {
        Ok(made) => table.made.as_ref() == Some(&made),
        // What is wrong with a dataset was reported.
        Err(_) => exit != Exit::Complete,
    };
    if !said {
        exit = Exit::Mismatch;
        problems.push("set.json does not say what its datasets hold; run the set again to write it anew".to_owned());
    }
    if arguments.json {
        show(&arguments.dir, table, reports, problems, printer)?;
    } else {
        texts.extend(problems.iter().map(|problem| format!("problem: {problem}")));
        texts.extend(words(&arguments.dir, table));
        printer.result(&texts.join("\n\n"));
    }
    Ok(exit)
}

/// Refuses the folder of a set where a verb wants one dataset.
pub fn refuse(folder: &Path) -> Result<(), Failure> {
    let Some(table) = SetTable::read(folder)? else { return Ok(()) };
    let names: Vec<&str> = table.jobs.iter().map(|job| job.name.as_str()).collect();
    let told = format!("{}: a set of datasets; give one of {} in it", folder.display(), names.join(", "));
    Err(Failure::message(Exit::BadSpec, told))
}

/// The root of a set whose datasets are all finished.
pub fn root(folder: &Path, table: &SetTable) -> Result<String, Failure> {
    let unfinished = || Failure::from(DatasetError::Unfinished { folder: folder.to_owned() });
    table.made.as_ref().map(|made| made.root.hex()).ok_or_else(unfinished)
}

fn show<T: Serialize>(
    folder: &Path,
    table: &SetTable,
    datasets: BTreeMap<String, T>,
    problems: Vec<String>,
    printer: &Printer,
) -> Result<(), Failure> {
    printer.json(&SetJson { set: folder.display().to_string(), table, datasets, problems })
}

/// What a finished set holds.
fn words(folder: &Path, table: &SetTable) -> Option<String> {
    let made = table.made.as_ref()?;
    let mut lines = vec![format!(
        "{}: {} datasets of {} objects, {} of them with samples in every one",
        folder.display(),
        table.jobs.len(),
        made.objects.len(),
        made.complete_objects(&table.jobs)
    )];
    lines.extend(made.differing.iter().map(|name| {
        format!(
            "warning: `{name}` is not the same object in all datasets: same name, other content (set.json has both)"
        )
    }));
    lines.push(format!("root {}", made.root));
    Some(lines.join("\n"))
}

fn failure(error: DatasetError) -> Failure {
    jobs::run_failure(RunError::Dataset(error))
}
