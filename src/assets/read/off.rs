//! OFF (Geomview's object file format), text form: with or without keyword, colours and normals; comments anywhere.

use super::{
    polygons::Builder,
    raw::{CONVERT, RawMesh},
    text::{Lines, ends_early, number, position, syntax, whole, without_comment, without_mark, words},
};
use crate::Refuse;

pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, Refuse> {
    let mut lines = Lines::of(without_mark(bytes))
        .map(|(line, text)| (line, without_comment(text)))
        .filter(|(_, text)| words(text).next().is_some());
    let (mut line, mut text) = lines.next().ok_or_else(|| ends_early("only comments", 1))?;
    let (keyword, rest) = keyword(text, line)?;
    if words(rest).next().is_some() {
        // Counts in the keyword's line, even without a space in between: the ModelNet set has such files.
        text = rest;
    } else if !keyword.is_empty() {
        (line, text) = lines.next().ok_or_else(|| ends_early("no line of counts", line))?;
    }
    let mut counts = words(text);
    // The count of edges is often missing and never used.
    let vertices = count(counts.next(), "the number of vertices", line)?;
    let faces = count(counts.next(), "the number of faces", line)?;

    let mut builder = Builder::new("line");
    builder.reserve(vertices.min(bytes.len() / 6), faces.min(bytes.len() / 6));
    for vertex in 0..vertices {
        (line, text) = lines.next().ok_or_else(|| ends_early(format!("{vertex} of {vertices} vertices"), line))?;
        builder.vertex(position(&mut words(text), "a coordinate", line)?, || format!("line {line}"));
    }
    for face in 0..faces {
        (line, text) = lines.next().ok_or_else(|| ends_early(format!("{face} of {faces} faces"), line))?;
        let mut words = words(text);
        for _ in 0..count(words.next(), "the number of corners", line)? {
            builder.corner(whole(words.next(), "a corner", line)?, || format!("line {line}"))?;
        }
        builder.end_polygon(line);
    }
    builder.finish()
}

/// The next word as a count.
fn count(word: Option<&[u8]>, what: &str, line: usize) -> Result<usize, Refuse> {
    match whole(word, what, line)? {
        count if count >= 0 => Ok(count as usize),
        count => Err(syntax(format!("{what} is {count}"), line)),
    }
}

/// The keyword, empty where there is none, and the rest of its line.
fn keyword(text: &[u8], line: usize) -> Result<(&[u8], &[u8]), Refuse> {
    let text = text.trim_ascii_start();
    let letters = text.iter().position(|byte| !byte.is_ascii_alphabetic()).unwrap_or(text.len());
    let first = words(text).next().unwrap_or_default();
    if number(Some(first), "a count", line).is_ok() {
        return Ok((&[], text));
    }
    let (keyword, rest) = text.split_at(letters);
    let unread = |what: &str| Err(Refuse::new("format", what, CONVERT).at(format!("line {line}")));
    match keyword.to_ascii_uppercase().as_slice() {
        _ if words(rest).next() == Some(b"BINARY") => unread("binary OFF is not read"),
        b"OFF" | b"COFF" | b"NOFF" | b"CNOFF" | b"STOFF" | b"STCOFF" | b"STNOFF" | b"STCNOFF" => Ok((keyword, rest)),
        _ => unread("it does not start with OFF, COFF, NOFF or STOFF"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn headers_comments_colours_and_missing_counts() {
        let body = "0 0 0 255 0 0\n# half way\n1 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1\n3 0 2 1 0.5 0.5 0.5\n4 0 1 2 3\n";
        for header in
            ["OFF\n4 2 0\n", "COFF # colours\n\n4 2\n", "OFF 4 2 6\n", "OFF4 2 0\n", "4 2 0\n", "# first\noff\n4 2 0\n"]
        {
            let mesh = read(format!("{header}{body}").as_bytes()).unwrap();
            assert_eq!((mesh.positions.len(), mesh.faces.len()), (4, 3), "{header}");
        }
    }

    #[test]
    fn broken_files_are_refused_with_their_line() {
        let message = |text: &str| read(text.as_bytes()).unwrap_err().about("a.off").to_string();
        for (text, wanted) in [
            ("OFF\n4 2 0\n0 0 0\n1 0 0\n", "2 of 4 vertices (line 4, the last); copy or export it again"),
            ("OFF\n3 2 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "1 of 2 faces (line 6, the last)"),
            ("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "vertex 3 (counted from 0), but there are 3 (line 6)"),
            ("OFF\n3\n", "the number of faces is missing (line 2)"),
            ("OFF\n", "no line of counts"),
            ("OFF BINARY\n", "binary OFF is not read"),
            ("solid x\n", "does not start with OFF"),
        ] {
            assert!(message(text).contains(wanted), "{}", message(text));
        }
    }
}
