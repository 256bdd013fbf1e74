//! Single bits flipped anywhere in datasets of every product: `verify` sees each.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use graspmill::{ids::Digest, seed::Stream};

use crate::{all_products, problems, run, verify};

/// No parts of the dataset: what is wrong with a preview is a note, and notes of a run stand in no digest.
const OUTSIDE: [&str; 2] = ["preview.mcap", "notes.json"];

#[test]
fn every_flipped_bit_of_a_hundred_is_caught() {
    flip(100, 1);
}

#[test]
#[ignore = "minutes: `make test-slow`"]
fn every_flipped_bit_of_a_thousand_is_caught() {
    flip(1000, 2);
}

/// Files of a folder, sorted, with their sizes.
fn files(folder: &Path) -> Vec<(PathBuf, u64)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => {
                let bytes = fs::metadata(&path).expect("facts").len();
                found.push((path, bytes));
            }
        }
    }
    found.sort();
    found
}

/// What caught a flip, in a few words.
fn caught_by(exit: i32, report: Option<&serde_json::Value>, said: &str) -> Option<&'static str> {
    let Some(report) = report else {
        assert!(exit != 0 && !said.contains("panicked"), "exit code {exit}: {said}");
        return Some(if said.contains("seal") { "the manifest's seal" } else { "the manifest is no manifest" });
    };
    let problems = problems(report);
    if exit == 0 {
        assert!(problems.is_empty());
        return None;
    }
    assert_eq!(exit, 4, "{problems:?}");
    let ways = [
        ("its content has changed", "digest of a file"),
        ("run.json", "run.json against manifest or job"),
        ("cut short", "digest of a file"),
    ];
    ways.iter()
        .find(|(words, _)| problems.iter().any(|problem| problem.contains(words)))
        .map(|(_, way)| *way)
        .or(Some("another check"))
}

/// Flips so many bits, one at a time: files in turn, then bits at random, so that small files get their share. No cheap ways
/// to cheat: each flip is undone by the saved bytes, and the datasets must be whole in the end.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn flip(count: u64, seed: u64) {
    let place = tempfile::tempdir().expect("a scratch folder");
    let mut datasets = all_products(place.path());
    // One more with refused samples and several shards.
    let rejecting = "objects = [{ built_in = [\"can-01\", \"mug-01\"] }]\nviews = { even = 4 }\n[grid]\nresolution = 12\n\
                     [gate]\nmin_partial_cells = 40\n[shards]\nsamples = 3\n[split]\nvalidation_models = 0\ntest_models = 0\n";
    datasets.push(("rejects", run(rejecting, place.path(), "rejects")));
    let all: Vec<(PathBuf, &str, PathBuf, u64)> = (datasets.iter())
        .flat_map(|(name, folder)| {
            files(folder).into_iter().map(|(file, bytes)| (folder.clone(), *name, file, bytes)).collect::<Vec<_>>()
        })
        .filter(|(_, _, _, bytes)| *bytes > 0)
        .collect();
    let mut stream = Stream::of_job(seed, b"", "flips");
    let mut table: BTreeMap<(String, &str), u64> = BTreeMap::new();
    let (mut missed, mut outside): (Vec<String>, BTreeMap<(String, bool), u64>) = Default::default();
    for turn in 0..count {
        let (folder, name, file, bytes) = &all[turn as usize % all.len()];
        let bit = stream.below(8 * bytes);
        let whole = fs::read(file).expect("a file");
        let mut damaged = whole.clone();
        damaged[(bit / 8) as usize] ^= 1 << (bit % 8);
        fs::write(file, &damaged).expect("a file");
        let (exit, report, said) = verify(folder, &[]);
        fs::write(file, &whole).expect("a file");
        let part = file.strip_prefix(folder).expect("in the folder").display().to_string();
        if OUTSIDE.contains(&part.as_str()) {
            assert_eq!(exit, 0, "{part} is no part of the dataset: {report:?}");
            let noted =
                report.as_ref().is_some_and(|report| report["notes"].as_array().is_some_and(|notes| !notes.is_empty()));
            *outside.entry((part, noted)).or_default() += 1;
            continue;
        }
        let kind = if part.starts_with("shards/") { "shards".to_owned() } else { part };
        match caught_by(exit, report.as_ref(), &said) {
            Some(way) => *table.entry((kind, way)).or_default() += 1,
            None => missed.push(format!("{name}/{kind}, bit {bit}")),
        }
    }
    println!("{count} flips over {} files of {} datasets", all.len(), datasets.len());
    for ((file, way), count) in &table {
        println!("{file:16} {way:36} {count:5}");
    }
    for ((file, noted), count) in &outside {
        let what = if *noted { "no part of the dataset: a note" } else { "no part of the dataset: not seen" };
        println!("{file:16} {what:36} {count:5}");
    }
    assert!(missed.is_empty(), "not caught: {missed:?}");
    for (name, folder) in &datasets {
        let (exit, report, said) = verify(folder, &[]);
        assert_eq!(exit, 0, "{name}: {report:?} {said}");
    }
}

#[test]
fn a_digest_has_one_spelling() {
    let digest = Digest::of(b"x").hex();
    assert!(Digest::from_hex(&digest).is_some());
    assert!(Digest::from_hex(&digest.to_uppercase()).is_none());
    assert!(Digest::from_hex(&format!("+{}", &digest[1..])).is_none());
}
