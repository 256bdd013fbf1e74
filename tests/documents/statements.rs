//! The page of statements holds the program's own tables.

use std::fs;

use graspmill::sim::statements::reference;

use crate::support::files::{read_text, repository_path};

#[test]
fn the_page_of_statements_is_printed_from_their_table() {
    const PAGE: &str = "docs/mjcf.md";
    const MARK: &str = "<!-- From here on printed from the table of statements. -->\n";
    let text = read_text(repository_path(PAGE));
    let (intro, found) = text.split_once(MARK).expect("the page has its mark");
    let expected = reference();
    if found != expected {
        let fresh = tempfile::Builder::new().prefix("mjcf-").suffix(".md").tempfile().expect("a scratch file");
        let (_, path) = fresh.keep().expect("the scratch file stays");
        fs::write(&path, format!("{intro}{MARK}{expected}")).expect("the scratch file is written");
        panic!("{PAGE} is out of date: copy {} over it", path.display());
    }
}
