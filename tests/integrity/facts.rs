//! Facts outside of their range, behind corrected digests: every column of every product with NaN, infinities and
//! numbers too large. No reader accepts a number that its product's table does not allow, and none panics at one that
//! it allows.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use graspmill::{
    files::Folder,
    format::{FactKind, dataset::verify},
};

use super::forged::{CODES, Original, Tally, observe, verbs};
use crate::support::{files::FULL_CHECK, jobs::small_datasets, program::Program, workspace::Workspace};

const NUMBERS: [f64; 7] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0, 1e300, -1e300, -1.0];
/// Columns of whole numbers hold no other values than those; the largest is too large for a sum or a table by value.
const WHOLES: [f64; 1] = [u32::MAX as f64];

/// Verbs that add facts up.
const TALLIED: [&str; 2] = ["inspect", "report"];

/// Every verb that reads a dataset and writes what it found.
fn verbs_of(product: &str, data: &Path) -> Vec<Vec<String>> {
    let own = verbs(product).into_iter().map(|verb| verb.into_iter().map(str::to_owned).collect());
    let mut all: Vec<Vec<String>> = own.collect();
    // With itself, so that both sides are read.
    all.push(vec!["diff".to_owned(), data.display().to_string()]);
    all
}

/// Forges each fact of a dataset, each time to another value, and lets every verb and the Python package read it.
fn forge_facts(original: &Original, workspace: &Workspace, with_all: bool) -> Tally {
    let mut tally = Tally::default();
    let out = workspace.path("out");
    let product = original.manifest.product;
    for (index, fact) in product.facts_of(&original.manifest.channels()) {
        let values: &[f64] = if let FactKind::Number(_) = fact.kind { &NUMBERS } else { &WHOLES };
        let mut batch: Vec<(PathBuf, String)> = Vec::new();
        for (number, value) in values.iter().enumerate() {
            let data = workspace.path(format!("forged-{number}"));
            original.write_with_facts(&data, &BTreeMap::from([(index, *value)]));
            let what = format!("{} = {value}", fact.name);
            tally.tried += 1;
            let is_found = verify(&Folder::at(&data), FULL_CHECK, |_| {}).map_or(true, |report| !report.is_intact());
            tally.found += u32::from(is_found);
            // The verbs that add numbers up each time, the others in rotation, or all of them.
            let (tallied, others): (Vec<_>, Vec<_>) =
                verbs_of(original.name, &data).into_iter().partition(|verb| TALLIED.contains(&verb[0].as_str()));
            let next = tally.tried as usize % others.len();
            let others = others.into_iter().enumerate().filter(|(place, _)| with_all || *place == next);
            for verb in tallied.into_iter().chain(others.map(|(_, verb)| verb)) {
                let words: Vec<&str> = verb.iter().map(String::as_str).collect();
                let (code, said) = observe(&words, &data, &out);
                let label = format!("{product}, {what}: {}", verb.join(" "));
                let is_clear = code.is_some_and(|code| CODES.contains(&code)) && !said.contains("panicked");
                if !is_clear || said.trim().is_empty() {
                    tally.failures.push(format!("{label} ended with {code:?}: {said}"));
                }
                let reads_facts = TALLIED.contains(&words[0]);
                if !fact.kind.holds(*value) && reads_facts && !(code == Some(1) && said.contains(fact.name)) {
                    tally.failures.push(format!("{label} took it, with {code:?}: {said}"));
                }
            }
            batch.push((data, what));
        }
        tally.read_by_python(&batch);
    }
    tally.print(original.name);
    tally
}

fn forge_all(datasets: &[(&'static str, PathBuf)], with_all: bool) {
    let workspace = Workspace::new();
    let mut failed = 0;
    for (name, folder) in datasets {
        let tally = forge_facts(&Original::read(name, folder), &workspace, with_all);
        assert!(tally.tried > 0, "{name} has facts");
        failed += tally.failures.len();
    }
    assert_eq!(failed, 0, "facts that somebody stumbled over; they are listed above");
}

#[test]
fn no_reader_takes_facts_of_completion_outside_of_their_range() {
    let pairs = small_datasets().iter().filter(|(product, _)| *product == "completion");
    forge_all(&pairs.cloned().collect::<Vec<_>>(), false);
}

#[test]
#[ignore = "slow: every fact of four products"]
fn no_reader_takes_facts_outside_of_their_range() {
    forge_all(small_datasets(), false);
}

#[test]
#[ignore = "slow: every verb at every value"]
fn no_verb_takes_facts_outside_of_their_range() {
    forge_all(small_datasets(), true);
}

#[test]
#[ignore = "slow: makes a set of seven datasets, and one of suction"]
fn no_reader_takes_such_facts_of_products_in_clutter() {
    let workspace = Workspace::new();
    let set = workspace.path("set");
    Program::run_job("jobs/clutter-quick.toml", &set).succeed();
    let scenes = format!("scenes.dataset={:?}", set.join("scenes"));
    Program::run_job("jobs/suction-quick.toml", set.join("suction"))
        .set(&[scenes, "suction.poses=100".to_owned()])
        .succeed();
    let names = ["scenes", "views", "amodal", "volumes", "picks", "heatmaps", "suction"];
    forge_all(&names.map(|name| (name, set.join(name))), true);
}
