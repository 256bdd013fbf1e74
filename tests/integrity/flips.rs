//! Single bits flipped anywhere in datasets of every product: `verify` sees each.

use std::{collections::BTreeMap, fs, path::PathBuf};

use graspmill::{ids::Digest, seed::Stream};

use crate::integrity::verification::Verification;
use crate::support::{
    files::read_tree,
    jobs::{ABOUT, NO_SPLIT, copy_small_datasets},
    program::Program,
    workspace::Workspace,
};

/// Files that are not part of the dataset: damage of a preview is a note, and no digest covers notes of a run.
const OUTSIDE: [&str; 2] = ["preview.mcap", "notes.json"];

#[test]
fn every_flipped_bit_of_a_hundred_is_caught() {
    let workspace = Workspace::new();
    flip(&make_datasets(&workspace), &OUTSIDE, 100, 1);
}

#[test]
#[ignore = "minutes: `make test-all`"]
fn every_flipped_bit_of_a_thousand_is_caught() {
    let workspace = Workspace::new();
    flip(&make_datasets(&workspace), &OUTSIDE, 1000, 2);
}

#[test]
#[ignore = "minutes: `make test-all`"]
fn every_flipped_bit_of_a_release_is_caught() {
    let workspace = Workspace::new();
    let release = make_release(&workspace);
    // No file is outside: documents, pictures, report, preview and notes are in the list of digests.
    flip(&[("release", release)], &[], 1000, 3);
}

/// Datasets of every product, and one more with refused samples and several shards.
fn make_datasets(workspace: &Workspace) -> Vec<(&'static str, PathBuf)> {
    let mut datasets = copy_small_datasets(workspace);
    let rejecting = format!(
        "objects = [{{ built_in = [\"can-01\", \"mug-01\"] }}]\nviews = {{ even = 4 }}\n[grid]\nresolution = 12\n\
         [gate]\nmin_partial_cells = 40\n[shards]\nsamples = 3\n{NO_SPLIT}"
    );
    datasets.push(("rejects", workspace.make_dataset("rejects", &rejecting, &[])));
    datasets
}

/// A release of pairs.
fn make_release(workspace: &Workspace) -> PathBuf {
    let job = "objects = [{ built_in = [\"can-01\", \"mug-01\"] }]\nviews = { even = 20 }\n[shards]\nsamples = 10\n";
    let (data, out) = (workspace.make_dataset("data", job, &[]), workspace.path("release"));
    let about = workspace.write("about.toml", ABOUT);
    Program::on("release", data).option("--out", &out).option("--about", about).succeed();
    out
}

/// The check that found a flip, in a few words.
fn name_check(verification: &Verification) -> Option<&'static str> {
    let Verification { code, report, stderr: said } = verification;
    if report.is_null() {
        assert!((*code == 4 || said.contains("format")) && !said.contains("panicked"), "exit code {code}: {said}");
        let signs = [("seal", "the manifest's seal"), ("manifest-sha256", "the list of digests is damaged")];
        let sign = signs.iter().find(|(words, _)| said.contains(words));
        return Some(sign.map_or("the manifest is no manifest", |(_, sign)| sign));
    }
    let problems = verification.problems();
    if *code == 0 {
        assert!(problems.is_empty());
        return None;
    }
    assert_eq!(*code, 4, "{problems:?}");
    let signs = [
        ("saved digest", "digest of a file"),
        ("listed SHA-256", "SHA-256 of a file"),
        ("run.json", "run.json against manifest or job"),
        ("cut short", "digest of a file"),
    ];
    signs
        .iter()
        .find(|(words, _)| problems.iter().any(|problem| problem.contains(words)))
        .map(|(_, sign)| *sign)
        .or(Some("another check"))
}

/// Flips `count` bits, one at a time: files in turn, then bits at random, so that small files get their share. Each
/// flip is undone by the saved bytes, and the datasets must be whole in the end.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn flip(datasets: &[(&str, PathBuf)], outside_of_it: &[&str], count: u64, seed: u64) {
    let all: Vec<(PathBuf, &str, PathBuf, u64)> = (datasets.iter())
        .flat_map(|(name, folder)| {
            read_tree(folder)
                .into_iter()
                .map(|(file, content)| (folder.clone(), *name, folder.join(file), content.len() as u64))
                .collect::<Vec<_>>()
        })
        .filter(|(_, _, _, bytes)| *bytes > 0)
        .collect();
    let mut stream = Stream::of_job(seed, b"", "flips");
    let mut table: BTreeMap<(String, &str), u64> = BTreeMap::new();
    let (mut missed, mut outside): (Vec<String>, BTreeMap<(String, bool), u64>) = Default::default();
    for number in 0..count {
        let (folder, name, file, bytes) = &all[number as usize % all.len()];
        let bit = stream.below(8 * bytes);
        let whole = fs::read(file).expect("a file");
        let mut damaged = whole.clone();
        damaged[(bit / 8) as usize] ^= 1 << (bit % 8);
        fs::write(file, &damaged).expect("a file");
        let found = Verification::run(folder, &[]);
        fs::write(file, &whole).expect("a file");
        let part = file.strip_prefix(folder).expect("in the folder").display().to_string();
        if outside_of_it.contains(&part.as_str()) {
            assert_eq!(found.code, 0, "{part} is no part of the dataset: {}", found.report);
            let noted = found.report["notes"].as_array().is_some_and(|notes| !notes.is_empty());
            *outside.entry((part, noted)).or_default() += 1;
            continue;
        }
        let kind = if part.starts_with("shards/") { "shards".to_owned() } else { part };
        match name_check(&found) {
            Some(sign) => *table.entry((kind, sign)).or_default() += 1,
            None => missed.push(format!("{name}/{kind}, bit {bit}")),
        }
    }
    println!("{count} flips over {} files of {} datasets", all.len(), datasets.len());
    for ((file, sign), count) in &table {
        println!("{file:16} {sign:36} {count:5}");
    }
    for ((file, noted), count) in &outside {
        let what = if *noted { "no part of the dataset: a note" } else { "no part of the dataset: not seen" };
        println!("{file:16} {what:36} {count:5}");
    }
    assert!(missed.is_empty(), "not caught: {missed:?}");
    for (name, folder) in datasets {
        let whole = Verification::run(folder, &[]);
        assert_eq!(whole.code, 0, "{name}: {} {}", whole.report, whole.stderr);
    }
}

#[test]
fn a_newline_more_in_any_file_is_found() {
    let workspace = Workspace::new();
    for (name, folder) in make_datasets(&workspace) {
        for (file, mut content) in read_tree(&folder) {
            let (path, part) = (folder.join(&file), file.display().to_string());
            let whole = content.clone();
            content.push(b'\n');
            fs::write(&path, &content).expect("a file");
            let found = Verification::run(&folder, &[]);
            fs::write(&path, &whole).expect("a file");
            let expected = if OUTSIDE.contains(&part.as_str()) { 0 } else { 4 };
            assert_eq!(found.code, expected, "{name}/{part}: {}", found.report);
        }
    }
}

#[test]
fn a_digest_has_one_spelling() {
    let digest = Digest::hash(b"x").hex();
    assert!(Digest::from_hex(&digest).is_some());
    assert!(Digest::from_hex(&digest.to_uppercase()).is_none());
    assert!(Digest::from_hex(&format!("+{}", &digest[1..])).is_none());
}
