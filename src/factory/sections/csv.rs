//! Tables of comma-separated values: fields are separated by commas and can be quoted (RFC 4180); lines that start with
//! `#` are comments.

use std::ops::Range;

/// One field and its byte range.
pub(crate) struct CsvField {
    /// The text, without quotes.
    pub text: String,
    /// Bytes of the table.
    pub range: Range<usize>,
}

/// The records of a table, one after the other, without comments and empty lines, each of at least one field.
pub(crate) fn csv_records(text: &str) -> impl Iterator<Item = Vec<CsvField>> {
    let mut rest = 0;
    std::iter::from_fn(move || {
        while rest < text.len() {
            let line_end = text[rest..].find('\n').map_or(text.len(), |newline| rest + newline);
            let line = text[rest..line_end].trim();
            if line.is_empty() || line.starts_with('#') {
                rest = line_end + 1;
                continue;
            }
            let mut record = Vec::new();
            loop {
                let (field, end) = field(text, rest);
                record.push(field);
                rest = end + 1;
                if text.as_bytes().get(end) != Some(&b',') {
                    return Some(record);
                }
            }
        }
        None
    })
}

/// The field that starts at `start`, and the byte that ends it: a comma, a line's end or the text's.
fn field(text: &str, start: usize) -> (CsvField, usize) {
    let bytes = text.as_bytes();
    let is_end = |byte: usize| matches!(bytes.get(byte), None | Some(b',' | b'\n'));
    if bytes.get(start) != Some(&b'"') {
        let end = (start..).find(|byte| is_end(*byte)).expect("the text ends");
        return (CsvField { text: text[start..end].trim().to_owned(), range: start..end }, end);
    }
    let (mut value, mut at) = (String::new(), start + 1);
    loop {
        let quote = text[at..].find('"').map_or(text.len(), |quote| at + quote);
        value.push_str(&text[at..quote]);
        at = (quote + 1).min(text.len());
        // A doubled quote is one of the field's letters.
        if bytes.get(at) != Some(&b'"') {
            break;
        }
        value.push('"');
        at += 1;
    }
    let end = (at..).find(|byte| is_end(*byte)).expect("the text ends");
    (CsvField { text: value, range: start..end }, end)
}
