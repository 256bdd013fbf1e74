//! `graspmill verify`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{
    args::VerifyArgs,
    exit::{Exit, Failure},
    jobs::{self, run_failure},
    machine,
    printer::Printer,
};
use assets::MeshOrigin;
use factory::{
    Cancel, Parallelism, RunContext,
    job::{Job, JobText},
    run::{Regeneration, regenerate},
};
use format::dataset::{
    DatasetError, DatasetReader, Problem, VerifyLevel, VerifyOptions, VerifyReport, layout, read_mark,
    verify as check_dataset,
};
use kernel::{
    files::{FileRefusal, Folder},
    words::{Show, capped, counted, size_in_words},
};
use publish::{ReleaseCheck, check_release};
use tables::ParquetIndex;

/// Findings as JSON.
#[derive(Serialize)]
struct VerifyJson<'a> {
    dataset: String,
    intact: bool,
    root: String,
    root_calculated: Option<String>,
    shards: u32,
    intact_shards: u32,
    samples: u64,
    bytes: u64,
    payloads: u64,
    problems: Vec<String>,
    notes: Vec<String>,
    regenerated: Option<&'a Regeneration>,
    #[serde(skip_serializing_if = "Option::is_none")]
    release_files: Option<usize>,
}

/// Maximum number of problems, and of notes, in the text form.
const MOST_LINES: usize = 500;

/// Findings of the check of one dataset.
pub struct Checked<'a> {
    arguments: &'a VerifyArgs,
    folder: Folder,
    report: VerifyReport,
    regenerated: Option<Regeneration>,
    /// Check of a release, if the folder is one.
    release: Option<ReleaseCheck>,
    /// Exit code of the program for this dataset alone.
    pub exit: Exit,
}

/// Checks a dataset. With `--regenerate K`, makes K random samples again from the manifest alone and compares them.
pub fn verify(arguments: &VerifyArgs, printer: &Printer) -> Result<Exit, Failure> {
    let parallelism = machine::parallelism(None)?;
    let cancel = machine::cancel_on_signals()?;
    let checked = check(arguments, &arguments.dir, &parallelism, &cancel)?;
    if arguments.json {
        printer.json(&checked.json())?;
    } else {
        printer.result(&checked.words());
    }
    Ok(checked.exit)
}

/// Failure for damage to a table that all checks require, or for a link or a FIFO in its place: such damage is a finding.
pub fn damage(error: DatasetError) -> Failure {
    let is_finding = match &error {
        DatasetError::Invalid { .. } => true,
        DatasetError::Io { source, .. } => FileRefusal::find_in(source).is_some(),
        _ => false,
    };
    if is_finding { Failure::new(Exit::Mismatch, error) } else { error.into() }
}

/// Checks the dataset in a folder with the options of the arguments.
pub fn check<'a>(
    arguments: &'a VerifyArgs,
    folder: &Folder,
    parallelism: &Parallelism,
    cancel: &Cancel,
) -> Result<Checked<'a>, Failure> {
    let text = JobText::of_dataset(folder, &arguments.set);
    // The settings determine the rules of the records, so meshes need not be opened.
    let draft = text.as_ref().ok().and_then(|text| jobs::read(text, &BTreeMap::new()).ok());
    let options = VerifyOptions {
        level: VerifyLevel::Full,
        rules: draft.as_ref().map_or(&[], |draft| draft.work.rules.as_slice()),
        index: Some(&ParquetIndex),
        threads: parallelism.threads,
    };
    let mut report = check_dataset(folder, options, |_| {}).map_err(damage)?;
    // The shards of a small dataset do not show the planned samples per shard; its job states them, even if the inputs are
    // elsewhere.
    let stated = text.as_ref().ok().and_then(JobText::shard_samples);
    if let (Some(stated), Ok(Some(mark))) = (stated, read_mark(folder))
        && i64::from(mark.shard_samples) != stated
    {
        let what = format!("it states shards of {} samples, but job.toml states {stated}", mark.shard_samples);
        report.problems.push(Problem {
            file: layout::RUN.to_owned(),
            shard: None,
            location: String::new(),
            what,
            remedy: "delete it and `run` the job again: finished shards are kept",
        });
    }
    let release = check_release(folder).map_err(damage)?;
    if let Some(release) = &release {
        release.add_to(&mut report);
    }
    let mut regenerated = None;
    let whole = release.as_ref().is_none_or(|release| release.left_out.is_empty());
    if let (Some(count), true) = (arguments.regenerate, report.is_intact() && whole) {
        let context = RunContext { parallelism, cancel, listener: &|_| {} };
        let open = jobs::open(jobs::read(&text?, &BTreeMap::new())?, &context)?;
        let reader = DatasetReader::open(folder)?;
        if open.digest != reader.manifest().job {
            let others = changed_objects(&reader, &open.job)?;
            let what = match others.is_empty() {
                true => "its meshes, robot, hand or settings have changed".to_owned(),
                false => format!("files differ from those of the dataset: {}; restore the files", others.join(", ")),
            };
            let message = format!(
                "{}: {what}; the job digest here is {}, but the manifest states {}: samples cannot be made again here",
                folder.path_of(layout::JOB).shown(),
                open.digest.0.short(),
                reader.manifest().job.0.short()
            );
            return Err(Failure::message(Exit::Mismatch, message));
        }
        let made = regenerate(&reader, &open.job, &open.plan, count, arguments.seed, &context);
        regenerated = Some(made.map_err(run_failure)?);
    }
    let same = regenerated.as_ref().is_none_or(|regenerated| regenerated.differences.is_empty());
    let exit = if report.is_intact() && same { Exit::Complete } else { Exit::Mismatch };
    Ok(Checked { arguments, folder: folder.clone(), report, regenerated, release, exit })
}

/// Objects of the dataset that its job does not find here, or finds with different content; named by file if one was read.
fn changed_objects(reader: &DatasetReader, job: &Job) -> Result<Vec<String>, Failure> {
    let Some(divided) = job.divided() else { return Ok(Vec::new()) };
    let mut changed = Vec::new();
    for row in reader.assets()?.objects {
        let found = divided.objects.iter().find(|object| object.source.name == row.name);
        match found.map(|object| (object.id() == row.object, &object.source.origin)) {
            Some((true, _)) => {}
            Some((false, MeshOrigin::File(path))) => changed.push(path.display().to_string()),
            _ => changed.push(row.name),
        }
    }
    Ok(changed)
}

impl Checked<'_> {
    /// Findings as JSON.
    pub fn json(&self) -> impl Serialize + use<'_> {
        let report = &self.report;
        VerifyJson {
            dataset: self.folder.path().display().to_string(),
            intact: report.is_intact(),
            root: report.saved.hex(),
            root_calculated: report.calculated.map(|digest| digest.hex()),
            shards: report.checked.of_shards,
            intact_shards: report.intact_shards,
            samples: report.checked.samples,
            bytes: report.checked.bytes,
            payloads: report.payloads,
            problems: report.problems.iter().map(ToString::to_string).collect(),
            notes: report.notes.clone(),
            regenerated: self.regenerated.as_ref(),
            release_files: self.release.as_ref().map(|release| release.files),
        }
    }

    /// Findings as text.
    pub fn words(&self) -> String {
        let Self { arguments, folder, report, regenerated, release, .. } = self;
        let folder = folder.path().shown();
        let samples = report.product.samples.many;
        let problems = report.problems.iter().map(|problem| format!("problem: {}", problem.to_string().shown()));
        let notes = report.notes.iter().map(|note| format!("note: {}", note.shown()));
        let mut lines = capped(problems, MOST_LINES, "problems");
        lines.extend(capped(notes, MOST_LINES, "notes"));
        lines.push(format!(
            "{} of {} intact, {} {samples}, {} checked, {}",
            report.intact_shards,
            counted(report.checked.of_shards as u64, "shard"),
            report.checked.samples,
            counted(report.payloads, "payload"),
            size_in_words(report.checked.bytes)
        ));
        if let Some(release) = release {
            lines.push(format!("release: compared the SHA-256 of {} listed files", release.files));
        }
        if let Some(made) = regenerated {
            lines.extend(made.differences.iter().map(|difference| {
                format!("differs: sample {} ({}): {}", difference.sample, difference.id, difference.what)
            }));
            lines.push(regeneration_in_words(made, samples));
            lines.extend(platform_in_words(made));
        } else if arguments.regenerate.is_some() {
            lines.push(match report.is_intact() {
                true => {
                    "nothing was made again: a recipe contains no samples to compare with; run its job.toml".to_owned()
                }
                false => "nothing was made again: fix the problems first".to_owned(),
            });
        }
        let verdict = if report.is_intact() { "is intact" } else { "is NOT intact" };
        lines.push(format!("{folder} {verdict}, root {}", report.saved));
        lines.join("\n")
    }
}

/// Number of equal samples that bounds the share of differing ones by 1 % with 95 % confidence: 299, rounded up.
const SAMPLES_FOR_A_PERCENT: u64 = 300;

/// Text about samples that differ, and the conclusion about the others.
fn regeneration_in_words(made: &Regeneration, samples: &str) -> String {
    let Regeneration { samples: count, of_samples, differences, .. } = made;
    let differ = differences.len();
    if !differences.is_empty() {
        return format!("{differ} of {count} {samples} made again differ");
    }
    if count >= of_samples {
        return format!("0 of {count} {samples} made again differ: all were checked");
    }
    let bound = made.bound();
    let mut words = format!(
        "0 of {count} {samples} made again differ: with 95 % confidence less than {} of all {of_samples} do",
        percent_above(bound)
    );
    if bound > 0.01 {
        let more = SAMPLES_FOR_A_PERCENT.min(*of_samples);
        let reach = if more == *of_samples { "checks all of them" } else { "bounds them by 1 %" };
        words += &format!("; --regenerate {more} {reach}");
    }
    words
}

/// Note for samples that differ on another platform: which facts of the platform differ, and what they may explain.
fn platform_in_words(made: &Regeneration) -> Option<String> {
    if made.differences.is_empty() || made.platform.is_empty() {
        return None;
    }
    let either = |value: &Option<String>| value.as_deref().unwrap_or("none").to_owned();
    let facts =
        made.platform.iter().map(|(key, [there, here])| format!("{key} {}, here {}", either(there), either(here)));
    let facts: Vec<_> = facts.collect();
    Some(format!(
        "note: made on another platform ({}): numbers of class physics and colour are reproducible only on the same platform, those of class exact on all platforms",
        facts.join("; ")
    ))
}

/// A share in percent, rounded up, so that a bound stays one.
fn percent_above(share: f64) -> String {
    let (digits, steps) = if share >= 1e-3 { (1, 10.0) } else { (3, 1000.0) };
    format!("{:.digits$} %", (100.0 * share * steps - 1e-9).ceil() / steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use factory::run::Difference;

    #[test]
    fn a_bound_is_said_with_the_way_to_a_better_one() {
        let made = |samples, of_samples| Regeneration {
            samples,
            of_samples,
            differences: Vec::new(),
            platform: BTreeMap::new(),
        };
        let words = |samples, of_samples| regeneration_in_words(&made(samples, of_samples), "samples");
        assert_eq!(
            words(5, 13_068),
            "0 of 5 samples made again differ: with 95 % confidence less than 45.1 % of all 13068 do; --regenerate 300 \
             bounds them by 1 %"
        );
        assert_eq!(
            words(5, 36),
            "0 of 5 samples made again differ: with 95 % confidence less than 45.1 % of all 36 do; --regenerate 36 checks \
             all of them"
        );
        assert_eq!(
            words(1000, 13_068),
            "0 of 1000 samples made again differ: with 95 % confidence less than 0.3 % of all 13068 do"
        );
        assert_eq!(words(36, 36), "0 of 36 samples made again differ: all were checked");
        // The recommended number reaches the bound.
        assert!(made(SAMPLES_FOR_A_PERCENT, u64::MAX).bound() <= 0.01);
    }

    #[test]
    fn another_platform_is_named_where_samples_differ() {
        let difference = Difference { sample: 3, id: "a.3.0.0".to_owned(), what: "other bytes in scene".to_owned() };
        let platform = [("libmujoco".to_owned(), [Some("aa".to_owned()), Some("bb".to_owned())])];
        let mut made =
            Regeneration { samples: 5, of_samples: 40, differences: vec![difference], platform: platform.into() };
        let said = platform_in_words(&made).expect("a note");
        assert!(
            said.starts_with("note: made on another platform (libmujoco aa, here bb): numbers of class physics"),
            "{said}"
        );
        // Equal samples need no explanation, and an equal platform gives none.
        let differences = std::mem::take(&mut made.differences);
        assert_eq!(platform_in_words(&made), None);
        (made.differences, made.platform) = (differences, BTreeMap::new());
        assert_eq!(platform_in_words(&made), None);
    }
}
