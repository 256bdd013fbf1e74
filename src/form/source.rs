//! Texts and locations in them.

use std::{fmt, ops::Range};

/// Bytes between two character counts.
const BLOCK: usize = 256;

/// Longest line that a message shows in full [characters].
const MAX_LINE: u32 = 200;

/// Characters shown before the location on a longer line.
const LEAD: u32 = 60;

/// Mark for a part of a line that is not shown.
const CUT: &str = "...";

/// A text with a label and an index of its lines, so that finding a location takes constant time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    label: String,
    text: String,
    /// First byte of each line.
    line_starts: Vec<usize>,
    /// Number of characters that start before each block of [`BLOCK`] bytes.
    characters: Vec<u32>,
}

/// A location in a text.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Location {
    /// Label of the text: the file name, or `--set`.
    pub file: String,
    /// Line, from 1; for `--set` the number of the override, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// Number of characters from the column on, within the line; at least 1.
    pub width: u32,
    /// The line, or the part around the column if it is longer than 200 characters.
    pub text: String,
    /// Characters of `text` before the column.
    pub lead: u32,
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

impl Source {
    /// Creates a source from a text; messages call it `label`.
    pub fn new(label: &str, text: &str) -> Self {
        let line_starts = [0].into_iter().chain(text.match_indices('\n').map(|(newline, _)| newline + 1)).collect();
        let mut total = 0;
        let characters = text.as_bytes().chunks(BLOCK).map(|block| {
            let before = total;
            total += count_characters(block);
            before
        });
        let mut characters: Vec<u32> = characters.collect();
        characters.push(total);
        Self { label: label.to_owned(), text: text.to_owned(), line_starts, characters }
    }

    /// The location of a range of bytes; bounds inside a character are moved before it.
    pub fn location(&self, range: &Range<usize>) -> Location {
        let start = self.text.floor_char_boundary(range.start);
        let end = self.text.floor_char_boundary(range.end).max(start);
        // The line is the last one that starts at or before the location.
        let line = self.line_starts.partition_point(|first| *first <= start);
        let line_start = self.line_starts[line - 1];
        let line_end = self.line_starts.get(line).map_or(self.text.len(), |next| next - 1);
        let [first, column, last] = [line_start, start, end.min(line_end).max(start)].map(|byte| self.count_to(byte));
        let (text, lead) = self.excerpt(line_start..line_end, start);
        Location {
            file: self.label.clone(),
            line: line as u32,
            column: column - first + 1,
            width: (last - column).clamp(1, MAX_LINE - lead.min(LEAD)),
            text,
            lead,
        }
    }

    /// Number of characters that start before a byte.
    fn count_to(&self, byte: usize) -> u32 {
        let block = byte / BLOCK;
        self.characters[block] + count_characters(&self.text.as_bytes()[block * BLOCK..byte])
    }

    /// The line, or the part of a long line around `spot`, and the number of its characters before `spot`.
    fn excerpt(&self, line: Range<usize>, spot: usize) -> (String, u32) {
        let lead = self.count_to(spot) - self.count_to(line.start);
        if self.count_to(line.end) - self.count_to(line.start) <= MAX_LINE {
            return (self.text[line].trim_end().to_owned(), lead);
        }
        // Starts at the location instead of the line's start, so that many mistakes on one long line stay cheap.
        let before = self.text[line.start..spot].char_indices().rev().take(LEAD as usize).last();
        let first = before.map_or(spot, |(byte, _)| line.start + byte);
        let shown = self.text[first..line.end].chars().take(MAX_LINE as usize);
        let mut text: String = shown.collect();
        let is_cut = first + text.len() < line.end;
        text.truncate(text.trim_end().len());
        if is_cut {
            text.push_str(CUT);
        }
        if first == line.start {
            return (text, lead);
        }
        (format!("{CUT}{text}"), lead.min(LEAD) + CUT.len() as u32)
    }
}

/// Number of characters that start in these UTF-8 bytes.
fn count_characters(bytes: &[u8]) -> u32 {
    bytes.iter().filter(|byte| **byte & 0b1100_0000 != 0b1000_0000).count() as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line and column counted from the start of the text.
    fn counted(text: &str, start: usize) -> (u32, u32) {
        let before = &text[..text.floor_char_boundary(start)];
        let line = before.matches('\n').count() as u32 + 1;
        (line, before.rsplit('\n').next().unwrap_or_default().chars().count() as u32 + 1)
    }

    #[test]
    fn places_are_those_counted_from_the_start() {
        let text = format!("a\n\nMüll = \"日本\"\r\n{}\n# {}", "ü = 1\n".repeat(200), "x".repeat(300));
        let source = Source::new("a.toml", &text);
        for start in 0..=text.len() {
            let location = source.location(&(start..start + 2));
            assert_eq!((location.line, location.column), counted(&text, start), "byte {start}");
        }
        let beyond = source.location(&(text.len() + 5..text.len() + 9));
        assert_eq!((beyond.line, beyond.width), (205, 1));
    }

    #[test]
    fn the_line_and_the_width_of_what_is_meant_are_shown() {
        let source = Source::new("a.toml", "a = 1\nb = \"two\nlines\"  \n");
        let location = source.location(&(10..22));
        assert_eq!((location.to_string().as_str(), location.text.as_str()), ("a.toml:2:5", "b = \"two"));
        assert_eq!((location.lead, location.width), (4, 4));
    }

    #[test]
    fn of_a_long_line_the_part_around_the_place_is_shown() {
        let text = format!("é{}spot{}", "a".repeat(500), "b".repeat(500));
        let source = Source::new("a.toml", &text);
        let location = source.location(&(502..506));
        assert_eq!((location.column, location.width, location.lead), (502, 4, 63));
        assert_eq!(location.text, format!("...{}spot{}...", "a".repeat(60), "b".repeat(136)));
        let start = source.location(&(0..2));
        assert_eq!((start.lead, start.text.chars().count()), (0, 203));
        let end = source.location(&(1005..1006));
        assert_eq!(end.text, format!("...{}", "b".repeat(61)));
    }
}
