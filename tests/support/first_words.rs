//! The first words about a dataset, and the labels of the numbers that a page and a card repeat.

use std::{collections::BTreeSet, path::Path};

use super::{files::read_text, program::Program};

/// Checks that commands, page and card of a dataset begin with the same words, and that neither page nor card has two numbers of one
/// label; the words.
#[track_caller]
pub fn check_first_words(data: &Path, about: &Path) -> String {
    let named = data.display();
    let inspected = Program::on("inspect", data).succeed().stdout;
    let headline = inspected.lines().nth(1).expect("a headline").trim().to_owned();
    assert!(headline.contains(|letter: char| letter.is_ascii_digit()), "{named}: {headline}");
    // `merge` of a finished dataset prints what `run` does.
    let merged = Program::on("merge", data).finish().stdout;
    assert_eq!(merged.lines().nth(1), Some(headline.as_str()), "{named}: {merged}");
    Program::on("report", data).succeed();
    let page = read_text(data.join("report.html"));
    let lead = between(&page, "<p class=\"lead\">", "</p>");
    assert_eq!(lead, [format!("{headline}.")], "{named}");
    check_labels(&between(&page, "<dt>", "</dt>"), "tiles");
    let release = data.with_extension("release");
    Program::on("release", data).option("--out", &release).option("--about", about).succeed();
    let card = read_text(release.join("README.md"));
    assert!(card.contains(&format!("\n**{headline}.** ")), "{named}: {headline} is not in\n{card}");
    let contents = card.split("Every number here was counted in the data.").nth(1).expect("numbers");
    let rows = contents.lines().skip_while(|line| !line.starts_with("|---|---|")).skip(1);
    let rows = rows.take_while(|line| line.starts_with('|'));
    check_labels(&rows.filter_map(|row| row.split('|').nth(1)).collect::<Vec<_>>(), "rows");
    headline
}

/// Texts between each `start` and the next `end`.
pub fn between<'a>(text: &'a str, start: &str, end: &str) -> Vec<&'a str> {
    text.split(start).skip(1).filter_map(|rest| Some(rest.split_once(end)?.0)).collect()
}

#[track_caller]
fn check_labels(labels: &[&str], what: &str) {
    let distinct: BTreeSet<&&str> = labels.iter().collect();
    assert!(labels.len() > 2 && distinct.len() == labels.len(), "{what}: {labels:?}");
}
