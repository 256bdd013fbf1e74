//! PCD files of the Point Cloud Library: ASCII, binary, compressed; organised.

use super::{
    lzf,
    raw::{Cloud, FrameProblem, pixel_count},
    scalar::{Scalar, ScalarKind},
};

const ORGANISED: &str = "save the cloud organised, a point per pixel: WIDTH and HEIGHT those of the image";

/// One field of a point.
struct Field {
    name: String,
    scalar: Scalar,
    /// Numbers per point.
    count: usize,
}

impl Field {
    /// Bytes per point.
    fn bytes(&self) -> usize {
        self.scalar.size * self.count
    }
}

struct Head {
    fields: Vec<Field>,
    width: usize,
    height: usize,
    /// Count of points, where it is stated.
    points: Option<usize>,
    data: String,
    /// First byte behind the head.
    end: usize,
}

/// Points and labels of an organised cloud.
pub(super) fn parse(bytes: &[u8]) -> Result<Cloud, FrameProblem> {
    let head = parse_head(bytes)?;
    let count = pixel_count(head.width, head.height, "WIDTH and HEIGHT")?;
    if head.height < 2 {
        return Err(FrameProblem::content("HEIGHT", head.height, ORGANISED));
    }
    if let Some(points) = head.points.filter(|points| *points != count) {
        let found = format!("{points} for {} x {} pixels", head.width, head.height);
        return Err(FrameProblem::content("POINTS", found, ORGANISED));
    }
    let columns = match head.data.as_str() {
        "ascii" => ascii_columns(&bytes[head.end..], &head.fields, count)?,
        "binary" => {
            let stride: usize = head.fields.iter().map(Field::bytes).sum();
            let data = sized(&bytes[head.end..], stride.saturating_mul(count))?;
            packed_columns(data, &head.fields, count, |before, _| (before, stride))
        }
        "binary_compressed" => {
            let stride: usize = head.fields.iter().map(Field::bytes).sum();
            let data = unpacked(&bytes[head.end..], stride.saturating_mul(count))?;
            // Field by field, not point by point.
            packed_columns(&data, &head.fields, count, |before, field| (before * count, field.bytes()))
        }
        other => return Err(FrameProblem::content("DATA", other, "it is ascii, binary or binary_compressed")),
    };
    let column = |name: &str| head.fields.iter().position(|field| field.name == name).map(|index| &columns[index]);
    let [Some(x), Some(y), Some(z)] = ["x", "y", "z"].map(column) else {
        return Err(FrameProblem::content("FIELDS", "no x, y and z", "a cloud has the fields x, y and z"));
    };
    let points = (0..count).map(|index| [x[index], y[index], z[index]]).collect();
    let labels = column("label").map(|labels| labels.iter().map(|label| *label as u32).collect());
    Ok(Cloud { width: head.width as u32, height: head.height as u32, points, labels })
}

fn parse_head(bytes: &[u8]) -> Result<Head, FrameProblem> {
    let (mut names, mut sizes, mut kinds, mut counts) = (Vec::new(), Vec::new(), Vec::new(), None);
    let (mut width, mut height, mut points, mut end, mut number) = (0, 0, None, 0, 0);
    let data = loop {
        let line = bytes[end..].split(|byte| *byte == b'\n').next().unwrap_or_default();
        number += 1;
        let place = format!("line {number} of the head");
        if end >= bytes.len() || line.len() > 4096 || number > 64 {
            return Err(FrameProblem::content(
                place,
                "no line DATA",
                "a PCD's head ends with it: is the file cut short?",
            ));
        }
        end = (end + line.len() + 1).min(bytes.len());
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_whitespace();
        let key = words.next().unwrap_or("#");
        let wrong = || FrameProblem::content(&place, line.trim(), "numbers are whole and not negative");
        let numbers = |words: &mut dyn Iterator<Item = &str>| -> Result<Vec<usize>, FrameProblem> {
            words.map(|word| word.parse().ok()).collect::<Option<_>>().ok_or_else(wrong)
        };
        match key {
            "FIELDS" => names = words.map(str::to_owned).collect(),
            "SIZE" => sizes = numbers(&mut words)?,
            "TYPE" => kinds = words.map(|word| word.as_bytes()[0]).collect(),
            "COUNT" => counts = Some(numbers(&mut words)?),
            "WIDTH" => width = numbers(&mut words)?.first().copied().ok_or_else(wrong)?,
            "HEIGHT" => height = numbers(&mut words)?.first().copied().ok_or_else(wrong)?,
            "POINTS" => points = numbers(&mut words)?.first().copied(),
            "DATA" => break words.next().unwrap_or_default().to_owned(),
            // The points themselves show where their camera is.
            "VERSION" | "VIEWPOINT" => {}
            comment if comment.starts_with('#') => {}
            other => {
                let remedy =
                    "a PCD's head has VERSION, FIELDS, SIZE, TYPE, COUNT, WIDTH, HEIGHT, VIEWPOINT, POINTS and DATA";
                return Err(FrameProblem::content(place, other, remedy));
            }
        }
    };
    let counts = counts.unwrap_or_else(|| vec![1; names.len()]);
    let scalars: Vec<Option<Scalar>> = sizes.iter().zip(&kinds).map(|(size, kind)| scalar_of(*size, *kind)).collect();
    if [sizes.len(), kinds.len(), counts.len()] != [names.len(); 3]
        || scalars.contains(&None)
        || names.len() > 64
        || counts.iter().any(|count| !(1..=4096).contains(count))
    {
        return Err(FrameProblem::content(
            "FIELDS, SIZE, TYPE, COUNT",
            format!("{} fields, {} sizes, {} types, {} counts", names.len(), sizes.len(), kinds.len(), counts.len()),
            "each of at most 64 fields has a size (1, 2, 4, 8), a type (F, I, U) and a count from 1",
        ));
    }
    let fields = names.into_iter().zip(scalars.into_iter().flatten()).zip(counts);
    let fields = fields.map(|((name, scalar), count)| Field { name, scalar, count }).collect();
    Ok(Head { fields, width, height, points, data, end })
}

/// A number by its bytes and its letter.
fn scalar_of(size: usize, letter: u8) -> Option<Scalar> {
    let kind = match (size, letter) {
        (4 | 8, b'F') => ScalarKind::Float,
        (1 | 2 | 4 | 8, b'I') => ScalarKind::Signed,
        (1 | 2 | 4 | 8, b'U') => ScalarKind::Unsigned,
        _ => return None,
    };
    Some(Scalar { kind, size })
}

/// The first `size` bytes.
fn sized(bytes: &[u8], size: usize) -> Result<&[u8], FrameProblem> {
    bytes.get(..size).ok_or_else(|| cut_short(bytes.len(), size))
}

fn cut_short(found: usize, needed: usize) -> FrameProblem {
    FrameProblem::content("the data", format!("{found} bytes of {needed}"), "the file is cut short: copy it again")
}

/// Decompressed data behind its two lengths.
fn unpacked(bytes: &[u8], size: usize) -> Result<Vec<u8>, FrameProblem> {
    let length = |at: usize| {
        bytes.get(at..at + 4).and_then(|bytes| bytes.first_chunk()).map(|bytes| u32::from_le_bytes(*bytes) as usize)
    };
    let (Some(packed), Some(plain)) = (length(0), length(4)) else { return Err(cut_short(bytes.len(), 8)) };
    if plain != size {
        let found = format!("{plain} bytes for points of {size}");
        return Err(FrameProblem::content(
            "the data's length",
            found,
            "the head does not fit the data: save the cloud again",
        ));
    }
    let data = sized(&bytes[8..], packed)?;
    lzf::decompress(data, size).ok_or_else(|| {
        FrameProblem::content("the compressed data", "no LZF stream of its length", "save the cloud again")
    })
}

/// The first number of each field, for each point. `layout` returns, from the bytes of the preceding fields, the offset of a
/// field's first point and the stride to the next.
fn packed_columns(
    data: &[u8],
    fields: &[Field],
    count: usize,
    layout: impl Fn(usize, &Field) -> (usize, usize),
) -> Vec<Vec<f64>> {
    let mut before = 0;
    let columns = fields.iter().map(|field| {
        let (start, stride) = layout(before, field);
        before += field.bytes();
        let value = |index: usize| field.scalar.read(&data[start + index * stride..], false);
        (0..count).map(value).collect()
    });
    columns.collect()
}

fn ascii_columns(bytes: &[u8], fields: &[Field], count: usize) -> Result<Vec<Vec<f64>>, FrameProblem> {
    let mut columns = vec![Vec::new(); fields.len()];
    let text =
        str::from_utf8(bytes).map_err(|error| FrameProblem::content("the data", error, "DATA ascii is plain text"))?;
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let width: usize = fields.iter().map(|field| field.count).sum();
    for point in 0..count {
        let Some(line) = lines.next() else {
            return Err(FrameProblem::content(
                "the data",
                format!("{point} points of {count}"),
                "the file is cut short: copy it again",
            ));
        };
        let values: Option<Vec<f64>> = line.split_whitespace().map(|word| word.parse().ok()).collect();
        let Some(values) = values.filter(|values| values.len() == width) else {
            return Err(FrameProblem::content(
                format!("point {point}"),
                line.trim(),
                "a point has one number per field and count",
            ));
        };
        let mut at = 0;
        for (column, field) in columns.iter_mut().zip(fields) {
            column.push(values[at]);
            at += field.count;
        }
    }
    Ok(columns)
}
