//! `graspmill diff`.

use serde::Serialize;

use super::{
    args::DiffArgs,
    exit::{Exit, Failure},
    folder::refuse_set,
    printer::Printer,
};
use factory::job::{SettingDifference, setting_differences};
use format::dataset::{DatasetDifference, DatasetReader, ObjectDifference, Reason, SampleCounts, diff as compare};
use kernel::{
    files::Folder,
    ids::{Digest, ObjectId},
    words::Show,
};

/// Largest number of settings in the text form; the JSON contains all.
const MAX_SETTINGS: usize = 40;

/// Differences as JSON.
#[derive(Serialize)]
struct DiffJson<'a> {
    a: String,
    b: String,
    #[serde(flatten)]
    difference: &'a DatasetDifference,
    settings: &'a [SettingDifference],
}

/// `graspmill diff`: which samples differ, and why.
pub fn diff(arguments: &DiffArgs, printer: &Printer) -> Result<Exit, Failure> {
    let (a, b) = (&arguments.a, &arguments.b);
    refuse_set(a)?;
    refuse_set(b)?;
    let difference = compare(a, b)?;
    let texts = [DatasetReader::open(a)?.job_text()?, DatasetReader::open(b)?.job_text()?];
    let settings = setting_differences(&texts[0], &texts[1]).map_err(|problem| {
        Failure::message(Exit::Failed, format!("job.toml of one dataset is not valid TOML: {problem}"))
    })?;
    if arguments.json {
        let (a, b) = (a.path().display().to_string(), b.path().display().to_string());
        printer.json(&DiffJson { a, b, difference: &difference, settings: &settings })?;
    } else {
        printer.result(&text(a, b, &difference, &settings));
    }
    Ok(if difference.equal { Exit::Complete } else { Exit::Mismatch })
}

/// Differences as text.
fn text(a: &Folder, b: &Folder, difference: &DatasetDifference, settings: &[SettingDifference]) -> String {
    let DatasetDifference { both, appeared, vanished, channels, objects, examples, packaging, .. } = difference;
    let samples = difference.products[0].samples.many;
    let mut lines = vec![format!("a: {}", a.path().shown()), format!("b: {}", b.path().shown())];
    let SampleCounts { same, changed, now_rejected, now_kept, other_reason } = both;
    let counts = [
        (changed, "changed"),
        (now_rejected, "kept by a, rejected by b"),
        (now_kept, "rejected by a, kept by b"),
        (other_reason, "rejected by both, for different reasons"),
        (appeared, "in b alone"),
        (vanished, "in a alone"),
    ];
    let counts: Vec<String> =
        counts.iter().filter(|(count, _)| **count > 0).map(|(count, what)| format!(", {count} {what}")).collect();
    lines.push(format!("{samples}: {same} the same{}", counts.concat()));
    for (topic, counts) in channels {
        let parts = [(counts.changed, "changed"), (counts.only_a, "in a alone"), (counts.only_b, "in b alone")];
        let parts: Vec<String> =
            parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!(", {count} {what}")).collect();
        if !parts.is_empty() {
            lines.push(format!("{topic}: {} the same{}", counts.same, parts.concat()));
        }
    }
    lines.extend(difference.reasons.iter().map(reason_words));
    lines.extend(settings.iter().take(MAX_SETTINGS).map(|SettingDifference { key, a, b }| {
        let words = |value: &Option<String>| value.clone().unwrap_or_else(|| "nothing".to_owned());
        format!("setting {key}: {}, {}", words(a), words(b))
    }));
    if settings.len() > MAX_SETTINGS {
        lines.push(format!("and {} more settings (--json lists all)", settings.len() - MAX_SETTINGS));
    }
    lines.extend(objects.iter().map(|(name, object)| object_words(name, object, samples)));
    lines.extend(examples.iter().map(|example| format!("for example {example}")));
    lines.extend(packaging.iter().map(|packaging| format!("files: {packaging}")));
    lines.push(match difference.equal {
        true => format!("equal in content, root {}", difference.roots[0]),
        false => format!("they DIFFER, roots {} and {}", difference.roots[0], difference.roots[1]),
    });
    lines.join("\n")
}

fn reason_words(reason: &Reason) -> String {
    let either = |value: &Option<String>| value.clone().unwrap_or_else(|| "nothing".to_owned());
    match reason {
        Reason::Job { a, b } => format!("why: the jobs differ ({}, {})", a.short(), b.short()),
        Reason::Program { a, b } => format!("why: made by {a} and by {b}"),
        Reason::Platform { key, a, b } => format!("why: platform, {key}: {}, {}", either(a), either(b)),
        Reason::Class { class } => format!("numbers of class {class} differ"),
        Reason::Assets { names } => format!("why: other content of {}", names.join(", ")),
        Reason::File { word } => format!("the {word}s differ"),
    }
}

fn object_words(name: &str, object: &ObjectDifference, samples: &str) -> String {
    let short = |id: &ObjectId| Digest::short(&id.0);
    let what = match (&object.a, &object.b) {
        (Some(a), Some(b)) if a == b && object.facts.is_empty() => format!("the same content {}", short(a)),
        (Some(a), Some(b)) if a == b => {
            let facts: Vec<&str> = object.facts.iter().map(String::as_str).collect();
            format!("the same content {}, other {}", short(a), facts.join(", "))
        }
        (Some(a), Some(b)) => format!("other content: {}, {}", short(a), short(b)),
        (Some(a), None) => format!("in a alone ({})", short(a)),
        (None, Some(b)) => format!("in b alone ({})", short(b)),
        (None, None) => "unknown to both asset tables".to_owned(),
    };
    format!("{name}: {what}; {} {samples} differ", object.samples)
}
