//! PLY files whose head says that they are organised: `obj_info num_cols` and `num_rows`, a vertex per pixel.

use super::{
    organised,
    raw::{FrameProblem, RawFrame, pixel_count},
};

const ORGANISED: &str = "an organised PLY says `obj_info num_cols W` and `obj_info num_rows H` and has W x H vertices; else save the cloud as organised PCD";

/// Depths and camera of an organised cloud.
pub(super) fn parse(bytes: &[u8]) -> Result<RawFrame, FrameProblem> {
    let wrong = |found: &str| FrameProblem::content("the PLY's head", found, ORGANISED);
    let marker = b"end_header\n";
    let end = bytes.windows(marker.len()).take(1 << 16).position(|window| window == marker);
    let end = end.ok_or_else(|| wrong("no line end_header"))?;
    let head = str::from_utf8(&bytes[..end]).map_err(|_| wrong("no plain text"))?;
    let (mut format, mut sides, mut vertices) = ("", [0_usize; 2], None);
    // Size in bytes and name of each property of a vertex.
    let mut properties: Vec<(usize, &str)> = Vec::new();
    let mut in_vertices = false;
    for line in head.lines() {
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
                properties.push((size_of(kind).ok_or_else(|| wrong(line))?, name));
            }
            ["property", "list", ..] if in_vertices => return Err(wrong("a list in vertices")),
            _ => {}
        }
    }
    let [width, height] = sides;
    let count = pixel_count(width, height, "num_cols and num_rows").map_err(|_| wrong("no num_cols and num_rows"))?;
    if vertices != Some(count) {
        return Err(wrong(&format!("{} vertices for {width} x {height} pixels", vertices.unwrap_or(0))));
    }
    let data = &bytes[end + marker.len()..];
    let at = ["x", "y", "z"].map(|axis| properties.iter().position(|(_, name)| *name == axis));
    let [Some(x), Some(y), Some(z)] = at else { return Err(wrong("no x, y and z")) };
    let points = match format {
        "ascii" => ascii_points(data, properties.len(), [x, y, z], count)?,
        "binary_little_endian" => {
            if [x, y, z].iter().any(|index| properties[*index].0 != 4) {
                return Err(wrong("x, y, z that are no 4-byte floats"));
            }
            let stride: usize = properties.iter().map(|(size, _)| size).sum();
            let offset = |index: usize| properties[..index].iter().map(|(size, _)| size).sum::<usize>();
            let offsets = [x, y, z].map(offset);
            let rows = data.chunks_exact(stride).take(count);
            let value = |row: &[u8], at: usize| f32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]]);
            rows.map(|row| offsets.map(|at| value(row, at))).collect()
        }
        _ => return Err(wrong("neither ascii nor binary_little_endian")),
    };
    if points.len() != count {
        let found = format!("{} vertices of {count}", points.len());
        return Err(FrameProblem::content("the data", found, "the file is cut short: copy it again"));
    }
    organised::raw_frame(width as u32, height as u32, &points, None)
}

/// Bytes of a scalar type.
fn size_of(kind: &str) -> Option<usize> {
    Some(match kind {
        "char" | "uchar" | "int8" | "uint8" => 1,
        "short" | "ushort" | "int16" | "uint16" => 2,
        "int" | "uint" | "float" | "int32" | "uint32" | "float32" => 4,
        "double" | "float64" => 8,
        _ => return None,
    })
}

fn ascii_points(data: &[u8], width: usize, at: [usize; 3], count: usize) -> Result<Vec<[f32; 3]>, FrameProblem> {
    let text = str::from_utf8(data).map_err(|error| FrameProblem::content("the data", error, "ascii is plain text"))?;
    let mut points = Vec::new();
    for (index, line) in text.lines().take(count).enumerate() {
        let values: Option<Vec<f32>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
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
