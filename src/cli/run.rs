//! `graspmill run`.

use std::{collections::BTreeMap, path::PathBuf, time::Instant};

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
    Event, Parallelism, RunContext,
    job::JobText,
    plan::{JobSplits, LeakReport},
    run::{OpenJob, RunSummary},
};
use format::{
    Noun, Product,
    dataset::{Counts, Manifest, layout},
};
use kernel::{
    files::{Bound, BoundedLines, Folder},
    ids::Digest,
    render::DepthSource,
    words::{NumberClass, Show, capped, counted, size_in_words},
};
use publish::{CountedParts, RunNotes, Speed, preview::PreviewError};

/// Maximum number of warnings in the text form.
pub const MOST_WARNINGS: usize = 100;

/// Report of a run as JSON.
#[derive(Serialize)]
struct RunReport<'a> {
    dataset: String,
    product: Product,
    root: String,
    classes: &'a BTreeMap<NumberClass, Digest>,
    finished_before: bool,
    samples: u64,
    kept: u64,
    rejected: u64,
    refused_meshes: u64,
    shards: usize,
    bytes: u64,
    made: u64,
    seconds: f64,
    samples_per_second: f64,
    /// Processor time of the program [s].
    core_seconds: f64,
    /// Sums of the product's facts, by name.
    facts: &'a BTreeMap<String, u64>,
    threads: usize,
    simd: String,
    peak_memory_bytes: Option<u64>,
    warnings: Vec<String>,
}

/// Makes the dataset of a job, or its missing shards.
pub fn run(arguments: &RunArgs, text: &JobText, printer: &Printer) -> Result<Exit, Failure> {
    let parallelism = machine::parallelism(arguments.job.threads)?;
    let cancel = machine::cancel_on_signals()?;
    let view = ProgressView::new(arguments.progress(), printer);
    let listener = |event: Event| view.show(printer, &event);
    let context = RunContext { parallelism: &parallelism, cancel: &cancel, listener: &listener };
    let made = make(text, &BTreeMap::new(), &arguments.out, &context);
    view.finish(printer, &made);
    let (summary, seconds) = made?;
    show(&arguments.out, &parallelism, &summary, seconds, arguments.json, printer)
}

/// Reports a finished dataset.
pub fn show(
    folder: &Folder,
    parallelism: &Parallelism,
    summary: &RunSummary,
    seconds: f64,
    json: bool,
    printer: &Printer,
) -> Result<Exit, Failure> {
    if json {
        printer.json(&report(folder, parallelism, summary, seconds)?)?;
    } else {
        let text = text(folder, parallelism, summary, seconds)?;
        printer.result(&format!("{text}\nnext: graspmill report {}", in_shell(folder.path())));
    }
    Ok(exit_of(&summary.manifest))
}

/// Exit code of a complete dataset. A dataset without a sample is useless, although nothing failed.
pub fn exit_of(manifest: &Manifest) -> Exit {
    let Counts { kept, refused_meshes, .. } = &manifest.counts;
    if *refused_meshes > 0 || *kept == 0 { Exit::Refused } else { Exit::Complete }
}

/// Warning if no sample was kept, with the reasons of rejects.
fn no_sample(folder: &Folder, manifest: &Manifest) -> Option<String> {
    let Counts { samples, kept: 0, rejected, .. } = &manifest.counts else { return None };
    let Noun { one, .. } = manifest.product.samples;
    let reasons: Vec<String> = rejected.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    let first = first_reject(folder).map(|detail| format!("; the first: {detail}")).unwrap_or_default();
    Some(format!("no {one} was kept: {samples} planned, all rejected ({}); change the job{first}", reasons.join(", ")))
}

/// Detail of the first rejected sample.
fn first_reject(folder: &Folder) -> Option<String> {
    let line = BoundedLines::new(folder.open(layout::REJECTS).ok()?, Bound::REJECTS_LINE).next()?.ok()?;
    let row: serde_json::Value = serde_json::from_slice(&line).ok()?;
    row["detail"].as_str().filter(|detail| !detail.is_empty()).map(str::to_owned)
}

/// Makes the dataset of a job in a folder, or its missing shards, and measures the time [s]. `inputs` are folders of datasets
/// that replace those named in the job file.
pub fn make(
    text: &JobText,
    inputs: &BTreeMap<String, PathBuf>,
    folder: &Folder,
    context: &RunContext<'_>,
) -> Result<(RunSummary, f64), Failure> {
    let began = Instant::now();
    let open = jobs::open(jobs::read(text, inputs)?, context)?;
    let summary = open.run(folder, context).map_err(run_failure)?;
    add_views(folder, &open, &summary, context.parallelism, began)?;
    Ok((summary, began.elapsed().as_secs_f64()))
}

/// Writes the side files of a dataset: notes for its report, and the preview. For a dataset that was already finished, writes
/// only missing ones: the run that finished it may have been killed before that.
pub fn add_views(
    folder: &Folder,
    open: &OpenJob,
    summary: &RunSummary,
    parallelism: &Parallelism,
    began: Instant,
) -> Result<(), Failure> {
    let OpenJob { job, splits, .. } = open;
    let (none, notes) = (RunNotes::default(), notes(parallelism, summary, splits.as_ref(), began));
    if !summary.finished_before || (notes != none && RunNotes::read(folder)? == none) {
        notes.write(folder)?;
    }
    if summary.finished_before && folder.contains(layout::PREVIEW) {
        return Ok(());
    }
    let mut source = job.work.depth_source(job.seed, parallelism.level).map_err(|error| run_failure(error.into()))?;
    let depth = source.as_mut().map(|source| &mut **source as &mut dyn DepthSource);
    publish::write_preview(folder, depth).map(|_| ()).map_err(preview_failure)
}

/// Exit code of a preview that could not be written.
pub fn preview_failure(error: PreviewError) -> Failure {
    match error {
        PreviewError::Dataset(error) => run_failure(error.into()),
        PreviewError::Depth(_) => Failure::new(Exit::Failed, error),
    }
}

/// Notes about the run for a report; not part of any digest.
fn notes(parallelism: &Parallelism, summary: &RunSummary, splits: Option<&JobSplits>, began: Instant) -> RunNotes {
    let of_splits = splits.map(|splits| &splits.leaks);
    let leaks = of_splits.into_iter().flat_map(LeakReport::counts);
    let intended = of_splits.and_then(LeakReport::intended);
    RunNotes {
        speed: (summary.made > 0).then(|| Speed {
            samples: summary.made,
            seconds: began.elapsed().as_secs_f64(),
            threads: parallelism.threads as u32,
            peak_memory: machine::peak_memory(),
        }),
        leaks: leaks.map(|(name, count)| (name.to_owned(), count)).collect(),
        intended: intended.into_iter().map(str::to_owned).collect(),
    }
}

fn bytes(manifest: &Manifest) -> u64 {
    manifest.shards.iter().map(|shard| shard.bytes).sum()
}

/// Summary of a run as JSON.
pub fn report<'a>(
    folder: &Folder,
    parallelism: &Parallelism,
    summary: &'a RunSummary,
    seconds: f64,
) -> Result<impl Serialize + use<'a>, Failure> {
    let RunSummary { finished_before, product, made, manifest, .. } = summary;
    let counts = &manifest.counts;
    Ok(RunReport {
        dataset: folder.path().display().to_string(),
        product: *product,
        root: manifest.root.hex(),
        classes: &manifest.classes,
        finished_before: *finished_before,
        samples: counts.samples,
        kept: counts.kept,
        rejected: counts.samples - counts.kept,
        refused_meshes: counts.refused_meshes,
        shards: manifest.shards.len(),
        bytes: bytes(manifest),
        made: *made,
        seconds,
        samples_per_second: *made as f64 / seconds,
        core_seconds: machine::processor_time().as_secs_f64(),
        facts: &counts.facts,
        threads: parallelism.threads,
        simd: parallelism.level.to_string(),
        peak_memory_bytes: machine::peak_memory(),
        warnings: manifest.warnings.iter().cloned().chain(publish::warnings(folder)?).collect(),
    })
}

/// Summary of a run as text.
pub fn text(
    dataset: &Folder,
    parallelism: &Parallelism,
    summary: &RunSummary,
    seconds: f64,
) -> Result<String, Failure> {
    let RunSummary { finished_before, product, made, manifest, .. } = summary;
    let counts = &manifest.counts;
    let samples = product.samples.many;
    let folder = dataset.path().shown();
    let mut lines = Vec::new();
    if *finished_before {
        lines.push(format!("{folder} is already complete: nothing to do"));
    }
    lines.extend(publish::counts_in_words(dataset)?);
    let shards = counted(manifest.shards.len() as u64, "shard");
    lines.push(format!("{shards}, {}, in {folder}", size_in_words(bytes(manifest))));
    if *made > 0 {
        let memory =
            machine::peak_memory().map_or_else(String::new, |bytes| format!(", peak memory {}", size_in_words(bytes)));
        let rate = *made as f64 / seconds;
        // Some products count parts of their samples, such as poses per position.
        let rate = match publish::counted_parts(manifest) {
            Some(CountedParts { noun, count }) => {
                let rate = rate * count as f64 / counts.samples.max(1) as f64;
                format!("{} {}/s", rate_text(rate), noun.many)
            }
            None => format!("{} {samples}/s", rate_text(rate)),
        };
        let (threads, level) = (parallelism.threads, parallelism.level);
        let threads = counted(threads as u64, "thread");
        lines.push(format!("{made} {samples} in {seconds:.1} s: {rate} on {threads}, {level}{memory}"));
    }
    if counts.refused_meshes > 0 {
        let were = if counts.refused_meshes == 1 { "was" } else { "were" };
        lines.push(format!("{} {were} refused:", counted(counts.refused_meshes, "mesh")));
    }
    let found = publish::warnings(dataset)?;
    let remarks = manifest.warnings.iter().cloned().chain(found).chain(no_sample(dataset, manifest));
    lines.extend(capped(remarks.map(|remark| publish::remark_in_words(&remark)), MOST_WARNINGS, "remarks"));
    // With one class only, the overall root is enough.
    if manifest.classes.len() > 1 {
        lines.extend(manifest.classes.iter().map(|(class, root)| format!("{} {root}", class.name())));
    }
    lines.push(format!("root {}", manifest.root));
    Ok(lines.join("\n"))
}
