//! Command lines of the documents are the program's, and the list of commands is whole.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use clap::Command;
use graspmill::cli::command;

use super::blocks::{blocks_in, blocks_of};
use crate::support::{
    files::{read_text, read_tree, repository_path},
    first_change::changed_files,
};

#[test]
fn commands_in_the_documents_are_commands() {
    let makefile = fs::read_to_string(repository_path("Makefile")).expect("a Makefile");
    let (mut count, mut targets, mut tests) = (0, 0, 0);
    for block in blocks_in("sh") {
        for (line, text) in block.commands() {
            let place = format!("{}:{line}: {text}", block.document);
            let text = text.split_once(" > ").map_or(text.as_str(), |(words, _)| words);
            let words = shlex::split(text).unwrap_or_else(|| panic!("{place}: not words of a shell"));
            match words[0].as_str() {
                "graspmill" => {
                    command().try_get_matches_from(words).unwrap_or_else(|error| panic!("{place}: {error}"));
                    count += 1;
                }
                "make" => {
                    for target in words[1..].iter().filter(|word| !word.contains('=')) {
                        let rule = format!("\n{target}:");
                        assert!(makefile.contains(&rule), "{place}: the Makefile has no target {target}");
                        targets += 1;
                    }
                }
                "cargo" if words[1] == "test" => {
                    assert!(count_tests(&words[2..]) > 0, "{place}: no test has such a name");
                    tests += 1;
                }
                _ => {}
            }
        }
    }
    assert!(tests >= 4, "{tests} commands that run tests");
    println!("{count} commands, {targets} targets of make");
    assert!(count >= 37, "{count} commands");
}

/// Recipes of images and of the workflow, which no engine runs here.
#[test]
fn commands_in_recipes_are_commands() {
    let mut count = 0;
    for file in ["Dockerfile", "apptainer.def", "dataset.yaml"] {
        let text = read_text(repository_path("jobs/cluster").join(file));
        for line in text.lines().map(|line| line.trim_start_matches(['#', ' ']).trim_start_matches("run: ")) {
            let line = line.split_once(" | ").map_or(line, |(before, _)| before);
            if line.starts_with("graspmill ") {
                let words = shlex::split(line).unwrap_or_else(|| panic!("{file}: {line}: not words of a shell"));
                command().try_get_matches_from(words).unwrap_or_else(|error| panic!("{file}: {line}: {error}"));
                count += 1;
            }
        }
    }
    assert!(count >= 8, "{count} commands");
}

/// Number of the tests that `cargo test` runs by these words: an integration test or a package, and a part of the tests' names.
fn count_tests(words: &[String]) -> usize {
    let value = |option: &str| words.iter().skip_while(|word| *word != option).nth(1);
    let files = match (value("--test"), value("-p")) {
        (Some(binary), None) => files_of_binary(binary),
        (None, Some(package)) => read_tree(repository_path("src").join(package.trim_start_matches("graspmill-"))),
        other => panic!("{other:?}: name one integration test or one package"),
    };
    let filter = words.last().filter(|word| value("--test") != Some(word) && value("-p") != Some(word));
    let names = files.iter().flat_map(|(path, text)| names_of_tests(path, &String::from_utf8_lossy(text)));
    names.filter(|name| filter.is_none_or(|filter| name.contains(filter.as_str()))).count()
}

/// Sources of a binary of integration tests: its file, and the folders of its modules, by their paths below `tests/`.
fn files_of_binary(binary: &str) -> BTreeMap<PathBuf, Vec<u8>> {
    let file = repository_path("tests").join(binary).with_extension("rs");
    let text = read_text(file);
    let mut files = BTreeMap::new();
    for module in text.lines().filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';')) {
        let below = read_tree(repository_path("tests").join(module)).into_iter();
        files.extend(below.map(|(path, content)| (Path::new(module).join(path), content)));
    }
    files.insert(PathBuf::new(), text.into_bytes());
    files
}

/// Names of the tests in a file, each with its modules, which are the path of the file.
fn names_of_tests(path: &Path, text: &str) -> Vec<String> {
    let module = path.with_extension("").to_string_lossy().replace('/', "::").replace("::mod", "");
    let functions = text.split("#[test]\n").skip(1).filter_map(|rest| rest.split("fn ").nth(1)?.split('(').next());
    functions.map(|name| format!("{module}::{name}")).collect()
}

#[test]
fn tests_are_found_as_cargo_names_them() {
    let count = |line: &str| count_tests(&shlex::split(line).expect("words"));
    assert_eq!(count("--release --test data numpy_reads_the_arrays"), 1);
    assert!(count("--test data dataset::export") > 1 && count("-p graspmill-publish export") > 1);
    assert!(count("--locked --test architecture") > 10);
    assert_eq!(count("--test data no_such_test"), 0);
}

#[test]
fn the_first_change_of_contributing_applies() {
    let changed = changed_files();
    let paths: Vec<&str> = changed.keys().filter_map(|path| path.to_str()).collect();
    assert_eq!(paths, ["src/publish/export/table.rs", "tests/dataset/export.rs"]);
    for (path, content) in &changed {
        let added = String::from_utf8_lossy(content).matches("seen_share").count();
        assert!(added > 0 && !read_text(repository_path(path)).contains("seen_share"), "{}", path.display());
    }
}

/// The command that the first words name, and how many words that took.
fn find_command<'a>(top: &'a Command, words: &[&str]) -> (&'a Command, usize) {
    let (mut found, mut count) = (top, 0);
    while let Some(below) = words.get(count).and_then(|word| found.find_subcommand(word)) {
        (found, count) = (below, count + 1);
    }
    (found, count)
}

/// The commands without subcommands, by their words.
fn leaves(command: &Command, before: &str, found: &mut BTreeSet<String>) {
    for below in command.get_subcommands().filter(|below| below.get_name() != "help" && !below.is_hide_set()) {
        let name = format!("{before}{}", below.get_name());
        if below.has_subcommands() { leaves(below, &format!("{name} "), found) } else { _ = found.insert(name) }
    }
}

#[test]
fn the_list_of_commands_is_whole_and_names_no_option_that_is_not_there() {
    let top = command();
    let mut listed = BTreeSet::new();
    let list = blocks_of("docs/commands.md").into_iter().find(|block| block.language == "text").expect("the list");
    for line in list.text.lines().flat_map(|line| line.split("; ")) {
        let words: Vec<&str> = line.split_whitespace().collect();
        assert_eq!(words[0], "graspmill", "{line}");
        let (found, count) = find_command(&top, &words[1..]);
        listed.insert(words[1..=count].join(" "));
        let options = words.iter().filter_map(|word| word.trim_matches(['[', ']', '.']).strip_prefix("--"));
        for option in options {
            let is_there = found.get_arguments().any(|argument| argument.get_long() == Some(option));
            assert!(is_there, "{line}: there is no --{option}");
        }
    }
    let mut all = BTreeSet::new();
    leaves(&top, "", &mut all);
    assert_eq!(listed, all, "docs/commands.md lists these, the program has those");
}
