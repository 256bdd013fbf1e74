//! Documents and their fenced blocks.

use std::collections::BTreeMap;

use crate::support::files::{list_names, read_text, repository_path};

/// A fenced block of a document.
pub struct Block {
    pub document: String,
    /// Number of its first line.
    pub line: usize,
    pub language: String,
    pub text: String,
}

impl Block {
    /// `docs/tour.md:30`.
    pub fn place(&self) -> String {
        format!("{}:{}", self.document, self.line)
    }

    /// The file that the block's first line names in a comment, as in `# mugs.toml` or `<!-- two_fingers.xml -->`.
    pub fn file(&self) -> Option<&str> {
        let first = self.text.lines().next()?;
        let comment = first.strip_prefix("# ").or_else(|| first.strip_prefix("<!-- ")?.strip_suffix(" -->"))?;
        let is_name = comment.ends_with(&format!(".{}", self.language)) && !comment.contains(' ');
        is_name.then_some(comment)
    }

    /// The commands of a block of shell, each with its line in the document: continued lines are joined, comments left out.
    pub fn commands(&self) -> Vec<(usize, String)> {
        let (mut commands, mut open): (Vec<(usize, String)>, bool) = (Vec::new(), false);
        for (line, text) in (self.line..).zip(self.text.lines()) {
            let text = text.trim();
            let text = if text.starts_with('#') { "" } else { text.split_once(" #").map_or(text, |(words, _)| words) };
            let (text, goes_on) = text.trim_end().strip_suffix('\\').map_or((text, false), |text| (text, true));
            match commands.last_mut().filter(|_| open) {
                Some((_, command)) => *command = format!("{command} {}", text.trim()),
                None if text.trim().is_empty() => {}
                None => commands.push((line, text.trim().to_owned())),
            }
            open = goes_on;
        }
        commands
    }
}

/// The documents for people, by their paths from the repository's root.
pub fn documents() -> Vec<String> {
    let mut found = ["README.md", "CONTRIBUTING.md"].map(str::to_owned).to_vec();
    for folder in ["docs", "docs/jobs"] {
        let names = list_names(repository_path(folder)).into_iter().filter(|name| name.ends_with(".md"));
        found.extend(names.map(|name| format!("{folder}/{name}")));
    }
    found
}

/// The fenced blocks of a document, in order.
pub fn blocks_of(document: &str) -> Vec<Block> {
    let text = read_text(repository_path(document));
    let (mut found, mut is_open): (Vec<Block>, bool) = (Vec::new(), false);
    for (number, line) in (1..).zip(text.lines()) {
        match (line.trim_start().strip_prefix("```"), is_open) {
            (Some(_), true) => is_open = false,
            (Some(language), false) => {
                is_open = true;
                let (document, language) = (document.to_owned(), language.to_owned());
                found.push(Block { document, line: number + 1, language, text: String::new() });
            }
            (None, true) => {
                let block = found.last_mut().expect("an open block");
                block.text += line;
                block.text.push('\n');
            }
            (None, false) => {}
        }
    }
    assert!(!is_open, "{document}: the last block has no end");
    found
}

/// All blocks of a language.
pub fn blocks_in(language: &str) -> Vec<Block> {
    let all = documents().into_iter().flat_map(|document| blocks_of(&document));
    all.filter(|block| block.language == language).collect()
}

/// The block that names a file, such as the tour's `mugs.toml`.
pub fn file_block(document: &str, file: &str) -> String {
    let found = blocks_of(document).into_iter().find(|block| block.file() == Some(file));
    found.unwrap_or_else(|| panic!("{document} shows no {file}")).text
}

/// Languages that a test of this binary answers for.
const LANGUAGES: [&str; 7] = ["sh", "toml", "python", "rust", "xml", "text", "diff"];

#[test]
fn every_block_says_its_language() {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for block in documents().into_iter().flat_map(|document| blocks_of(&document)) {
        assert!(LANGUAGES.contains(&block.language.as_str()), "{}: language `{}`", block.place(), block.language);
        // The list of commands is compared with the program; other plain text would be held by nothing.
        assert!(block.language != "text" || block.document == "docs/commands.md", "{}: plain text", block.place());
        assert!(block.language != "diff" || block.document == "CONTRIBUTING.md", "{}: a patch", block.place());
        assert!(block.language != "xml" || block.file().is_some(), "{}: name its file", block.place());
        *counts.entry(block.language).or_default() += 1;
    }
    println!("{} documents; blocks: {counts:?}", documents().len());
}

#[test]
fn commands_are_joined_and_comments_left_out() {
    let text = "# one\ngraspmill a \\\n  --b 1   # two\n\nexport C=$D  # three\n".to_owned();
    let block = Block { document: "d".to_owned(), line: 7, language: "sh".to_owned(), text };
    assert_eq!(block.commands(), [(8, "graspmill a --b 1".to_owned()), (11, "export C=$D".to_owned())]);
}
