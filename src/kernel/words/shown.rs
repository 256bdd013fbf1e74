//! Texts of others, such as names of files and objects, on their way to a terminal or a log.

use std::{borrow::Cow, fmt, path::Path};

/// A text of others on one line: control characters, line ends, and characters that turn the direction of writing are written as
/// escapes (`\u{1b}`), so that no name moves a cursor, hides a part of a line or passes for another line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown<'a>(Cow<'a, str>);

impl fmt::Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&escaped(&self.0, is_unsafe))
    }
}

/// Texts and paths that can be shown on one line.
pub trait Show {
    /// The text with escapes.
    fn shown(&self) -> Shown<'_>;
}

impl Show for str {
    fn shown(&self) -> Shown<'_> {
        Shown(self.into())
    }
}

impl Show for Path {
    fn shown(&self) -> Shown<'_> {
        Shown(self.to_string_lossy())
    }
}

/// A text of several lines with escapes: its line ends and tabs are layout.
pub fn shown_lines(text: &str) -> Cow<'_, str> {
    escaped(text, |letter| is_unsafe(letter) && !matches!(letter, '\n' | '\t'))
}

/// A text of JSON with escapes of JSON, which leave its meaning as it is.
pub fn shown_json(json: &str) -> Cow<'_, str> {
    if !json.contains(|letter: char| is_unsafe(letter) && letter != '\n') {
        return json.into();
    }
    let escape = |letter: char| match letter {
        '\n' => "\n".to_owned(),
        letter if is_unsafe(letter) => format!("\\u{:04x}", u32::from(letter)),
        letter => letter.to_string(),
    };
    json.chars().map(escape).collect()
}

/// Lines of a list, up to `most`, and then the number of the remaining ones.
pub fn capped(lines: impl IntoIterator<Item = String>, most: usize, noun: &str) -> Vec<String> {
    let mut lines = lines.into_iter();
    let mut shown: Vec<String> = lines.by_ref().take(most).collect();
    let more = lines.count();
    if more > 0 {
        shown.push(format!("and {more} more {noun}"));
    }
    shown
}

fn escaped(text: &str, is_escaped: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_escaped) {
        return text.into();
    }
    let mut shown = String::new();
    for letter in text.chars() {
        if is_escaped(letter) { shown.extend(letter.escape_default()) } else { shown.push(letter) }
    }
    shown.into()
}

/// Whether a character acts on a terminal or on the order of the others: controls (C0, DEL, C1), separators of lines and paragraphs,
/// and the marks, embeddings, overrides and isolates of the bidirectional algorithm (UAX #9).
fn is_unsafe(letter: char) -> bool {
    letter.is_control()
        || matches!(letter, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_that_act_are_escaped_and_others_stay() {
        for (text, shown) in [
            ("mug-01", "mug-01"),
            ("Tasse \u{e9}\u{4e2d}\u{1f375} 'a\\b'", "Tasse \u{e9}\u{4e2d}\u{1f375} 'a\\b'"),
            ("a\x1b[31mred\x1b]0;owned\x07", "a\\u{1b}[31mred\\u{1b}]0;owned\\u{7}"),
            ("a\nroot 0\r\tb\x7f\u{9b}", "a\\nroot 0\\r\\tb\\u{7f}\\u{9b}"),
            (
                "\u{202e}lts.exe\u{2066}x\u{2069}\u{200f}\u{2028}",
                "\\u{202e}lts.exe\\u{2066}x\\u{2069}\\u{200f}\\u{2028}",
            ),
        ] {
            assert_eq!(text.shown().to_string(), shown);
            assert_eq!(Path::new(text).shown().to_string(), shown);
        }
        assert_eq!(format!("{:<6}|{:>4}|", "a\n".shown(), "b".shown()), "a\\n   |   b|");
        assert_eq!(shown_lines("a\n\tb\x1b"), "a\n\tb\\u{1b}");
    }

    #[test]
    fn long_lists_end_with_the_count_of_the_others() {
        let lines = |count: usize| capped((0..count).map(|line| line.to_string()), 2, "notes");
        assert_eq!(lines(2), ["0", "1"]);
        assert_eq!(lines(5), ["0", "1", "and 3 more notes"]);
    }

    #[test]
    fn json_keeps_its_meaning() {
        let value = serde_json::json!({ "name": "\u{202e}a\u{7f}\u{85}\n\x1b" });
        let plain = serde_json::to_string_pretty(&value).expect("JSON");
        let shown = shown_json(&plain);
        assert!(shown.is_ascii() && !shown.contains(|letter: char| letter.is_control() && letter != '\n'), "{shown}");
        assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).expect("JSON"), value);
    }
}
