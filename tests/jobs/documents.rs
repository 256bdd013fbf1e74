//! Examples in the documents: every block of TOML is accepted, and every command line of graspmill is one.

use std::{fs, path::Path};

use graspmill::{
    cli::command,
    factory::job::{JobSet, JobText},
    hand::HandTable,
    publish::About,
};

use crate::support::{
    files::{list_names, read_text, repository_path},
    program::Program,
    workspace::Workspace,
};

/// The documents for people, by their paths from the repository's root.
fn documents() -> Vec<String> {
    let mut found = vec!["README.md".to_owned()];
    for folder in ["docs", "docs/jobs"] {
        let names = list_names(repository_path(folder)).into_iter().filter(|name| name.ends_with(".md"));
        found.extend(names.map(|name| format!("{folder}/{name}")));
    }
    found
}

/// The fenced blocks of a language in a document, each with the number of its first line.
fn blocks(document: &str, language: &str) -> Vec<(usize, String)> {
    let text = read_text(repository_path(document));
    let (mut found, mut open): (Vec<(usize, String)>, _) = (Vec::new(), None);
    for (number, line) in (1..).zip(text.lines()) {
        match (line.trim_start().strip_prefix("```"), open) {
            (Some(_), Some(_)) => open = None,
            (Some(named), None) => {
                open = Some(named == language);
                if named == language {
                    found.push((number + 1, String::new()));
                }
            }
            (None, Some(true)) => {
                let (_, block) = found.last_mut().expect("an open block");
                *block += line;
                block.push('\n');
            }
            (None, _) => {}
        }
    }
    found
}

/// A folder with what the examples name: our meshes, and the jobs of the repository.
fn make_workspace() -> Workspace {
    let workspace = Workspace::new();
    for folder in ["meshes", "jobs"] {
        for name in list_names(repository_path(folder)) {
            let (name, file) = (Path::new(folder).join(&name), repository_path(folder).join(&name));
            if file.is_file() {
                workspace.write(name, fs::read(file).expect("a file"));
            }
        }
    }
    workspace
}

#[test]
fn toml_in_the_documents_is_accepted() {
    let workspace = make_workspace();
    let about = blocks("docs/tour.md", "toml").into_iter().find(|(_, block)| block.contains("[[authors]]"));
    let (_, about) = about.expect("the tour shows an about file");
    let mut count = 0;
    for document in documents() {
        for (line, block) in blocks(&document, "toml") {
            let place = format!("{document}:{line}");
            let file = workspace.path("example.toml");
            if block.contains("product = \"set\"") {
                let set = workspace.write("jobs/example.toml", &block);
                let text = JobText::open(&set, &[]).expect("a file");
                JobSet::read(&text).unwrap_or_else(|errors| panic!("{place}: {}", errors.render()));
            } else if block.contains("[[driven]]") {
                HandTable::parse(&file, &block).unwrap_or_else(|error| panic!("{place}: {error}"));
            } else if block.contains("[[authors]]") || block.contains("[licences]") {
                // Statements of licences stand at the end of an about file.
                let (head, _) = about.split_once("[licences]").unwrap_or((&about, ""));
                let text = if block.contains("[[authors]]") { block } else { format!("{head}\n{block}") };
                let assets = ["mug-01", "bench_vice"];
                About::read(&file, &text, &assets).unwrap_or_else(|errors| panic!("{place}: {}", errors.render()));
            } else {
                // A part of a job stands beside two built-in objects.
                let is_whole = block.contains("[[objects]]");
                let text = if is_whole { block } else { format!("objects = [{{ built_in = 2 }}]\n{block}") };
                let job = workspace.write("example.toml", text);
                let outcome = Program::on("estimate", &job).finish();
                assert!(outcome.code == Some(0), "{place}: {}", outcome.text());
            }
            count += 1;
        }
    }
    println!("{count} blocks of TOML");
    assert!(count >= 8, "{count} blocks of TOML");
}

#[test]
fn commands_in_the_documents_are_commands() {
    let mut count = 0;
    for document in documents() {
        for (line, block) in blocks(&document, "sh") {
            let joined = block.replace("\\\n", " ");
            for text in joined.lines().map(str::trim).filter(|text| text.starts_with("graspmill ")) {
                let text = text.split_once(" #").map_or(text, |(words, _)| words);
                let text = text.split_once(" > ").map_or(text, |(words, _)| words);
                let words = shlex::split(text).unwrap_or_else(|| panic!("{document}:{line}: {text}"));
                if let Err(error) = command().try_get_matches_from(words) {
                    panic!("{document}:{line}: {text}: {error}");
                }
                count += 1;
            }
        }
    }
    println!("{count} commands");
    assert!(count >= 37, "{count} commands");
}
