//! Links of the documents lead to files and headings that are there, and so do the paths that they name.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Component, Path, PathBuf},
};

use super::blocks::documents;
use crate::support::files::{list_names, read_text, repository_path};

/// Documents with links: those for users, those at the root and those in the folders that they describe.
fn linked_documents() -> Vec<String> {
    let others = [
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "SECURITY.md",
        ".github/pull_request_template.md",
        "python/README.md",
        "meshes/README.md",
    ];
    let crates = list_names(repository_path("src")).into_iter().map(|name| format!("src/{name}/README.md"));
    let crates = crates.filter(|readme| repository_path(readme).is_file());
    documents().into_iter().chain(others.map(str::to_owned)).chain(crates).collect()
}

/// The text without fenced blocks and code between backticks.
fn prose(document: &str) -> String {
    let mut is_fenced = false;
    let lines = read_text(repository_path(document)).lines().fold(String::new(), |mut text, line| {
        let is_fence = line.trim_start().starts_with("```");
        is_fenced ^= is_fence;
        text += if is_fence || is_fenced { "" } else { line };
        text + "\n"
    });
    lines.split('`').step_by(2).collect::<Vec<_>>().join("_")
}

/// Addresses in `[...](ADDRESS)` and `![...](ADDRESS)`.
fn addresses(document: &str) -> Vec<String> {
    let prose = prose(document);
    let parts = prose.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    parts.map(|(address, _)| address.split_whitespace().next().unwrap_or_default().to_owned()).collect()
}

/// Headings of a document as addresses have them: small letters, digits, `-` and `_`; a number where one comes again.
fn anchors(document: &str) -> BTreeSet<String> {
    let (mut counts, mut found, mut is_fenced) = (BTreeMap::<String, usize>::new(), BTreeSet::new(), false);
    for line in read_text(repository_path(document)).lines() {
        is_fenced ^= line.trim_start().starts_with("```");
        let Some((marks, heading)) = line.split_once(' ').filter(|_| !is_fenced) else { continue };
        if marks.is_empty() || !marks.bytes().all(|mark| mark == b'#') {
            continue;
        }
        let letters = heading.trim().to_lowercase();
        let kept = letters.chars().filter(|letter| letter.is_alphanumeric() || " -_".contains(*letter));
        let anchor: String = kept.map(|letter| if letter == ' ' { '-' } else { letter }).collect();
        let count = counts.entry(anchor.clone()).or_default();
        found.insert(if *count == 0 { anchor } else { format!("{anchor}-{count}") });
        *count += 1;
    }
    found
}

/// A path without `..`, from the repository's root.
fn plain(path: &Path) -> PathBuf {
    path.components().fold(PathBuf::new(), |mut plain, part| {
        match part {
            Component::ParentDir => assert!(plain.pop(), "{}: out of the repository", path.display()),
            Component::Normal(name) => plain.push(name),
            _ => {}
        }
        plain
    })
}

#[test]
fn every_link_leads_somewhere() {
    let (mut inside, mut outside) = (0, 0);
    for document in linked_documents() {
        for address in addresses(&document) {
            if address.starts_with("https://") {
                outside += 1;
                continue;
            }
            let (file, anchor) =
                address.split_once('#').map_or((address.as_str(), None), |(file, anchor)| (file, Some(anchor)));
            let folder = Path::new(&document).parent().expect("a file has a folder");
            let target = if file.is_empty() { PathBuf::from(&document) } else { plain(&folder.join(file)) };
            assert!(repository_path(&target).exists(), "{document}: ({address}) leads nowhere");
            if let Some(anchor) = anchor {
                let found = anchors(&target.to_string_lossy());
                assert!(found.contains(anchor), "{document}: ({address}): {} has {found:?}", target.display());
            }
            inside += 1;
        }
    }
    println!("{inside} links inside the repository, {outside} outside");
    assert!(inside >= 50, "{inside} links");
}

#[test]
fn every_page_is_in_the_index() {
    let index: BTreeSet<PathBuf> = addresses("docs/README.md")
        .into_iter()
        .map(|address| plain(&Path::new("docs").join(address.split('#').next().unwrap_or_default())))
        .collect();
    for document in documents().into_iter().filter(|document| !document.ends_with("README.md")) {
        assert!(index.contains(Path::new(&document)), "docs/README.md does not describe {document}");
    }
}

/// Whether a name with `*` in it fits.
fn fits(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, tail)) => name.starts_with(head) && name.ends_with(tail) && name.len() >= head.len() + tail.len(),
    }
}

#[test]
fn every_path_that_is_named_is_there() {
    let folders = [
        "docs", "examples", "jobs", "src", "tests", "scenes", "meshes", "scripts", "benches", "proto", "fuzz", "python",
    ];
    let mut count = 0;
    for document in linked_documents().into_iter().filter(|document| document != "CHANGELOG.md") {
        let text = read_text(repository_path(&document));
        for code in text.lines().flat_map(|line| line.split('`').skip(1).step_by(2)) {
            let is_path = code.split_once('/').is_some_and(|(first, _)| folders.contains(&first));
            // What runs write, and examples of addresses, are no files of the repository.
            if !is_path || code.contains([' ', '{', '<', '$']) || code.contains("::") || code == "jobs/schema.json" {
                continue;
            }
            let path = repository_path(code.trim_end_matches('/'));
            let (folder, name) =
                (path.parent().expect("a folder"), path.file_name().expect("a name").to_string_lossy());
            let is_there = folder.is_dir() && list_names(folder).iter().any(|found| fits(&name, found));
            assert!(is_there, "{document}: `{code}` is not there");
            count += 1;
        }
    }
    println!("{count} paths");
    assert!(count >= 100, "{count} paths");
}

#[test]
fn headings_become_anchors_as_web_pages_have_them() {
    assert!(anchors("docs/clusters.md").contains("when-something-goes-wrong"));
    assert!(anchors("docs/verification.md").contains("graspmill-diff-a-b"));
    assert!(fits("picture*.png", "picture12.png") && !fits("a*b", "a") && fits("x", "x"));
}
