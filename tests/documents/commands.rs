//! Command lines of the documents are the program's, and the list of commands is whole.

use std::{collections::BTreeSet, fs};

use clap::Command;
use graspmill::cli::command;

use super::blocks::{blocks_in, blocks_of};
use crate::support::files::repository_path;

#[test]
fn commands_in_the_documents_are_commands() {
    let makefile = fs::read_to_string(repository_path("Makefile")).expect("a Makefile");
    let (mut count, mut targets) = (0, 0);
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
                    let target = format!("\n{}:", words[1]);
                    assert!(makefile.contains(&target), "{place}: the Makefile has no such target");
                    targets += 1;
                }
                _ => {}
            }
        }
    }
    println!("{count} commands, {targets} targets of make");
    assert!(count >= 37, "{count} commands");
}

/// The command that the first words name, and how many words that took.
fn find_command<'a>(top: &'a Command, words: &[&str]) -> (&'a Command, usize) {
    let (mut found, mut count) = (top, 0);
    while let Some(below) = words.get(count).and_then(|word| found.find_subcommand(word)) {
        (found, count) = (below, count + 1);
    }
    (found, count)
}

/// The commands without commands of their own, by their words.
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
