//! `graspmill run`.

use std::{collections::BTreeMap, path::Path, time::Instant};

use serde::Serialize;

use super::{
    args::RunArgs,
    exit::{Exit, Failure},
    jobs::{self, OpenJob, run_failure},
    machine,
    printer::Printer,
    progress::ProgressView,
    set, task, words,
};
use crate::{
    dataset::{Counts, GraspCounts, Manifest, NumberClass, PoseCounts, TypeCounts, layout},
    ids::{Digest, Product},
    job::{JobSet, JobText, Work},
    plan::Sides,
    release::{RunNotes, Speed, grasp_counts_in_words, pose_counts_in_words, types_in_words},
    run::{self, Cancel, Crew, Event, RunSummary},
};

/// What a run made, for machines.
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
    #[serde(skip_serializing_if = "Option::is_none")]
    poses: Option<&'a PoseCounts>,
    #[serde(skip_serializing_if = "Option::is_none")]
    grasps: Option<&'a GraspCounts>,
    #[serde(skip_serializing_if = "Option::is_none")]
    types: Option<&'a TypeCounts>,
    #[serde(skip_serializing_if = "Option::is_none")]
    poses_per_second: Option<f64>,
    threads: usize,
    simd: String,
    peak_memory_bytes: Option<u64>,
    warnings: &'a [String],
}

/// Makes a job's dataset, or what is missing of it; of a set every dataset.
pub fn run(arguments: &RunArgs, printer: &Printer) -> Result<Exit, Failure> {
    let text = jobs::text(&arguments.job)?;
    if let Some(choice) = arguments.task {
        return task::run(arguments, choice, &text, printer);
    }
    if JobSet::is_one(&text) {
        return set::run(arguments, &text, printer);
    }
    let crew = Crew { threads: machine::threads(arguments.job.threads), level: machine::simd_level()? };
    let cancel = machine::cancel_on_signals()?;
    let view = ProgressView::new(arguments.progress, printer);
    let made = make(&text, None, &arguments.out, &crew, &cancel, |event| view.show(printer, event));
    view.finish();
    let (summary, seconds) = made?;
    show(&arguments.out, &crew, &summary, seconds, arguments.json, printer)
}

/// Tells how a dataset was finished.
pub fn show(
    folder: &Path,
    crew: &Crew,
    summary: &RunSummary,
    seconds: f64,
    json: bool,
    printer: &Printer,
) -> Result<Exit, Failure> {
    if json {
        printer.json(&report(folder, crew, summary, seconds))?;
    } else {
        printer.result(&text(folder, crew, summary, seconds));
    }
    Ok(if summary.manifest.counts.refused_meshes > 0 { Exit::Refused } else { Exit::Complete })
}

/// Makes the dataset of a job in a folder, or what is missing of it, and says how long that took [s]. `grasps` is the dataset
/// that stands in for `grasps.dataset`.
pub fn make(
    text: &JobText,
    grasps: Option<&Path>,
    folder: &Path,
    crew: &Crew,
    cancel: &Cancel,
    show: impl Fn(&Event) + Sync,
) -> Result<(RunSummary, f64), Failure> {
    let listener = |event: Event| show(&event);
    let began = Instant::now();
    let open = jobs::open_text(text, grasps, crew, cancel, &listener)?;
    let summary = run::run(&open.task(&open.header(folder), folder), crew, cancel, &listener).map_err(run_failure)?;
    add_views(folder, &open, &summary, crew, began)?;
    Ok((summary, began.elapsed().as_secs_f64()))
}

/// Writes what stands beside a dataset: notes for its report, and the preview. Of one that was finished before what is missing,
/// for the run that finished it may have been killed before it came to this.
pub fn add_views(
    folder: &Path,
    open: &OpenJob,
    summary: &RunSummary,
    crew: &Crew,
    began: Instant,
) -> Result<(), Failure> {
    let OpenJob { job, sides, .. } = open;
    let (none, notes) = (RunNotes::default(), notes(crew, summary, sides.as_ref(), began));
    if !summary.finished_before || (notes != none && RunNotes::read(folder)? == none) {
        notes.write(folder)?;
    }
    if summary.finished_before && folder.join(layout::PREVIEW).exists() {
        return Ok(());
    }
    match &job.work {
        Work::Completion(completion) => run::preview(folder, completion, job.seed, crew),
        Work::Reachability(_) => run::map_preview(folder),
        Work::Grasps(_) => run::grasp_preview(folder),
        Work::Patches(_) => run::patch_preview(folder),
    }
    .map_err(run_failure)
}

/// What a report says about the run; part of no digest.
fn notes(crew: &Crew, summary: &RunSummary, sides: Option<&Sides>, began: Instant) -> RunNotes {
    let leaks = sides.into_iter().flat_map(|sides| sides.leaks.counts());
    RunNotes {
        speed: (summary.made > 0).then(|| Speed {
            samples: summary.made,
            seconds: began.elapsed().as_secs_f64(),
            threads: crew.threads as u32,
            peak_memory: machine::peak_memory(),
        }),
        leaks: leaks.map(|(name, count)| (name.to_owned(), count)).collect(),
    }
}

fn bytes(manifest: &Manifest) -> u64 {
    manifest.shards.iter().map(|shard| shard.bytes).sum()
}

/// The summary of a run, for machines.
pub fn report<'a>(folder: &Path, crew: &Crew, summary: &'a RunSummary, seconds: f64) -> impl Serialize + use<'a> {
    let RunSummary { finished_before, product, made, manifest, .. } = summary;
    let counts = &manifest.counts;
    RunReport {
        dataset: folder.display().to_string(),
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
        poses: counts.poses.as_ref(),
        grasps: counts.grasps.as_ref(),
        types: counts.types.as_ref(),
        poses_per_second: counts.poses.as_ref().map(|poses| poses_made(poses, counts, *made) / seconds),
        threads: crew.threads,
        simd: crew.level.to_string(),
        peak_memory_bytes: machine::peak_memory(),
        warnings: &manifest.warnings,
    }
}

/// The summary of a run, for people.
pub fn text(folder: &Path, crew: &Crew, summary: &RunSummary, seconds: f64) -> String {
    let RunSummary { finished_before, product, made, manifest, .. } = summary;
    let counts = &manifest.counts;
    let samples = words::samples(*product);
    let folder = folder.display();
    let mut lines = Vec::new();
    if *finished_before {
        lines.push(format!("{folder} is complete already: nothing to do"));
    }
    match &counts.poses {
        None => lines.push(samples_in_words(counts, samples)),
        Some(poses) => {
            lines.push(format!("{} poses at {} positions", poses.cells(), counts.samples));
            lines.extend(pose_counts_in_words(poses));
        }
    }
    lines.extend(counts.grasps.iter().map(grasp_counts_in_words));
    lines.extend(counts.types.iter().map(types_in_words));
    lines.push(format!("{} shards, {:.1} MB, in {folder}", manifest.shards.len(), bytes(manifest) as f64 / 1e6));
    if *made > 0 {
        let memory =
            machine::peak_memory().map_or_else(String::new, |bytes| format!(", {} MB at most", bytes / 1_000_000));
        let rate = match &counts.poses {
            None => format!("{:.0} {samples}/s", *made as f64 / seconds),
            Some(poses) => format!("{:.0} poses/s", poses_made(poses, counts, *made) / seconds),
        };
        let (threads, level) = (crew.threads, crew.level);
        lines.push(format!("{made} {samples} in {seconds:.1} s: {rate} on {threads} threads, {level}{memory}"));
    }
    if counts.refused_meshes > 0 {
        lines.push(format!("{} meshes were refused:", counts.refused_meshes));
    }
    lines.extend(manifest.warnings.iter().map(|warning| format!("warning: {warning}")));
    // Of one class alone, the root over all says it.
    if manifest.classes.len() > 1 {
        lines.extend(manifest.classes.iter().map(|(class, root)| format!("{} {root}", class.name())));
    }
    lines.push(format!("root {}", manifest.root));
    lines.join("\n")
}

fn samples_in_words(counts: &Counts, samples: &str) -> String {
    let rejects: Vec<String> = counts.rejected.iter().map(|(reason, count)| format!("{count} {reason}")).collect();
    let rejects = if rejects.is_empty() { String::new() } else { format!(" ({})", rejects.join(", ")) };
    format!(
        "{} {samples} of {} objects: {} kept, {} rejected{rejects}",
        counts.samples,
        counts.objects,
        counts.kept,
        counts.samples - counts.kept
    )
}

/// Poses of the positions that this run made: every position has as many.
fn poses_made(poses: &PoseCounts, counts: &Counts, made: u64) -> f64 {
    poses.cells() as f64 / counts.samples.max(1) as f64 * made as f64
}
