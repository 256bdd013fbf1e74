//! PLY files with a header that marks them as organised: `obj_info num_cols` and `num_rows`, a vertex per pixel. Numbers are of
//! any type, in text or in binary of both byte orders.

use super::{
    raw::{Cloud, FrameProblem, pixel_count},
    scalar::{Scalar, ScalarKind},
};

const ORGANISED: &str = "an organised PLY has `obj_info num_cols W` and `obj_info num_rows H` and W x H vertices; else save the cloud as organised PCD";

/// Longest head [bytes].
const MAX_HEAD: usize = 1 << 16;

/// Content of the head of a file.
struct Head<'a> {
    format: &'a str,
    width: usize,
    height: usize,
    /// Type and name of each property of a vertex.
    properties: Vec<(Scalar, &'a str)>,
}

/// Points of an organised cloud.
pub(super) fn parse(bytes: &[u8]) -> Result<Cloud, FrameProblem> {
    let marker = b"end_header";
    let end = bytes.windows(marker.len()).take(MAX_HEAD).position(|window| window == marker);
    let end = end.ok_or_else(|| wrong("no line end_header"))?;
    let head = str::from_utf8(&bytes[..end]).map_err(|_| wrong("no plain text"))?;
    let data = &bytes[end + marker.len()..];
    let data = data.strip_prefix(b"\r").unwrap_or(data);
    let data = data.strip_prefix(b"\n").ok_or_else(|| wrong("no line end after end_header"))?;
    let head = parse_head(head)?;
    let count = head.width * head.height;
    let at = ["x", "y", "z"].map(|axis| head.properties.iter().position(|(_, name)| *name == axis));
    let [Some(x), Some(y), Some(z)] = at else { return Err(wrong("no x, y and z")) };
    let points = match head.format {
        "ascii" => ascii_points(data, head.properties.len(), [x, y, z], count)?,
        "binary_little_endian" => binary_points(data, &head.properties, [x, y, z], count, false),
        "binary_big_endian" => binary_points(data, &head.properties, [x, y, z], count, true),
        _ => return Err(wrong("neither ascii, binary_little_endian nor binary_big_endian")),
    };
    if points.len() != count {
        let found = format!("{} vertices of {count}", points.len());
        return Err(FrameProblem::content("the data", found, "the file is cut short: copy it again"));
    }
    Ok(Cloud { width: head.width as u32, height: head.height as u32, points, labels: None })
}

fn wrong(found: &str) -> FrameProblem {
    FrameProblem::content("the PLY's head", found, ORGANISED)
}

fn parse_head(text: &str) -> Result<Head<'_>, FrameProblem> {
    let (mut format, mut sides, mut vertices) = ("", [0_usize; 2], None);
    let mut properties = Vec::new();
    let mut in_vertices = false;
    for line in text.lines() {
        match *line.split_whitespace().collect::<Vec<_>>() {
            ["format", name, _] => format = name,
            ["obj_info", "num_cols", value] => sides[0] = value.parse().unwrap_or(0),
            ["obj_info", "num_rows", value] => sides[1] = value.parse().unwrap_or(0),
            ["element", "vertex", value] if vertices.is_none() => {
                (vertices, in_vertices) = (value.parse::<usize>().ok(), true);
            }
            ["element", _, _] if vertices.is_none() => return Err(wrong("an element before the vertices")),
            ["element", _, _] => in_vertices = false,
            ["property", kind, name] if in_vertices => {
                properties.push((scalar_of(kind).ok_or_else(|| wrong(line))?, name));
            }
            ["property", "list", ..] if in_vertices => return Err(wrong("a list in vertices")),
            // Comments, and elements after the vertices.
            [] | ["ply"] | ["comment" | "obj_info", ..] => {}
            ["property", ..] if !in_vertices => {}
            _ => return Err(wrong(line)),
        }
    }
    let [width, height] = sides;
    let count = pixel_count(width, height, "num_cols and num_rows").map_err(|_| wrong("no num_cols and num_rows"))?;
    if vertices != Some(count) {
        return Err(wrong(&format!("{} vertices for {width} x {height} pixels", vertices.unwrap_or(0))));
    }
    Ok(Head { format, width, height, properties })
}

/// A type by either of its names.
fn scalar_of(name: &str) -> Option<Scalar> {
    let (kind, size) = match name {
        "char" | "int8" => (ScalarKind::Signed, 1),
        "uchar" | "uint8" => (ScalarKind::Unsigned, 1),
        "short" | "int16" => (ScalarKind::Signed, 2),
        "ushort" | "uint16" => (ScalarKind::Unsigned, 2),
        "int" | "int32" => (ScalarKind::Signed, 4),
        "uint" | "uint32" => (ScalarKind::Unsigned, 4),
        "float" | "float32" => (ScalarKind::Float, 4),
        "double" | "float64" => (ScalarKind::Float, 8),
        _ => return None,
    };
    Some(Scalar { kind, size })
}

fn binary_points(
    data: &[u8],
    properties: &[(Scalar, &str)],
    at: [usize; 3],
    count: usize,
    is_big_endian: bool,
) -> Vec<[f64; 3]> {
    let bytes_before = |index: usize| properties[..index].iter().map(|(scalar, _)| scalar.size).sum::<usize>();
    let columns = at.map(|index| (properties[index].0, bytes_before(index)));
    let rows = data.chunks_exact(bytes_before(properties.len())).take(count);
    rows.map(|row| columns.map(|(scalar, start)| scalar.read(&row[start..], is_big_endian))).collect()
}

fn ascii_points(data: &[u8], width: usize, at: [usize; 3], count: usize) -> Result<Vec<[f64; 3]>, FrameProblem> {
    let text = str::from_utf8(data).map_err(|error| FrameProblem::content("the data", error, "ascii is plain text"))?;
    let mut points = Vec::new();
    for (index, line) in text.lines().take(count).enumerate() {
        let values: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        let Some(values) = values.filter(|values| values.len() == width) else {
            return Err(FrameProblem::content(
                format!("vertex {index}"),
                line.trim(),
                "a vertex has one number per property",
            ));
        };
        points.push(at.map(|index| values[index]));
    }
    Ok(points)
}
