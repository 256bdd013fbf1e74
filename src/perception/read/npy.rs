//! Depth as a NumPy file: `float32` or `float64` in metres, `uint16` in units.

use super::raw::{FrameProblem, RawFrame, pixel_count};

const REMEDY: &str = "save it by numpy.save as float32 in metres or as uint16, with shape (height, width)";

/// Depth of a two-dimensional array in C order; metres, or whole numbers of `scale` metres.
pub(super) fn parse(bytes: &[u8], scale: f64) -> Result<RawFrame, FrameProblem> {
    let wrong = |found: &str| FrameProblem::content("the NPY's head", found, REMEDY);
    // The format: NEP 1. Magic, version, length of the head, the head as a Python dictionary.
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or_else(|| wrong("no NPY file"))?;
    let (length, start): (usize, usize) = match rest {
        [1, _, a, b, ..] => (usize::from(u16::from_le_bytes([*a, *b])), 4),
        [2 | 3, _, a, b, c, d, ..] => (u32::from_le_bytes([*a, *b, *c, *d]) as usize, 6),
        _ => return Err(wrong("an unknown version")),
    };
    let end = start.saturating_add(length);
    let head =
        rest.get(start..end).and_then(|head| str::from_utf8(head).ok()).ok_or_else(|| wrong("a head cut short"))?;
    let after = |key: &str| {
        let at = head.find(&format!("'{key}'"))?;
        head[at + key.len() + 2..].trim_start().strip_prefix(':').map(str::trim_start)
    };
    if !after("fortran_order").is_some_and(|value| value.starts_with("False")) {
        return Err(wrong("an array in Fortran order"));
    }
    let shape = after("shape").and_then(|value| value.strip_prefix('(')?.split_once(')')).map(|(shape, _)| shape);
    let sides: Vec<usize> = shape
        .map(|shape| shape.split(',').map(str::trim).filter(|side| !side.is_empty()))
        .and_then(|sides| sides.map(|side| side.parse().ok()).collect())
        .unwrap_or_default();
    let [height, width] = sides[..] else { return Err(wrong("a shape that is not (height, width)")) };
    let count = pixel_count(width, height, "the NPY's head")?;
    let data = &rest[end..];
    let kind = after("descr").map(|value| value.chars().skip(1).take(3).collect::<String>()).unwrap_or_default();
    let depth: Vec<f32> = match kind.as_str() {
        "<f4" => data.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect(),
        "<f8" => data.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes) as f32).collect(),
        "<u2" => {
            data.as_chunks::<2>().0.iter().map(|bytes| (f64::from(u16::from_le_bytes(*bytes)) * scale) as f32).collect()
        }
        other => return Err(wrong(&format!("numbers of the type '{other}'"))),
    };
    if depth.len() != count {
        let found = format!("{} numbers for {height} x {width} pixels", depth.len());
        return Err(FrameProblem::content("the NPY's data", found, REMEDY));
    }
    Ok(RawFrame { width: width as u32, height: height as u32, depth, labels: None, intrinsics: None })
}
