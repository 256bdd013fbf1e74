//! Blocks of TOML are what they seem: jobs, sets, hands, about files.

use std::{fs, path::Path};

use graspmill::{
    factory::job::{JobSet, JobText},
    hand::HandTable,
    publish::About,
};

use super::blocks::{blocks_in, file_block};
use crate::support::{
    files::{list_names, repository_path},
    program::Program,
    workspace::Workspace,
};

/// A folder with what the examples name: our meshes and scenes, the jobs of the repository, the hand of docs/hands.md.
fn make_workspace() -> Workspace {
    let workspace = Workspace::new();
    for folder in ["meshes", "jobs", "scenes"] {
        for name in list_names(repository_path(folder)) {
            let (name, file) = (Path::new(folder).join(&name), repository_path(folder).join(&name));
            if file.is_file() {
                workspace.write(name, fs::read(file).expect("a file"));
            }
        }
    }
    for file in ["two_fingers.xml", "two_fingers.toml"] {
        workspace.write(file, file_block("docs/hands.md", file));
    }
    workspace
}

#[test]
fn toml_in_the_documents_is_accepted() {
    let workspace = make_workspace();
    let about = file_block("docs/tour.md", "about.toml");
    let blocks = blocks_in("toml");
    for block in &blocks {
        let (place, text) = (block.place(), &block.text);
        let file = workspace.path("example.toml");
        if text.contains("product = \"set\"") {
            let set = workspace.write("jobs/example.toml", text);
            let text = JobText::open(&set, &[]).expect("a file");
            JobSet::read(&text).unwrap_or_else(|errors| panic!("{place}: {}", errors.render()));
        } else if text.contains("[[driven]]") {
            HandTable::parse(&file, text).unwrap_or_else(|error| panic!("{place}: {error}"));
        } else if text.contains("[[authors]]") || text.contains("[licences]") {
            // Texts of licences are at the end of an about file.
            let (head, _) = about.split_once("[licences]").unwrap_or((&about, ""));
            let text = if text.contains("[[authors]]") { text.clone() } else { format!("{head}\n{text}") };
            let assets = ["mug-01", "bench_vice"];
            About::read(&file, &text, &assets).unwrap_or_else(|errors| panic!("{place}: {}", errors.render()));
        } else {
            // A part of a job is completed with two built-in objects.
            let is_whole = text.contains("[[objects]]") || text.contains("[robot]");
            let text = if is_whole { text.clone() } else { format!("objects = [{{ built_in = 2 }}]\n{text}") };
            let job = workspace.write("example.toml", text);
            let outcome = Program::on("estimate", &job).finish();
            assert!(outcome.code == Some(0), "{place}: {}", outcome.text());
        }
    }
    println!("{} blocks of TOML", blocks.len());
    assert!(blocks.len() >= 8, "{} blocks of TOML", blocks.len());
}
