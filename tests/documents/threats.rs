//! `docs/security.md`: each threat names tests that are there, and bounds are those of the program.

use std::collections::BTreeSet;

use graspmill::files::Bound;

use crate::support::files::{read_text, repository_path};

/// The test that a cell names, as `FILE::NAME`.
fn tests_named(row: &str) -> Vec<(&str, &str)> {
    row.split('`').skip(1).step_by(2).filter_map(|code| code.split_once("::")).collect()
}

/// Whether a file of Rust or Python has a test of this name.
fn has_test(text: &str, name: &str) -> bool {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    lines.iter().enumerate().any(|(index, line)| {
        let is_python = line.starts_with(&format!("def {name}(")) && name.starts_with("test_");
        let is_rust = line.starts_with(&format!("fn {name}("));
        // Only further attributes may be between the mark and the function.
        let mut marks = lines[..index].iter().rev().take_while(|line| line.starts_with("#["));
        is_python || is_rust && marks.any(|mark| *mark == "#[test]")
    })
}

#[test]
fn every_threat_names_a_test_that_is_there() {
    let text = read_text(repository_path("docs/security.md"));
    let (_, table) = text.split_once("| threat |").expect("a table of threats");
    let rows: Vec<&str> = table.lines().skip(2).take_while(|line| line.starts_with('|')).collect();
    let mut named = BTreeSet::new();
    for row in &rows {
        let tests = tests_named(row);
        assert!(!tests.is_empty(), "no test holds this: {row}");
        for (file, name) in tests {
            let source = read_text(repository_path(file));
            assert!(has_test(&source, name), "{file} has no test {name}: {row}");
            named.insert((file, name));
        }
    }
    println!("{} threats, {} tests", rows.len(), named.len());
    assert!(rows.len() >= 15, "{} threats", rows.len());
}

#[test]
fn a_test_is_told_from_another_function() {
    let rust = "#[test]\n#[ignore = \"slow\"]\nfn a_b() {\nfn c() {}\n";
    assert!(has_test(rust, "a_b") && !has_test(rust, "c") && !has_test(rust, "a"));
    assert!(has_test("def test_x(copy: Path) -> None:", "test_x") && !has_test("def x():", "x"));
}

#[test]
fn bounds_are_those_of_the_program() {
    let text = read_text(repository_path("docs/security.md"));
    let (_, table) = text.split_once("| kind | at most |").expect("a table of bounds");
    let rows = table.lines().skip(2).take_while(|line| line.starts_with('|'));
    let mut listed: Vec<(String, String)> = Vec::new();
    for row in rows {
        let cells: Vec<&str> = row.trim_matches('|').split('|').map(str::trim).collect();
        listed.extend(cells[0].split(", ").map(|kind| (kind.to_owned(), cells[1].to_owned())));
    }
    let size = |bytes: u64| match bytes {
        bytes if bytes < 1 << 20 => format!("{} KiB", bytes >> 10),
        bytes => format!("{} MiB", bytes >> 20),
    };
    let mut known: Vec<(String, String)> =
        Bound::ALL.iter().map(|bound| (bound.kind.to_owned(), size(bound.bytes))).collect();
    listed.sort();
    known.sort();
    assert_eq!(listed, known);
}
