//! Wavefront OBJ (Wavefront Advanced Visualizer, appendix B1): vertices and polygons; all objects and groups together.
//!
//! Texture, normals, colours, materials, lines and points are passed over. Curves and surfaces of higher order are too, and
//! are noted.

use super::{
    polygons::Builder,
    raw::RawMesh,
    text::{Lines, clipped, position, syntax, without_mark, words},
};
use crate::Refuse;

pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, Refuse> {
    let mut builder = Builder::new("line");
    let mut curved = 0;
    let mut lines = Lines::of(without_mark(bytes));
    let mut joined = Vec::new();
    while let Some((line, mut text)) = lines.next() {
        // A backslash at the end continues the line.
        if text.ends_with(b"\\") {
            joined.clear();
            while let Some(start) = text.strip_suffix(b"\\") {
                joined.extend_from_slice(start);
                joined.push(b' ');
                text = lines.next().map_or(&[], |(_, next)| next);
            }
            joined.extend_from_slice(text);
            text = &joined;
        }
        let mut words = words(text);
        match words.next() {
            Some(b"v") => builder.vertex(position(&mut words, "a coordinate", line)?, || format!("line {line}")),
            Some(b"f" | b"fo") => {
                for word in words.take_while(|word| !word.starts_with(b"#")) {
                    let corner = corner(word, builder.vertices(), line)?;
                    builder.corner(corner, || format!("line {line}"))?;
                }
                builder.end_polygon(line);
            }
            Some(b"curv" | b"curv2" | b"surf") => curved += 1,
            _ => {}
        }
    }
    if curved > 0 {
        builder.note(format!("{curved} curved elements (curv, surf) are ignored; only faces are read"));
    }
    builder.finish()
}

/// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 0; negative numbers count back from the last vertex.
fn corner(word: &[u8], vertices: usize, line: usize) -> Result<i64, Refuse> {
    let vertex = word.split(|&byte| byte == b'/').next().unwrap_or_default();
    let number = std::str::from_utf8(vertex).ok().and_then(|text| text.parse::<i64>().ok());
    match number {
        Some(number @ 1..) => Ok(number - 1),
        Some(0) => Err(syntax("a face names vertex 0; OBJ counts from 1", line)),
        Some(number) => Ok(vertices as i64 + number),
        None => Err(syntax(format!("\"{}\" is no corner of a face", clipped(word)), line)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str) -> Result<RawMesh, Refuse> {
        read(text.as_bytes())
    }

    #[test]
    fn forms_of_corners_polygons_and_lines() {
        let text = "# a comment\r\no one\r\nv 0 0 0 1.0\rv 1 0 0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\nvt 0 0\nvn 0 0 1\n\
                    f 1/1/1 2//1 3/1 4 # a quad\ng two\nv 0 0 1\nf -1 \\\n -2 -3\nf 1 6 2\nv 9 9 9\nl 1 2\nf 1 2\n";
        let mesh = read_text(text).unwrap();
        assert_eq!(mesh.positions.len(), 6);
        assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [4, 3, 2], [0, 5, 1]]);
        assert_eq!(mesh.notes, ["1 faces of fewer than three corners are ignored"]);
    }

    #[test]
    fn broken_lines_are_refused_with_their_number() {
        let message = |text: &str| read_text(text).unwrap_err().about("a.obj").to_string();
        let vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        for (text, wanted) in [
            ("v 0 0\n".to_owned(), "a coordinate is missing (line 1)"),
            ("v 0 0 zero\n".to_owned(), "\"zero\", no number (line 1)"),
            ("v 0,5 0 0\n".to_owned(), "decimal comma (line 1); export it again with decimal points"),
            (format!("{vertices}f 1 2 4\n"), "vertex 3 (counted from 0), but there are 3 (line 4)"),
            (format!("{vertices}f 1 2 -4\n"), "vertex -1 (counted from 0)"),
            (format!("{vertices}f 0 1 2\n"), "OBJ counts from 1 (line 4)"),
            (format!("{vertices}f 1 2 x\n"), "\"x\" is no corner of a face (line 4)"),
        ] {
            assert!(message(&text).contains(wanted), "{}", message(&text));
        }
    }
}
