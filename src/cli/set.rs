//! Commands on sets: several datasets in one folder. Each command processes every dataset as it would a single one.

use std::{
    collections::BTreeMap,
    path::{self, PathBuf},
};

use serde::Serialize;

use super::{
    args::{DatasetArgs, ReportArgs, RunArgs, VerifyArgs},
    dataset,
    exit::{Exit, Failure},
    jobs,
    local_path::in_shell,
    machine,
    printer::Printer,
    progress::ProgressView,
    run, verify,
};
use factory::{
    Event, Leak, RunContext, RunError, find_leaks,
    job::{JobSet, JobText, SetMember},
};
use format::dataset::{DatasetError, SetContent, SetEntry, SetTable};
use kernel::{
    files::{self, Folder},
    words::{Show, counted},
};
use publish::Cover;

/// A set and the findings of a command about its datasets, as JSON.
#[derive(Serialize)]
struct SetJson<'a, T> {
    set: String,
    #[serde(flatten)]
    table: &'a SetTable,
    datasets: BTreeMap<String, T>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    problems: Vec<String>,
    /// Objects on two sides of the splits.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    leaks: Vec<Leak>,
}

/// Findings about a set as a whole, in addition to those about its datasets.
#[derive(Default)]
struct SetFindings {
    problems: Vec<String>,
    leaks: Vec<Leak>,
}

impl SetFindings {
    /// One line per finding.
    fn words(&self) -> impl Iterator<Item = String> + '_ {
        let problems = self.problems.iter().map(|problem| format!("problem: {}", problem.shown()));
        problems.chain(self.leaks.iter().map(|leak| format!("warning: {}", leak.to_string().shown())))
    }
}

/// Makes the datasets of a set one after another, or their missing parts.
pub fn run(arguments: &RunArgs, text: &JobText, printer: &Printer) -> Result<Exit, Failure> {
    let parallelism = machine::parallelism(arguments.job.threads)?;
    let set = JobSet::read(text).map_err(|errors| jobs::job_failure(&errors))?;
    // No dataset is started before every readable job is free of mistakes; the other jobs need datasets that are made first.
    let mut may_draw = false;
    for job in &set.jobs {
        may_draw |= match job.inputs.is_empty() {
            true => jobs::read(&job.text, &job_inputs(job, &arguments.out)?)?.work.draws_colours,
            false => true,
        };
    }
    // Drawing colours requires a restart of the program: now rather than between two datasets.
    if may_draw {
        machine::set_gl_environment()?;
    }
    let entry = |job: &SetMember| SetEntry { name: job.name.clone(), product: job.product };
    let mut table = SetTable::new(&set.name, set.jobs.iter().map(entry).collect());
    table.begin(&arguments.out).map_err(failure)?;
    let cancel = machine::cancel_on_signals()?;
    let (mut exit, mut texts, mut reports) = (Exit::Complete, Vec::new(), BTreeMap::new());
    for job in &set.jobs {
        let folder = arguments.out.subfolder(&job.name);
        let view = ProgressView::new(arguments.progress(), printer);
        view.name(printer, &job.name);
        let listener = |event: Event| view.show(printer, &event);
        let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &listener };
        let made = run::make(&job.text, &job_inputs(job, &arguments.out)?, &folder, &context);
        view.finish(printer, &made);
        let (summary, seconds) = made?;
        if run::exit_of(&summary.manifest) == Exit::Refused {
            exit = Exit::Refused;
        }
        texts.push(format!("{}\n{}", job.name, run::text(&folder, &parallelism, &summary, seconds)?));
        let report = serde_json::to_value(run::report(&folder, &parallelism, &summary, seconds)?)?;
        reports.insert(job.name.clone(), report);
    }
    table.finish(&arguments.out).map_err(failure)?;
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &|_| {} };
    let found = SetFindings { leaks: find_leaks(&arguments.out, &table, &context)?, ..SetFindings::default() };
    if arguments.json {
        show(&arguments.out, &table, reports, found, printer)?;
    } else {
        texts.extend(found.words());
        texts.extend(words(&arguments.out, &table));
        let folder = in_shell(arguments.out.path());
        printer.result(&format!("{}\nnext: graspmill report {folder}", texts.join("\n\n")));
    }
    Ok(exit)
}

/// Prints the progress of the datasets of a set.
pub fn status(arguments: &DatasetArgs, table: &SetTable, printer: &Printer) -> Result<Exit, Failure> {
    let (mut texts, mut found) = (Vec::new(), BTreeMap::new());
    for job in &table.jobs {
        let folder = arguments.dir.subfolder(&job.name);
        let status = dataset::status_of(&folder)?;
        let begun = status.as_ref().map(|status| dataset::status_words(&folder, status));
        texts.push(
            begun.unwrap_or_else(|| format!("{}: not started\nrun the set again to resume", folder.path().shown())),
        );
        found.insert(job.name.clone(), status);
    }
    if arguments.json {
        show(&arguments.dir, table, found, SetFindings::default(), printer)?;
    } else {
        texts.extend(words(&arguments.dir, table));
        printer.result(&texts.join("\n\n"));
    }
    Ok(Exit::Complete)
}

/// Checks every dataset of a set, and that `set.json` matches their content.
pub fn verify(arguments: &VerifyArgs, table: &SetTable, printer: &Printer) -> Result<Exit, Failure> {
    let parallelism = machine::parallelism(None)?;
    let cancel = machine::cancel_on_signals()?;
    let (mut exit, mut texts, mut reports) = (Exit::Complete, Vec::new(), BTreeMap::new());
    for job in &table.jobs {
        let checked = verify::check(arguments, &arguments.dir.subfolder(&job.name), &parallelism, &cancel)?;
        exit = if checked.exit == Exit::Complete { exit } else { checked.exit };
        texts.push(checked.words());
        reports.insert(job.name.clone(), serde_json::to_value(checked.json())?);
    }
    let mut found = SetFindings::default();
    let said = match SetContent::read(&arguments.dir, &table.jobs) {
        Ok(made) => table.made.as_ref() == Some(&made),
        // Problems of a dataset were reported.
        Err(_) => exit != Exit::Complete,
    };
    if !said {
        exit = Exit::Mismatch;
        found
            .problems
            .push("set.json does not match the content of the datasets; run the set again to rewrite it".to_owned());
    }
    if exit == Exit::Complete {
        let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &|_| {} };
        found.leaks = find_leaks(&arguments.dir, table, &context)?;
    }
    if arguments.json {
        show(&arguments.dir, table, reports, found, printer)?;
    } else {
        texts.extend(found.words());
        texts.extend(words(&arguments.dir, table));
        printer.result(&texts.join("\n\n"));
    }
    Ok(exit)
}

/// Writes the page of a set and those of its datasets.
pub fn report(arguments: &ReportArgs, table: &SetTable, printer: &Printer) -> Result<Exit, Failure> {
    let cover = arguments.cover.as_deref().map(|file| {
        let caption = arguments.cover_text.clone().unwrap_or_default();
        let cover = Cover::read(file, caption)
            .map_err(|error| anyhow::Error::new(error).context(format!("--cover {}", file.shown())));
        cover.map_err(Failure::of_input)
    });
    let summary = publish::report_set(&arguments.dir, table, arguments.out.as_deref(), cover.transpose()?.as_ref())?;
    let pages = summary.datasets.iter().chain([&summary.set]);
    printer.result(&pages.map(dataset::page_words).collect::<Vec<_>>().join("\n"));
    if arguments.open {
        dataset::show_page(&summary.set.path)?;
    }
    Ok(Exit::Complete)
}

/// Prints the root of a set whose datasets are all finished.
pub fn digest(folder: &Folder, table: &SetTable, printer: &Printer) -> Result<Exit, Failure> {
    let root = match &table.made {
        Some(made) => made.root,
        None => table.content(folder)?.root,
    };
    printer.result(&root.hex());
    Ok(Exit::Complete)
}

/// Folders of the datasets that a job of a set in a folder reads, by the section that names each.
fn job_inputs(job: &SetMember, folder: &Folder) -> Result<BTreeMap<String, PathBuf>, Failure> {
    let input = |(section, name): (&String, &String)| {
        // The job reads the dataset by its path, which must not point elsewhere.
        let member = folder.subfolder(name);
        member.names().map(drop).or_else(|error| if files::is_absent(&error) { Ok(()) } else { Err(error) })?;
        Ok((section.clone(), path::absolute(member.path())?))
    };
    job.inputs.iter().map(input).collect()
}

fn show<T: Serialize>(
    folder: &Folder,
    table: &SetTable,
    datasets: BTreeMap<String, T>,
    SetFindings { problems, leaks }: SetFindings,
    printer: &Printer,
) -> Result<(), Failure> {
    printer.json(&SetJson { set: folder.path().display().to_string(), table, datasets, problems, leaks })
}

/// Content of a finished set as text.
fn words(folder: &Folder, table: &SetTable) -> Option<String> {
    let made = table.made.as_ref()?;
    let mut first = format!("{}: {}", folder.path().shown(), counted(table.jobs.len() as u64, "dataset"));
    // Samples of scenes, and of products made from them, do not belong to one object.
    if !made.objects.is_empty() {
        let (objects, complete) = (made.objects.len(), made.complete_objects(&table.jobs));
        first += &format!(" of {objects} objects, {complete} of them with samples in every one");
    }
    let mut lines = vec![first];
    lines.extend(made.differing.iter().map(|name| {
        format!(
            "warning: `{}` is not the same object in all datasets: same name, different content (see set.json)",
            name.shown()
        )
    }));
    lines.push(format!("root {}", made.root));
    Some(lines.join("\n"))
}

fn failure(error: DatasetError) -> Failure {
    jobs::run_failure(RunError::Dataset(error))
}
