//! Lines, words and numbers of text formats, with their line numbers.

use crate::Refuse;

/// A text without the mark of UTF-8 that some programs put in front of it.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// The lines of a text, from 1; they end with LF, CR LF or CR.
pub(super) struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn of(text: &'a [u8]) -> Self {
        Self { rest: text, number: 0 }
    }

    /// Lines from byte `start` on, which is line `first`.
    pub(super) fn from(text: &'a [u8], start: usize, first: usize) -> Self {
        Self { rest: text.get(start..).unwrap_or_default(), number: first - 1 }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&byte| byte == b'\n' || byte == b'\r').unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        let skip = if rest.starts_with(b"\r\n") { 2 } else { 1.min(rest.len()) };
        self.rest = &rest[skip..];
        self.number += 1;
        Some((self.number, line))
    }
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// A word for messages: without control characters of terminals, and shortened if it is long.
pub(super) fn clipped(word: &[u8]) -> String {
    const LONGEST: usize = 40;
    let start = String::from_utf8_lossy(&word[..word.len().min(LONGEST)]);
    let rest = if word.len() > LONGEST { "..." } else { "" };
    format!("{}{rest}", start.escape_debug())
}

/// A line up to `#`.
pub(super) fn without_comment(line: &[u8]) -> &[u8] {
    &line[..line.iter().position(|&byte| byte == b'#').unwrap_or(line.len())]
}

/// The next word as a number; NaN and infinity pass, in C's, Rust's and Microsoft's spelling (`-1.#IND`).
pub(super) fn number(word: Option<&[u8]>, what: &str, line: usize) -> Result<f64, Refuse> {
    let Some(word) = word else {
        return Err(syntax(format!("{what} is missing"), line));
    };
    let text = std::str::from_utf8(word).unwrap_or_default();
    match text.parse() {
        Ok(number) => Ok(number),
        Err(_) if word.contains(&b'#') => Ok(f64::NAN),
        Err(_) if word.contains(&b',') && text.replace(',', ".").parse::<f64>().is_ok() => {
            let problem = format!("{what} is {}, with a decimal comma", clipped(word));
            Err(Refuse::new("syntax", problem, "export it again with decimal points").at(format!("line {line}")))
        }
        Err(_) => Err(syntax(format!("{what} is \"{}\", no number", clipped(word)), line)),
    }
}

/// Three numbers.
pub(super) fn position<'a>(
    words: &mut impl Iterator<Item = &'a [u8]>,
    what: &str,
    line: usize,
) -> Result<[f64; 3], Refuse> {
    let mut coordinate = || number(words.next(), what, line);
    Ok([coordinate()?, coordinate()?, coordinate()?])
}

/// The next word as a whole number.
pub(super) fn whole(word: Option<&[u8]>, what: &str, line: usize) -> Result<i64, Refuse> {
    let number = number(word, what, line)?;
    // Some writers print whole numbers as 3.0.
    if number % 1.0 == 0.0 && libm::fabs(number) < 9e15 {
        Ok(number as i64)
    } else {
        Err(syntax(format!("{what} is {number}, no whole number"), line))
    }
}

/// A line that violates the format.
pub(super) fn syntax(problem: impl Into<String>, line: usize) -> Refuse {
    Refuse::new("syntax", problem, "export it again").at(format!("line {line}"))
}

/// A file that ends too early.
pub(super) fn ends_early(problem: impl Into<String>, line: usize) -> Refuse {
    Refuse::new("truncated", problem, "copy or export it again").at(format!("line {line}, the last"))
}
