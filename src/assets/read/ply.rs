//! PLY (Turk 1994, "The PLY polygon file format"): text and binary of both byte orders, any types, any further elements.

use super::{
    polygons::Builder,
    raw::{CONVERT, RawMesh},
    text::{Lines, clipped, number, syntax, without_mark, words},
};
use crate::Refuse;

pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, Refuse> {
    let bytes = without_mark(bytes);
    let header = Header::read(bytes)?;
    let mut body = Body::new(bytes, &header);
    let mut builder = Builder::new("face");
    for element in &header.elements {
        let vertex = element.vertex_properties();
        let corners = element.corner_property();
        // Every value takes at least a byte, so that a false count cannot allocate much memory.
        let plausible = (element.count as usize).min(bytes.len() / element.properties.len().max(1));
        match (&*element.name, vertex, corners) {
            ("vertex", Some(axes), _) => {
                builder.reserve(plausible, 0);
                for row in 0..element.count {
                    body.vertex(&mut builder, element, axes, row)?;
                }
            }
            ("vertex", None, _) => return Err(Refuse::new("syntax", "its vertices have no x, y and z", AGAIN)),
            ("face", _, Some(list)) => {
                // A triangle takes at least four bytes.
                builder.reserve(0, plausible.min(bytes.len() / 4));
                for row in 0..element.count {
                    body.face(&mut builder, element, list, row)?;
                }
            }
            ("tristrips", ..) if element.count > 0 => {
                return Err(Refuse::new("format", "triangle strips are not read", CONVERT));
            }
            // Rows of nothing, however many.
            _ if element.properties.is_empty() => {}
            _ => {
                for row in 0..element.count {
                    body.skip(&element.properties, element, row)?;
                }
            }
        }
    }
    builder.finish()
}

const AGAIN: &str = "export it again";

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Text,
    Little,
    Big,
}

#[derive(Clone, Copy)]
enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn of(name: &[u8], line: usize) -> Result<Self, Refuse> {
        Ok(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            other => return Err(syntax(format!("\"{}\" is no PLY type", clipped(other)), line)),
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The value of exactly [`Self::size`] bytes.
    fn value(self, bytes: &[u8], big: bool) -> f64 {
        let mut low = [0; 8];
        for (i, &byte) in bytes.iter().enumerate() {
            low[if big { bytes.len() - 1 - i } else { i }] = byte;
        }
        let bits = u64::from_le_bytes(low);
        match self {
            Self::I8 => f64::from(bits as i8),
            Self::U8 => f64::from(bits as u8),
            Self::I16 => f64::from(bits as i16),
            Self::U16 => f64::from(bits as u16),
            Self::I32 => f64::from(bits as i32),
            Self::U32 => f64::from(bits as u32),
            Self::F32 => f64::from(f32::from_bits(bits as u32)),
            Self::F64 => f64::from_bits(bits),
        }
    }
}

struct Property {
    name: String,
    /// Type of the length, where the property is a list.
    length: Option<Type>,
    item: Type,
}

struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
}

impl Element {
    /// Indices of x, y and z among the properties.
    fn vertex_properties(&self) -> Option<[usize; 3]> {
        let column =
            |name| self.properties.iter().position(|property| property.name == name && property.length.is_none());
        Some([column("x")?, column("y")?, column("z")?])
    }

    /// Index of the list of corners among the properties.
    fn corner_property(&self) -> Option<usize> {
        let names = ["vertex_indices", "vertex_index"];
        self.properties.iter().position(|property| property.length.is_some() && names.contains(&&*property.name))
    }
}

struct Header {
    form: Form,
    elements: Vec<Element>,
    /// Byte after the header.
    end: usize,
    /// Line after the header.
    line: usize,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, Refuse> {
        if !bytes.starts_with(b"ply") {
            return Err(Refuse::new("format", "it does not start with \"ply\"", CONVERT).at("line 1"));
        }
        let mut form = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut last = 1;
        for (line, text) in Lines::of(bytes).skip(1) {
            last = line;
            let mut words = words(text);
            let text_of = |word: Option<&[u8]>| String::from_utf8_lossy(word.unwrap_or_default()).into_owned();
            match words.next() {
                Some(b"format") => {
                    form = Some(match words.next() {
                        Some(b"ascii") => Form::Text,
                        Some(b"binary_little_endian") => Form::Little,
                        Some(b"binary_big_endian") => Form::Big,
                        other => {
                            let problem = format!("\"{}\" is no PLY format", clipped(other.unwrap_or_default()));
                            return Err(syntax(problem, line));
                        }
                    });
                }
                Some(b"element") => {
                    let (name, count) = (text_of(words.next()), text_of(words.next()));
                    let no_count = || syntax(format!("\"{}\" is no count", clipped(count.as_bytes())), line);
                    let count = count.parse().map_err(|_| no_count())?;
                    elements.push(Element { name, count, properties: Vec::new() });
                }
                Some(b"property") => {
                    let first = words.next().unwrap_or_default();
                    let is_list = first == b"list";
                    let length = is_list.then(|| Type::of(words.next().unwrap_or_default(), line)).transpose()?;
                    let item = Type::of(if is_list { words.next().unwrap_or_default() } else { first }, line)?;
                    let element = elements.last_mut().ok_or_else(|| syntax("a property before any element", line))?;
                    element.properties.push(Property { name: text_of(words.next()), length, item });
                }
                Some(b"end_header") => {
                    let form = form.ok_or_else(|| syntax("the header names no format", line))?;
                    // Position of the line in the file: it is a slice of it.
                    let mut end = text.as_ptr() as usize - bytes.as_ptr() as usize + text.len();
                    end += if bytes[end..].starts_with(b"\r\n") { 2 } else { 1 };
                    return Ok(Self { form, elements, end, line: line + 1 });
                }
                Some(b"comment" | b"obj_info") | None => {}
                Some(other) => {
                    let problem = format!("\"{}\" has no meaning in a PLY header", clipped(other));
                    return Err(syntax(problem, line));
                }
            }
        }
        Err(Refuse::new("truncated", "the header has no end", "copy or export it again").at(format!("line {last}")))
    }
}

/// The values after the header.
struct Body<'a> {
    bytes: &'a [u8],
    form: Form,
    /// Byte of the next value.
    at: usize,
    lines: Lines<'a>,
    /// Remaining words of the current line, and the line's number.
    words: &'a [u8],
    line: usize,
}

impl<'a> Body<'a> {
    fn new(bytes: &'a [u8], header: &Header) -> Self {
        let lines = Lines::from(bytes, header.end, header.line);
        Self { bytes, form: header.form, at: header.end, lines, words: &[], line: header.line }
    }

    fn location(&self) -> String {
        if self.form == Form::Text { format!("line {}", self.line) } else { format!("byte {}", self.at) }
    }

    #[inline]
    fn value(&mut self, kind: Type, element: &Element, row: u64) -> Result<f64, Refuse> {
        if self.form == Form::Text {
            return self.text_value(element, row);
        }
        let Some(value) = self.bytes.get(self.at..self.at + kind.size()) else {
            return Err(self.ends_in(element, row));
        };
        self.at += kind.size();
        Ok(kind.value(value, self.form == Form::Big))
    }

    fn text_value(&mut self, element: &Element, row: u64) -> Result<f64, Refuse> {
        loop {
            let rest = self.words.trim_ascii_start();
            if !rest.is_empty() {
                let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
                let (word, rest) = rest.split_at(end);
                self.words = rest;
                return number(Some(word), "a value", self.line);
            }
            match self.lines.next() {
                Some((line, text)) => (self.line, self.words) = (line, text),
                None => return Err(self.ends_in(element, row)),
            }
        }
    }

    #[cold]
    fn ends_in(&self, element: &Element, row: u64) -> Refuse {
        let name = clipped(element.name.as_bytes());
        let problem = format!("the header declares {} of element {name}, the file ends after {row}", element.count);
        Refuse::new("truncated", problem, "copy or export it again").at(self.location())
    }

    fn vertex(&mut self, builder: &mut Builder, element: &Element, axes: [usize; 3], row: u64) -> Result<(), Refuse> {
        let mut position = [0.0; 3];
        let mut location = String::new();
        for (index, property) in element.properties.iter().enumerate() {
            if property.length.is_some() {
                self.skip(std::slice::from_ref(property), element, row)?;
                continue;
            }
            let value = self.value(property.item, element, row)?;
            if let Some(axis) = axes.iter().position(|&location| location == index) {
                position[axis] = value;
                if !value.is_finite() {
                    location = self.location();
                }
            }
        }
        builder.vertex(position, || format!("vertex {}, {location}", row + 1));
        Ok(())
    }

    fn face(&mut self, builder: &mut Builder, element: &Element, list: usize, row: u64) -> Result<(), Refuse> {
        for (index, property) in element.properties.iter().enumerate() {
            if index != list {
                self.skip(std::slice::from_ref(property), element, row)?;
                continue;
            }
            for _ in 0..self.length(property, element, row)? {
                let corner = self.value(property.item, element, row)?;
                if corner as i64 as f64 != corner {
                    let problem = format!("a face names vertex {corner}, no whole number");
                    let location = format!("face {}, {}", row + 1, self.location());
                    return Err(Refuse::new("syntax", problem, AGAIN).at(location));
                }
                builder.corner(corner as i64, || format!("face {}, {}", row + 1, self.location()))?;
            }
            builder.end_polygon(row as usize + 1);
        }
        Ok(())
    }

    /// Number of items in the list, or 1 for a single value.
    fn length(&mut self, property: &Property, element: &Element, row: u64) -> Result<u64, Refuse> {
        let Some(length) = property.length else {
            return Ok(1);
        };
        let length = self.value(length, element, row)?;
        if length >= 0.0 && length % 1.0 == 0.0 {
            return Ok(length as u64);
        }
        let [list, name] = [&property.name, &element.name].map(|name| clipped(name.as_bytes()));
        let problem = format!("a list of {list} of element {name} has {length} items");
        Err(Refuse::new("syntax", problem, AGAIN).at(self.location()))
    }

    fn skip(&mut self, properties: &[Property], element: &Element, row: u64) -> Result<(), Refuse> {
        for property in properties {
            for _ in 0..self.length(property, element, row)? {
                self.value(property.item, element, row)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "comment made by hand\nobj_info x\nelement material 2\nproperty list uchar float shade\n\
        element vertex 4\nproperty uchar red\nproperty float x\nproperty double y\nproperty short z\nelement face 3\n\
        property list uchar int vertex_indices\nproperty float quality\nelement edge 1\nproperty int a\nend_header\n";

    /// Binary form of the test mesh; `order` gives the bytes of one number.
    fn binary(form: &str, order: fn(Vec<u8>) -> Vec<u8>) -> Vec<u8> {
        let mut file = format!("ply\nformat {form} 1.0\n{HEADER}").into_bytes();
        let mut put = |bytes: &[u8]| file.extend(order(bytes.to_vec()));
        put(&[2]);
        put(&0.5f32.to_le_bytes());
        put(&0.25f32.to_le_bytes());
        put(&[0]);
        for (x, y, z) in [(0.0f32, 0.0f64, 0i16), (1.0, 0.0, 0), (0.0, 1.0, 0), (0.0, 0.0, -3)] {
            put(&[200]);
            put(&x.to_le_bytes());
            put(&y.to_le_bytes());
            put(&z.to_le_bytes());
        }
        for corners in [&[0i32, 2, 1][..], &[0, 1, 3], &[0, 1, 2, 3]] {
            put(&[corners.len() as u8]);
            corners.iter().for_each(|corner| put(&corner.to_le_bytes()));
            put(&1.0f32.to_le_bytes());
        }
        put(&7i32.to_le_bytes());
        file
    }

    fn forms() -> [Vec<u8>; 3] {
        let text = format!(
            "ply\r\nformat ascii 1.0\r\n{}2 0.5 0.25\r\n0\r\n200 0 0 0\r\n200 1 0 0\r\n200 0 1 0\r\n200 0 0 -3\r\n\
             3 0 2 1 1\r\n3 0 1 3 1\r\n4 0 1 2 3 1\r\n7",
            HEADER.replace('\n', "\r\n")
        );
        let reversed = |mut bytes: Vec<u8>| {
            bytes.reverse();
            bytes
        };
        [text.into_bytes(), binary("binary_little_endian", |bytes| bytes), binary("binary_big_endian", reversed)]
    }

    #[test]
    fn text_and_both_byte_orders_read_alike() {
        let [text, little, big] = forms().map(|file| read(&file).unwrap());
        assert_eq!(text.positions, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -3.0]]);
        assert_eq!(text.faces.len(), 4);
        assert_eq!(text, little);
        assert_eq!(text, big);
    }

    #[test]
    fn no_cut_is_read_silently() {
        for file in forms() {
            for length in 0..file.len() - 1 {
                // Text may be cut inside its very last number, or before the last, unused element's value.
                if let Err(refuse) = read(&file[..length]) {
                    assert!(!refuse.about("a.ply").to_string().is_empty());
                } else {
                    panic!("{length} of {} bytes pass", file.len());
                }
            }
        }
    }

    #[test]
    fn lying_counts_and_indices_are_refused() {
        let message = |text: &str| read(text.as_bytes()).unwrap_err().about("a.ply").to_string();
        let vertices = "property float x\nproperty float y\nproperty float z\n";
        let faces = "property list uchar int vertex_index\n";
        let file = |count: &str, body: &str| {
            format!(
                "ply\nformat ascii 1.0\nelement vertex {count}\n{vertices}element face 1\n{faces}end_header\n{body}"
            )
        };
        let three = "0 0 0\n1 0 0\n0 1 0\n";
        for (text, wanted) in [
            (file("4000000000", three), "declares 4000000000 of element vertex, the file ends after 3 (line 12)"),
            (file("3", &format!("{three}3 0 1 3\n")), "vertex 3 (counted from 0), but there are 3 (face 1, line 13)"),
            (file("3", &format!("{three}3 0 1 -1\n")), "vertex -1"),
            (file("3", &format!("{three}-3 0 1 2\n")), "has -3 items (line 13)"),
            (file("3", "0 0 0\n1 x 0\n"), "\"x\", no number (line 11)"),
            (file("three", ""), "\"three\" is no count (line 3)"),
            (
                "ply\nformat ascii 1.0\nelement vertex 3\nproperty half x\n".to_owned(),
                "\"half\" is no PLY type (line 4)",
            ),
        ] {
            assert!(message(&text).contains(wanted), "{}", message(&text));
        }
    }
}
