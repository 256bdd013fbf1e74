//! Whether damage, forgery, differences and full disks are seen and told.
#![cfg(feature = "sim")]

mod difference;
mod disk;
mod flips;
mod forger;
#[path = "../products/mod.rs"]
mod products;
#[path = "../tree/mod.rs"]
mod tree;

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Command, Output},
};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// An about file, for releases.
const ABOUT: &str = "title = \"Two\"\nversion = \"1\"\ndate = \"2026-01-01\"\ndescription = \"Two shapes.\"\n\
                     licence = \"CC-BY-4.0\"\n[[authors]]\nname = \"Nobody\"\n";

fn graspmill(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_graspmill"));
    command.current_dir(ROOT).args(arguments);
    command
}

fn done(command: &mut Command) -> Output {
    let done = command.output().expect("graspmill starts");
    assert!(done.status.success(), "{command:?}: {}", String::from_utf8_lossy(&done.stderr));
    done
}

/// Makes the dataset of a job.
fn run(text: &str, place: &Path, name: &str) -> PathBuf {
    let (file, out) = (place.join(format!("{name}.toml")), place.join(name));
    fs::write(&file, text).expect("a job file");
    done(graspmill(&["run", "--progress", "none"]).arg(&file).arg("--out").arg(&out));
    out
}

/// Small datasets of all products, by name.
fn all_products(place: &Path) -> Vec<(&'static str, PathBuf)> {
    let jobs = products::jobs(Path::new(ROOT), place);
    jobs.into_iter().map(|(name, text)| (name, run(&text, place, name))).collect()
}

/// `verify --json`: exit code, the report where there is one, and what was said beside.
fn verify(folder: &Path, more: &[&str]) -> (i32, Option<serde_json::Value>, String) {
    let output = graspmill(&["verify", "--json"]).arg(folder).args(more).output().expect("graspmill starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code().unwrap_or(-1), serde_json::from_slice(&output.stdout).ok(), said)
}

fn problems(report: &serde_json::Value) -> Vec<String> {
    let list = report["problems"].as_array().into_iter().flatten();
    list.map(|problem| problem.as_str().unwrap_or_default().to_owned()).collect()
}
