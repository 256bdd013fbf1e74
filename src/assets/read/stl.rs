//! STL, binary and ASCII (3D Systems, "StereoLithography Interface Specification", 1989).
//!
//! Stored normals and attribute words are ignored: the winding of the corners defines the outside.

use super::{
    polygons::Builder,
    raw::RawMesh,
    text::{Lines, clipped, ends_early, position, syntax, without_mark, words},
};
use crate::{Refuse, repair::weld::Welder};

const HEADER: usize = 84;
const RECORD: usize = 50;

/// Reads either form. The length decides first, because many binary files start with the word "solid" too.
pub(super) fn read(bytes: &[u8]) -> Result<RawMesh, Refuse> {
    let declared = bytes.get(80..HEADER).map(|count| u64::from(u32::from_le_bytes(count.try_into().expect("4 bytes"))));
    let fits = declared.is_some_and(|count| HEADER as u64 + RECORD as u64 * count == bytes.len() as u64);
    let text = without_mark(bytes);
    if !fits && looks_ascii(text) {
        return ascii(text);
    }
    match declared {
        Some(declared) => binary(bytes, declared),
        None => Err(Refuse::new(
            "truncated",
            format!("{} bytes; a binary STL starts with a header of {HEADER}", bytes.len()),
            "copy or export it again",
        )),
    }
}

/// ASCII files start with "solid", soon followed by "facet" or "endsolid"; no binary file does both.
fn looks_ascii(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    let start = &start[..start.len().min(4096)];
    let says = |word: &[u8]| start.windows(word.len()).any(|window| window.eq_ignore_ascii_case(word));
    start.len() >= 5 && start[..5].eq_ignore_ascii_case(b"solid") && (says(b"facet") || says(b"endsolid"))
}

fn binary(bytes: &[u8], declared: u64) -> Result<RawMesh, Refuse> {
    let mut notes = Vec::new();
    let body = &bytes[HEADER..];
    let present = body.len() / RECORD;
    // Too few records: the file was cut.
    if declared > present as u64 {
        let problem = format!(
            "the header declares {declared} triangles ({} bytes), the file has {} bytes: {present} whole triangles",
            HEADER as u64 + RECORD as u64 * declared,
            bytes.len(),
        );
        return Err(Refuse::new("truncated", problem, "copy or export it again").at(format!("byte {}", bytes.len())));
    }
    let mut count = declared as usize;
    // More bytes than declared: a count of zero is taken as unset, anything else is ignored with a note.
    if body.len() > RECORD * count {
        if count == 0 && body.len().is_multiple_of(RECORD) {
            count = present;
            notes.push(format!("the header declares 0 triangles; all {present} in the file are used"));
        } else {
            let extra = body.len() - RECORD * count;
            notes.push(format!("{extra} bytes after the declared {count} triangles are ignored"));
        }
    }

    // A closed mesh has about half as many vertices as triangles.
    let mut welder = Welder::new(count / 2 + 2);
    let mut faces = Vec::with_capacity(3 * count);
    for (triangle, record) in body.chunks_exact(RECORD).take(count).enumerate() {
        // Little-endian floats after the record's normal of 12 bytes, which is not used.
        let number = |offset: usize| f32::from_le_bytes(record[offset..offset + 4].try_into().expect("4 bytes"));
        let corners: [[f32; 3]; 3] =
            std::array::from_fn(|k| std::array::from_fn(|axis| number(12 + 12 * k + 4 * axis)));
        // 0 for finite numbers, NaN otherwise.
        let poison: f32 = corners.iter().flatten().map(|coordinate| coordinate * 0.0).sum();
        if poison.is_nan() {
            return Err(not_finite(triangle, &corners));
        }
        // Equal positions become one vertex.
        let [a, b, c] = corners;
        faces.extend([welder.index(a), welder.index(b), welder.index(c)]);
    }
    let positions = welder.into_positions().into_iter().map(|position| position.map(f64::from)).collect();
    Builder::of_welded(positions, faces, notes).finish()
}

#[cold]
fn not_finite(triangle: usize, corners: &[[f32; 3]; 3]) -> Refuse {
    let corner = corners.iter().position(|corner| !corner.iter().all(|x| x.is_finite())).unwrap_or(0);
    let byte = HEADER + RECORD * triangle + 12 + 12 * corner;
    Refuse::not_finite(corners[corner].map(f64::from)).at(format!(
        "triangle {}, corner {}, byte {byte}",
        triangle + 1,
        corner + 1
    ))
}

/// ASCII: only "vertex", "endloop" and "endsolid" matter; one file may hold several solids.
fn ascii(bytes: &[u8]) -> Result<RawMesh, Refuse> {
    let mut builder = Builder::new("line");
    let (mut corners, mut last, mut open) = (0, 1, false);
    for (line, text) in Lines::of(bytes) {
        last = line;
        let mut words = words(text);
        let word = words.next().unwrap_or_default();
        if word.eq_ignore_ascii_case(b"vertex") {
            corners += 1;
            let vertex = builder.vertices() as i64;
            builder.vertex(position(&mut words, "a coordinate", line)?, || format!("line {line}"));
            builder.corner(vertex, || format!("line {line}"))?;
        } else if word.eq_ignore_ascii_case(b"endloop") || word.eq_ignore_ascii_case(b"facet") && corners > 0 {
            if corners != 3 {
                return Err(syntax(format!("a facet has {corners} corners; STL knows triangles alone"), line));
            }
            builder.end_polygon(line);
            corners = 0;
        } else if word.eq_ignore_ascii_case(b"solid") {
            open = true;
        } else if word.eq_ignore_ascii_case(b"endsolid") {
            open = false;
        } else if !word.is_empty() && !IGNORED.iter().any(|known| word.eq_ignore_ascii_case(known)) {
            return Err(syntax(format!("\"{}\" has no meaning in an ASCII STL", clipped(word)), line));
        }
    }
    if corners > 0 || open {
        return Err(ends_early("the file ends before endsolid", last));
    }
    builder.finish()
}

/// Words of an ASCII STL that do not describe its triangles.
const IGNORED: [&[u8]; 4] = [b"facet", b"outer", b"endfacet", b"color"];

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron() -> Vec<[[f32; 3]; 3]> {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]].iter().map(|face| face.map(|k: usize| corners[k])).collect()
    }

    fn binary_file(header: &[u8], declared: u32) -> Vec<u8> {
        let mut file = vec![b' '; 80];
        file[..header.len()].copy_from_slice(header);
        file.extend(declared.to_le_bytes());
        for triangle in tetrahedron() {
            file.extend([0; 12]);
            file.extend(triangle.iter().flatten().flat_map(|x| x.to_le_bytes()));
            file.extend([0; 2]);
        }
        file
    }

    fn ascii_file() -> String {
        let facet = |t: &[[f32; 3]; 3]| {
            let corner = |[x, y, z]: &[f32; 3]| format!("      vertex {x} {y:e} {z}\r\n");
            format!(
                "  FACET normal 0 0 0\r\n    outer loop\r\n{}    endloop\r\n  endfacet\r\n",
                t.iter().map(corner).collect::<String>()
            )
        };
        format!("solid two words\r\n{}endsolid two words\r\n", tetrahedron().iter().map(facet).collect::<String>())
    }

    #[test]
    fn binary_ascii_and_binary_that_says_solid_read_alike() {
        let binary = read(&binary_file(b"made by hand", 4)).unwrap();
        assert_eq!((binary.positions.len(), binary.faces.len()), (4, 4));
        assert_eq!(read(&binary_file(b"solid facet", 4)).unwrap(), binary);
        let ascii = read(ascii_file().as_bytes()).unwrap();
        let corner = |mesh: &RawMesh, face: usize, k: usize| mesh.positions[mesh.faces[face][k] as usize];
        assert!((0..12).all(|i| corner(&ascii, i / 3, i % 3) == corner(&binary, i / 3, i % 3)));
    }

    #[test]
    fn counts_that_do_not_fit_the_file() {
        let message = |file: &[u8]| read(file).unwrap_err().about("a.stl").to_string();
        let whole = binary_file(b"solid x", 4);
        assert_eq!(
            message(&whole[..200]),
            "a.stl: the header declares 4 triangles (284 bytes), the file has 200 bytes: 2 whole triangles (byte 200); \
             copy or export it again"
        );
        assert!(message(&whole[..50]).contains("starts with a header of 84"));
        assert_eq!(
            read(&binary_file(b"x", 0)).unwrap().notes,
            ["the header declares 0 triangles; all 4 in the file are used"]
        );
        let longer = [whole.as_slice(), &[1, 2, 3]].concat();
        assert_eq!(read(&longer).unwrap().notes, ["3 bytes after the declared 4 triangles are ignored"]);
        let text = ascii_file();
        let end = text.rfind("endsolid").unwrap();
        assert!(message(&text.as_bytes()[..end]).contains("the file ends before endsolid"));
        assert!(
            message(text.replacen("      vertex", "      vertexx", 1).as_bytes())
                .contains("\"vertexx\" has no meaning")
        );
    }

    #[test]
    fn a_coordinate_that_is_not_finite_is_located() {
        let mut file = binary_file(b"x", 4);
        let byte = 84 + 50 + 12 + 24 + 4;
        file[byte..byte + 4].copy_from_slice(&f32::NAN.to_le_bytes());
        let message = read(&file).unwrap_err().about("a.stl").to_string();
        assert!(message.contains("(0, NaN, 1) is not finite (triangle 2, corner 3, byte 170)"), "{message}");
    }
}
