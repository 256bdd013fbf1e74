//! Statements of a camera out of YAML: the part of it that ROS, OpenCV and Kalibr write. Anchors, aliases, texts over several lines
//! and keys of other kinds are refused.

use std::{collections::BTreeSet, iter::Peekable, str::Chars};

use super::{
    problem::CameraProblem,
    statement::{MAX_DEPTH, Statement, Value},
};

const REMEDY: &str =
    "write `key: value`, further keys indented by spaces, and lists in brackets or with a dash per line";

/// A line that holds something, with what belongs to it of the lines below while brackets are open.
struct Line {
    number: usize,
    indent: usize,
    text: String,
}

/// The statements of each document of a text; documents without any are left out.
pub(super) fn parse(text: &str) -> Result<Vec<Statement>, CameraProblem> {
    let mut documents = vec![Vec::new()];
    let mut lines = (1..).zip(text.trim_start_matches('\u{feff}').lines());
    while let Some((number, line)) = lines.next() {
        if line.starts_with("---") || line.starts_with("...") {
            documents.push(Vec::new());
            continue;
        }
        let mut content = without_comment(line).to_owned();
        // `%YAML:1.0` of OpenCV, and other directives.
        if content.trim().is_empty() || content.starts_with('%') {
            continue;
        }
        let mut open = open_brackets(&content);
        while open > 0 {
            let Some((_, next)) = lines.next() else { break };
            let next = without_comment(next).trim();
            open += open_brackets(next);
            content.push(' ');
            content.push_str(next);
        }
        let text = content.trim_start_matches(' ');
        if text.starts_with('\t') {
            return Err(wrong(number, "a tab before the key"));
        }
        let (indent, text) = (content.len() - text.len(), text.trim_end().to_owned());
        documents.last_mut().expect("the first document").push(Line { number, indent, text });
    }
    let documents = documents.into_iter().filter(|lines| !lines.is_empty());
    documents.map(|lines| Block { lines, at: 0 }.parse_whole()).collect()
}

fn wrong(line: usize, found: impl ToString) -> CameraProblem {
    CameraProblem::content(format!("line {line}"), found, REMEDY)
}

/// A line up to a `#` that begins a comment: one at its start or after a space, outside of quotes.
fn without_comment(line: &str) -> &str {
    let (mut quote, mut before) = (None, ' ');
    for (at, letter) in line.char_indices() {
        match quote {
            Some(mark) if letter == mark => quote = None,
            None if letter == '"' || letter == '\'' => quote = Some(letter),
            None if letter == '#' && before.is_whitespace() => return &line[..at],
            _ => {}
        }
        before = letter;
    }
    line
}

/// Brackets and braces that a text opens and does not close.
fn open_brackets(text: &str) -> i32 {
    let (mut quote, mut open) = (None, 0);
    for letter in text.chars() {
        match quote {
            Some(mark) if letter == mark => quote = None,
            Some(_) => {}
            None => match letter {
                '"' | '\'' => quote = Some(letter),
                '[' | '{' => open += 1,
                ']' | '}' => open -= 1,
                _ => {}
            },
        }
    }
    open
}

/// The part of a text before the first `: ` or a `:` at its end, outside of quotes, and the part behind.
fn split_key(text: &str) -> Option<(&str, &str)> {
    let mut quote = None;
    let mut letters = text.char_indices().peekable();
    while let Some((at, letter)) = letters.next() {
        match quote {
            Some(mark) if letter == mark => quote = None,
            None if letter == '"' || letter == '\'' => quote = Some(letter),
            None if letter == ':' && letters.peek().is_none_or(|(_, next)| next.is_whitespace()) => {
                return Some((text[..at].trim(), text[at + 1..].trim()));
            }
            _ => {}
        }
    }
    None
}

/// A scalar without its quotes.
fn unquoted(text: &str) -> &str {
    let inside = |mark: char| text.strip_prefix(mark).and_then(|text| text.strip_suffix(mark));
    inside('"').or_else(|| inside('\'')).unwrap_or(text)
}

/// Lines of a document, and the next one to read.
struct Block {
    lines: Vec<Line>,
    at: usize,
}

impl Block {
    fn parse_whole(mut self) -> Result<Statement, CameraProblem> {
        let indent = self.lines[0].indent;
        let whole = self.parse(indent, 0)?;
        match self.lines.get(self.at) {
            None => Ok(whole),
            Some(line) => Err(wrong(line.number, format!("'{}' belongs to no key above it", line.text))),
        }
    }

    /// The keys or items at one indentation.
    fn parse(&mut self, indent: usize, depth: usize) -> Result<Statement, CameraProblem> {
        let number = self.lines[self.at].number;
        if depth > MAX_DEPTH {
            return Err(wrong(number, format!("more than {MAX_DEPTH} levels")));
        }
        let value = if is_item(&self.lines[self.at].text) {
            Value::List(self.parse_items(indent, depth)?)
        } else {
            Value::Map(self.parse_keys(indent, depth)?)
        };
        Ok(Statement { line: number, value })
    }

    fn parse_items(&mut self, indent: usize, depth: usize) -> Result<Vec<Statement>, CameraProblem> {
        let mut items = Vec::new();
        while let Some(line) = self.lines.get_mut(self.at).filter(|line| line.indent == indent && is_item(&line.text)) {
            let text = line.text[1..].trim_start().to_owned();
            let number = line.number;
            if text.is_empty() {
                self.at += 1;
                items.push(self.parse_below(number, indent + 1, depth)?);
            } else if is_item(&text) || (!text.starts_with(['[', '{']) && split_key(&text).is_some()) {
                // Keys of an item begin behind its dash, and so are those below.
                line.indent += line.text.len() - text.len();
                line.text = text;
                let inner = line.indent;
                items.push(self.parse(inner, depth + 1)?);
            } else {
                self.at += 1;
                items.push(parse_value(number, &text, depth)?);
            }
        }
        Ok(items)
    }

    fn parse_keys(&mut self, indent: usize, depth: usize) -> Result<Vec<(String, Statement)>, CameraProblem> {
        let mut keys = Vec::new();
        let mut known = BTreeSet::new();
        while let Some(line) = self.lines.get(self.at).filter(|line| line.indent == indent && !is_item(&line.text)) {
            let number = line.number;
            let Some((key, value)) = split_key(&line.text) else {
                return Err(wrong(number, format!("'{}'", line.text)));
            };
            let (key, mut value) = (unquoted(key).to_owned(), value.to_owned());
            if key.starts_with(['?', '&', '*', '[', '{', '!']) {
                return Err(wrong(number, format!("the key '{key}'")));
            }
            if !known.insert(key.clone()) {
                return Err(CameraProblem::content(
                    format!("line {number}"),
                    format!("the key `{key}` is there twice"),
                    "leave one of them",
                ));
            }
            // A tag, such as OpenCV's `!!opencv-matrix`, adds nothing to the keys below it.
            if value.starts_with('!') {
                value = value.split_once(' ').map(|(_, rest)| rest.trim().to_owned()).unwrap_or_default();
            }
            self.at += 1;
            let value = if value.is_empty() {
                self.parse_below(number, indent, depth)?
            } else {
                parse_value(number, &value, depth)?
            };
            keys.push((key, value));
        }
        Ok(keys)
    }

    /// The lines below a key or a dash: deeper ones, or items at the key's own indentation; an empty scalar where there is nothing.
    fn parse_below(&mut self, number: usize, indent: usize, depth: usize) -> Result<Statement, CameraProblem> {
        let Some(line) = self.lines.get(self.at) else { return Ok(Statement::scalar(number, "")) };
        let below = line.indent;
        if below > indent || (below == indent && is_item(&line.text)) {
            self.parse(below, depth + 1)
        } else {
            Ok(Statement::scalar(number, ""))
        }
    }
}

fn is_item(text: &str) -> bool {
    text == "-" || text.starts_with("- ")
}

/// A value on one line: a scalar, or a list or map in brackets.
fn parse_value(line: usize, text: &str, depth: usize) -> Result<Statement, CameraProblem> {
    if text.starts_with(['&', '*', '|', '>', '@', '`', '%']) {
        return Err(wrong(line, format!("'{text}'")));
    }
    if !text.starts_with(['[', '{']) {
        return Ok(Statement::scalar(line, unquoted(text)));
    }
    let mut flow = Flow { line, letters: text.chars().peekable() };
    let value = flow.parse(depth + 1)?;
    flow.skip_spaces();
    match flow.letters.next() {
        None => Ok(value),
        Some(letter) => Err(wrong(line, format!("'{letter}' behind the closing bracket"))),
    }
}

/// A list or map in brackets, letter by letter.
struct Flow<'a> {
    line: usize,
    letters: Peekable<Chars<'a>>,
}

impl Flow<'_> {
    fn skip_spaces(&mut self) {
        while self.letters.next_if(|letter| letter.is_whitespace()).is_some() {}
    }

    fn parse(&mut self, depth: usize) -> Result<Statement, CameraProblem> {
        if depth > MAX_DEPTH {
            return Err(wrong(self.line, format!("more than {MAX_DEPTH} levels")));
        }
        self.skip_spaces();
        match self.letters.peek() {
            Some('[') => self.parse_list(depth),
            Some('{') => self.parse_map(depth),
            _ => {
                let text = self.parse_scalar(&[',', ']', '}'])?;
                Ok(Statement::scalar(self.line, text))
            }
        }
    }

    fn parse_list(&mut self, depth: usize) -> Result<Statement, CameraProblem> {
        self.letters.next();
        let mut items = Vec::new();
        while !self.is_closed_by(']')? {
            items.push(self.parse(depth + 1)?);
            self.end_item(']')?;
        }
        Ok(Statement { line: self.line, value: Value::List(items) })
    }

    fn parse_map(&mut self, depth: usize) -> Result<Statement, CameraProblem> {
        self.letters.next();
        let (mut keys, mut known) = (Vec::new(), BTreeSet::new());
        while !self.is_closed_by('}')? {
            let key = self.parse_scalar(&[':', ',', '}'])?;
            if self.letters.next_if_eq(&':').is_none() || !known.insert(key.clone()) {
                return Err(wrong(self.line, format!("the key '{key}' without a value, or twice")));
            }
            let value = self.parse(depth + 1)?;
            keys.push((key, value));
            self.end_item('}')?;
        }
        Ok(Statement { line: self.line, value: Value::Map(keys) })
    }

    /// Whether the bracket closes here; it is taken then.
    fn is_closed_by(&mut self, close: char) -> Result<bool, CameraProblem> {
        self.skip_spaces();
        match self.letters.peek() {
            None => Err(wrong(self.line, format!("no closing '{close}'"))),
            Some(letter) if *letter == close => {
                self.letters.next();
                Ok(true)
            }
            Some(_) => Ok(false),
        }
    }

    /// A comma, or the closing bracket, which stays.
    fn end_item(&mut self, close: char) -> Result<(), CameraProblem> {
        self.skip_spaces();
        match self.letters.peek() {
            Some(',') => {
                self.letters.next();
                Ok(())
            }
            Some(letter) if *letter == close => Ok(()),
            Some(letter) => Err(wrong(self.line, format!("'{letter}' in place of a comma"))),
            None => Err(wrong(self.line, format!("no closing '{close}'"))),
        }
    }

    fn parse_scalar(&mut self, ends: &[char]) -> Result<String, CameraProblem> {
        self.skip_spaces();
        let mut text = String::new();
        if let Some(mark) = self.letters.next_if(|letter| ['"', '\''].contains(letter)) {
            loop {
                match self.letters.next() {
                    Some(letter) if letter == mark => break,
                    Some(letter) => text.push(letter),
                    None => return Err(wrong(self.line, "a quote that does not end")),
                }
            }
            self.skip_spaces();
            return Ok(text);
        }
        while let Some(letter) = self.letters.next_if(|letter| !ends.contains(letter)) {
            if ['&', '*', '[', '{'].contains(&letter) {
                return Err(wrong(self.line, format!("'{letter}' within a value")));
            }
            text.push(letter);
        }
        Ok(text.trim().to_owned())
    }
}
