//! Single bits flipped anywhere in datasets of every product: `verify` sees each.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use graspmill::{ids::Digest, seed::Stream};

use crate::{ABOUT, all_products, done, graspmill, problems, run, tree::tree, verify};

/// No parts of the dataset: what is wrong with a preview is a note, and notes of a run stand in no digest.
const OUTSIDE: [&str; 2] = ["preview.mcap", "notes.json"];

#[test]
fn every_flipped_bit_of_a_hundred_is_caught() {
    let place = tempfile::tempdir().expect("a scratch folder");
    flip(&datasets(place.path()), &OUTSIDE, 100, 1);
}

#[test]
#[ignore = "minutes: `make test-slow`"]
fn every_flipped_bit_of_a_thousand_is_caught() {
    let place = tempfile::tempdir().expect("a scratch folder");
    flip(&datasets(place.path()), &OUTSIDE, 1000, 2);
}

#[test]
#[ignore = "minutes: `make test-slow`"]
fn every_flipped_bit_of_a_release_is_caught() {
    let place = tempfile::tempdir().expect("a scratch folder");
    let release = release(place.path());
    // Nothing stands outside: documents, pictures, report, preview and notes are in the list of digests.
    flip(&[("release", release)], &[], 1000, 3);
}

/// Of every product, and one more with refused samples and several shards.
fn datasets(place: &Path) -> Vec<(&'static str, PathBuf)> {
    let mut datasets = all_products(place);
    let rejecting = "objects = [{ built_in = [\"can-01\", \"mug-01\"] }]\nviews = { even = 4 }\n[grid]\nresolution = 12\n\
                     [gate]\nmin_partial_cells = 40\n[shards]\nsamples = 3\n[split]\nvalidation_models = 0\ntest_models = 0\n";
    datasets.push(("rejects", run(rejecting, place, "rejects")));
    datasets
}

/// A release of pairs.
fn release(place: &Path) -> PathBuf {
    let job = "objects = [{ built_in = [\"can-01\", \"mug-01\"] }]\nviews = { even = 20 }\n[shards]\nsamples = 10\n";
    let (made, about, out) = (run(job, place, "made"), place.join("about.toml"), place.join("release"));
    fs::write(&about, ABOUT).expect("an about file");
    done(graspmill(&["release"]).arg(made).arg("--out").arg(&out).arg("--about").arg(about));
    out
}

/// What caught a flip, in a few words.
fn caught_by(exit: i32, report: Option<&serde_json::Value>, said: &str) -> Option<&'static str> {
    let Some(report) = report else {
        assert!((exit == 4 || said.contains("format")) && !said.contains("panicked"), "exit code {exit}: {said}");
        let ways = [("seal", "the manifest's seal"), ("manifest-sha256", "the list of digests is none")];
        let way = ways.iter().find(|(words, _)| said.contains(words));
        return Some(way.map_or("the manifest is no manifest", |(_, way)| way));
    };
    let problems = problems(report);
    if exit == 0 {
        assert!(problems.is_empty());
        return None;
    }
    assert_eq!(exit, 4, "{problems:?}");
    let ways = [
        ("saved digest", "digest of a file"),
        ("saved SHA-256", "SHA-256 of a file"),
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
fn flip(datasets: &[(&str, PathBuf)], outside_of_it: &[&str], count: u64, seed: u64) {
    let all: Vec<(PathBuf, &str, PathBuf, u64)> = (datasets.iter())
        .flat_map(|(name, folder)| {
            tree(folder)
                .into_iter()
                .map(|(file, content)| (folder.clone(), *name, folder.join(file), content.len() as u64))
                .collect::<Vec<_>>()
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
        if outside_of_it.contains(&part.as_str()) {
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
    for (name, folder) in datasets {
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
