//! Files that lie, end early, or are something else: each is refused with file, place and remedy, or accepted for a reason, and
//! none takes long.

use std::{fmt::Write, path::Path};

use graspmill::{
    assets::{MeshCheckRow, ScaleRule, SizeRule, check_report},
    geom::TriMesh,
    seed::Stream,
};

use crate::kernel::meshes::{join, reversed};
use crate::support::{
    meshes::{block, stl_bytes},
    program::Program,
    workspace::Workspace,
};

/// Verdict that a file must get.
#[derive(Clone, Copy, Debug)]
enum Wanted {
    /// Refused for this reason, and the text of the refusal holds these words.
    Refused(&'static str, &'static str),
    /// Accepted, without a repair and with the volume of the whole solid; a remark holds these words, which may be none.
    Accepted(&'static str),
    /// Accepted after a repair.
    Mended(&'static str),
    /// Accepted as a surface that is not closed; a remark holds these words.
    Open(&'static str),
}

use Wanted::{Accepted, Mended, Open, Refused};

/// A file by its name, its content and the verdict on it.
type Hostile = (&'static str, Vec<u8>, Wanted);

/// The solid that most files are about: a box of 60 x 80 x 100 mm.
const SIDES: [f32; 3] = [0.06, 0.08, 0.1];

fn solid() -> TriMesh {
    block([0.0; 3], SIDES)
}

/// Volume of [`solid`] [m^3].
const VOLUME: f64 = 0.06 * 0.08 * 0.1;

fn binary() -> Vec<u8> {
    stl_bytes(&solid())
}

/// With a count of triangles in the header that may be a lie.
fn counting(count: u32) -> Vec<u8> {
    let mut file = binary();
    file[80..84].copy_from_slice(&count.to_le_bytes());
    file
}

/// With another number in place of one coordinate of the second triangle.
fn with_number(number: f32) -> Vec<u8> {
    let mut file = binary();
    file[84 + 50 + 12..][..4].copy_from_slice(&number.to_le_bytes());
    file
}

fn facets(mesh: &TriMesh) -> String {
    let mut text = String::new();
    for [a, b, c] in &mesh.triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for vertex in [a, b, c] {
            let [x, y, z] = mesh.vertices[*vertex as usize];
            writeln!(text, "vertex {x} {y} {z}").expect("text");
        }
        text += "endloop\nendfacet\n";
    }
    text
}

fn text_stl() -> String {
    format!("solid box\n{}endsolid box\n", facets(&solid()))
}

/// Lines `v x y z` of a mesh.
fn vertices_of(mesh: &TriMesh) -> String {
    mesh.vertices.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect()
}

/// Lines `f a b c` of a mesh.
fn faces_of(mesh: &TriMesh) -> String {
    mesh.triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)).collect()
}

fn obj() -> String {
    vertices_of(&solid()) + &faces_of(&solid())
}

/// The box in lines without keywords, as PLY and OFF have them: positions, then faces with their counts of corners.
fn plain_lines() -> [String; 2] {
    let faces = solid().triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    [vertices_of(&solid()).replace("v ", ""), faces]
}

fn ply_header(format: &str, vertices: &str, faces: &str) -> String {
    format!(
        "ply\nformat {format} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
}

fn text_ply(vertices: &str, faces: &str) -> String {
    ply_header("ascii", vertices, faces) + &plain_lines().concat()
}

/// A binary file whose header names a byte order, with numbers in that of `bytes_of`.
fn binary_ply(format: &str, is_big: bool) -> Vec<u8> {
    let mut file = ply_header(format, "8", "12").into_bytes();
    let in_order = |bytes: [u8; 4]| if is_big { [bytes[3], bytes[2], bytes[1], bytes[0]] } else { bytes };
    for part in solid().vertices.iter().flatten() {
        file.extend(in_order(part.to_le_bytes()));
    }
    for face in solid().triangles {
        file.push(3);
        face.iter().for_each(|corner| file.extend(in_order(corner.to_le_bytes())));
    }
    file
}

fn off(counts: &str) -> String {
    format!("OFF\n{counts}\n{}", plain_lines().concat())
}

fn random_bytes(count: usize) -> Vec<u8> {
    let mut draw = Stream::of_job(1, b"hostile", "bytes");
    (0..count).map(|_| draw.below(256) as u8).collect()
}

/// Binary STL.
fn binary_stl() -> Vec<Hostile> {
    let truncated = |words| Refused("truncated", words);
    let mut says_solid = binary();
    says_solid[..11].copy_from_slice(b"solid facet");
    let mut normals = binary();
    (0..12).for_each(|face| normals[84 + 50 * face..][..12].fill(0xff));
    let swapped: Vec<u8> = binary()[80..].chunks(4).flat_map(|word| word.iter().rev().copied()).collect();
    vec![
        ("count 2^31.stl", counting(1 << 31), truncated("the header declares 2147483648 triangles")),
        ("count 2^32 - 1.stl", counting(u32::MAX), truncated("the header declares 4294967295 triangles")),
        ("one triangle too few.stl", counting(13), truncated("the file has 684 bytes: 12 whole triangles (byte 684)")),
        ("count 0.stl", counting(0), Accepted("the header declares 0 triangles; all 12 in the file are used")),
        ("count too small.stl", counting(10), Open("100 bytes after the declared 10 triangles are ignored")),
        ("cut in the header.stl", binary()[..50].into(), truncated("a binary STL starts with a header of 84")),
        ("cut after the header.stl", binary()[..84].into(), truncated("0 whole triangles (byte 84)")),
        ("cut in a triangle.stl", binary()[..400].into(), truncated("6 whole triangles (byte 400)")),
        ("one byte more.stl", [binary(), vec![7]].concat(), Accepted("1 bytes after the declared 12 triangles")),
        ("NaN.stl", with_number(f32::NAN), Refused("not_finite", "triangle 2, corner 1, byte 146")),
        ("infinity.stl", with_number(f32::INFINITY), Refused("not_finite", "(inf, ")),
        (
            "largest number.stl",
            with_number(f32::MAX),
            Refused("too_large", "longest side 3.403e38 m, outside 5.000 mm to 2.000 m"),
        ),
        ("smallest number.stl", with_number(1e-45), Open("")),
        ("normals NaN.stl", normals, Accepted("")),
        ("says solid.stl", says_solid, Accepted("")),
        ("big-endian.stl", [vec![0; 80], swapped].concat(), truncated("the header declares 201326592 triangles")),
        ("zeros.stl", vec![0; 84 + 50 * 12], Refused("no_volume", "no face encloses anything")),
        ("noise.stl", [&counting(12)[..84], &random_bytes(600)].concat(), Refused("too_large", "no common unit fits")),
    ]
}

/// Text STL.
fn text_stls() -> Vec<Hostile> {
    let text = text_stl();
    let file = |text: String| text.into_bytes();
    let quads = text.replacen("endloop", "vertex 0 0 0\nendloop", 1);
    let twice = format!("{text}{}", text_stl());
    let spaced = text.replace(' ', "\t  \t").replace('\n', "  \n\n");
    let lines = text.lines().count();
    let cut = text.find("endsolid").expect("an end");
    vec![
        ("CRLF.stl", file(text.replace('\n', "\r\n")), Accepted("")),
        ("CR.stl", file(text.replace('\n', "\r")), Accepted("")),
        ("capitals.stl", file(text.to_uppercase()), Accepted("")),
        ("tabs and empty lines.stl", file(spaced), Accepted("")),
        ("byte order mark.stl", [&b"\xef\xbb\xbf"[..], text.as_bytes()].concat(), Accepted("")),
        ("twice the same solid.stl", file(twice), Mended("12 faces on the same vertices dropped")),
        (
            "facet of four.stl",
            file(quads),
            Refused("syntax", "a facet has 4 corners; STL knows triangles alone (line 8)"),
        ),
        ("facet of two.stl", file(text.replacen("vertex 0 0 0\n", "", 1)), Refused("syntax", "a facet has 2 corners")),
        ("decimal comma.stl", file(text.replace("0.06", "0,06")), Refused("syntax", "decimal points")),
        ("no end.stl", file(text[..cut].into()), Refused("truncated", "the file ends before endsolid")),
        ("cut in a number.stl", file(text[..cut / 2].into()), Refused("", "line ")),
        ("nan.stl", file(text.replacen("0.06", "-nan", 1)), Refused("", "line ")),
        ("number past all.stl", file(text.replacen("0.06", "1e999", 1)), Refused("not_finite", "inf")),
        ("junk of 8 MB.stl", file(text.replacen("facet", &"x".repeat(8 << 20), 1)), Refused("", "")),
        ("blanks of 8 MB.stl", file(text.replacen("0.06", &format!("{}0.06", " ".repeat(8 << 20)), 1)), Accepted("")),
        ("no facet.stl", file("solid nothing\nendsolid nothing\n".repeat(9)), Refused("no_faces", "0 points")),
        ("terminal codes.stl", file(text.replacen("outer", "\x1b[2J\x07", 1)), Refused("syntax", r"\u{1b}[2J\u{7}")),
        ("lines.stl", file(text.clone() + &"\n".repeat(lines)), Accepted("")),
    ]
}

/// Wavefront OBJ.
fn objs() -> Vec<Hostile> {
    let (vertices, faces, all) = (vertices_of(&solid()), faces_of(&solid()), obj());
    let file = |text: String| text.into_bytes();
    let face = |face: &str| format!("{vertices}{face}\n{faces}").into_bytes();
    let range = |words| Refused("index_out_of_range", words);
    let groups: String = (0..50_000).map(|_| "o same\ng same\nusemtl same\n").collect();
    let mut long = all.replace('\n', " \\\n\n");
    long += "\\\n\\\n\\";
    vec![
        ("vertex 0.obj", face("f 0 1 2"), Refused("syntax", "a face names vertex 0; OBJ counts from 1 (line 9)")),
        ("vertex beyond.obj", face("f 1 2 9"), range("vertex 8 (counted from 0), but there are 8 (line 9)")),
        ("vertex far back.obj", face("f 1 2 -9"), range("vertex -1 (counted from 0)")),
        ("vertex 2^31.obj", face("f 1 2 2147483648"), range("vertex 2147483647")),
        ("vertex 2^32.obj", face("f 1 2 4294967296"), range("vertex 4294967295")),
        ("vertex 2^63.obj", face("f 1 2 9223372036854775808"), Refused("syntax", "is no corner of a face (line 9)")),
        (
            "vertex of 1 MB.obj",
            face(&format!("f 1 2 {}", "9".repeat(1 << 20))),
            Refused("syntax", "...\" is no corner of a face (line 9)"),
        ),
        ("face of two.obj", face("f 1 2"), Accepted("1 faces of fewer than three corners are ignored")),
        ("face of one vertex.obj", face("f 1 1 1"), Mended("1 face without area dropped")),
        ("number missing.obj", file(all.replacen("v 0 0 0", "v 0 0", 1)), Refused("syntax", "is missing (line 1)")),
        ("hexadecimal.obj", file(all.replacen("0.06", "0x10", 1)), Refused("syntax", "\"0x10\", no number (line 2)")),
        ("Fortran's exponent.obj", file(all.replacen("0.06", "6D-2", 1)), Refused("syntax", "\"6D-2\", no number")),
        ("NaN of Microsoft.obj", file(all.replacen("0.06", "-1.#IND", 1)), Refused("not_finite", "NaN")),
        ("NaN that no face uses.obj", file(all.clone() + "v nan inf -inf\n"), Mended("1 unused vertex dropped")),
        ("NUL.obj", file(all.replacen("0.06", "0.06\0", 1)), Refused("syntax", r"0.06\0")),
        ("weights and colours.obj", file(vertices.replace('\n', " 0 0 0\n") + &faces), Accepted("")),
        ("byte order mark.obj", [&b"\xef\xbb\xbf"[..], all.as_bytes()].concat(), Accepted("")),
        ("byte order mark, CR.obj", file(format!("\u{feff}{}", all.replace('\n', "\r"))), Accepted("")),
        ("library of passwords.obj", file(format!("mtllib ../../../../etc/passwd\n{all}")), Accepted("")),
        ("names of no language.obj", [&b"o \xff\xfe\x80\n"[..], all.as_bytes()].concat(), Accepted("")),
        ("150,000 groups of one name.obj", file(groups + &all), Accepted("")),
        ("lines joined to the end.obj", file(long), Accepted("")),
        ("lines joined, 1 MB.obj", file(all.clone() + &"\\\n".repeat(1 << 19)), Accepted("")),
        ("comment of 8 MB.obj", file(format!("#{}\n{all}", "x".repeat(8 << 20))), Accepted("")),
        (
            "points and lines.obj",
            file(vertices.clone() + "p 1 2\nl 1 2 3\n"),
            Refused("no_faces", "8 points, but no faces"),
        ),
        (
            "curves alone.obj",
            file(vertices + "curv 0 1 1 2\nsurf 0 1 0 1 1 2\n"),
            Refused("no_faces", "not points or lines"),
        ),
    ]
}

/// PLY and OFF.
fn plys_and_offs() -> Vec<Hostile> {
    let file = |text: String| text.into_bytes();
    let truncated = |words| Refused("truncated", words);
    let syntax = |words| Refused("syntax", words);
    let good = text_ply("8", "12");
    let [positions, faces] = plain_lines();
    let before = |line: &str| file(good.replacen("element vertex", &format!("{line}\nelement vertex"), 1));
    let first_face = |line: &str| file(good.replacen("3 0 2 3", line, 1));
    let rows_first = "ply\nformat ascii 1.0\nelement face 12\nproperty list uchar int vertex_indices\nelement vertex 8\n\
                      property float x\nproperty float y\nproperty float z\nend_header\n";
    let little = binary_ply("binary_little_endian", false);
    let mut long_list = little.clone();
    let face = long_list.len() - 12 * 13;
    long_list[face] = 255;
    let elements: String = (0..100_000).map(|index| format!("element e{index} 0\nproperty float a\n")).collect();
    let split =
        good.replacen("end_header\n", "end_header\0", 1).replace(' ', "\n").replacen("end_header\0", "end_header\n", 1);
    let header = good.find("end_header").expect("an end") + 11;
    let split = good[..header].to_owned() + &split[split.len() - (good.len() - header)..];
    vec![
        ("2^64 - 1 vertices.ply", file(text_ply("18446744073709551615", "12")), truncated("the file ends after 24")),
        ("2^64 vertices.ply", file(text_ply("18446744073709551616", "12")), syntax("is no count (line 3)")),
        ("-1 faces.ply", file(text_ply("8", "-1")), syntax("\"-1\" is no count (line 7)")),
        (
            "one face more.ply",
            file(text_ply("8", "13")),
            truncated("declares 13 of element face, the file ends after 12"),
        ),
        ("2^63 rows of nothing.ply", before("element nothing 9223372036854775808"), Accepted("")),
        (
            "100,000 elements.ply",
            file(good.replacen("element vertex", &format!("{elements}element vertex"), 1)),
            Accepted(""),
        ),
        ("no end of the header.ply", file(good[..header - 11].into()), truncated("the header has no end")),
        ("no format.ply", file(good.replacen("format ascii 1.0\n", "", 1)), syntax("the header names no format")),
        ("unknown type.ply", file(good.replacen("float y", "half y", 1)), syntax("\"half\" is no PLY type (line 5)")),
        ("name of 1 MB.ply", before(&format!("element {} 1\nproperty float a", "e".repeat(1 << 20))), Refused("", "")),
        ("corner 1.5.ply", first_face("3 0 2 1.5"), syntax("a face names vertex 1.5, no whole number (face 1, line ")),
        ("corner nan.ply", first_face("3 0 2 nan"), syntax("a face names vertex NaN, no whole number")),
        ("corner -1.ply", first_face("3 0 2 -1"), Refused("index_out_of_range", "vertex -1 (counted from 0)")),
        ("list of -3.ply", first_face("-3 0 2 3"), syntax("has -3 items")),
        ("list of nan.ply", first_face("nan 0 2 3"), syntax("has NaN items")),
        ("list of 255 in 12 bytes.ply", long_list, Refused("", "")),
        ("little-endian.ply", little.clone(), Accepted("")),
        ("big-endian.ply", binary_ply("binary_big_endian", true), Accepted("")),
        ("big-endian, labelled little.ply", binary_ply("binary_little_endian", true), Refused("", "")),
        ("cut in the last number.ply", little[..little.len() - 1].into(), truncated("the file ends after 11")),
        ("faces before vertices.ply", file(format!("{rows_first}{faces}{positions}")), Accepted("")),
        ("a number in each line.ply", file(split), Accepted("")),
        ("vertices alone.ply", file(ply_header("ascii", "8", "0") + &positions), Refused("no_faces", "8 points")),
        (
            "strips.ply",
            before("element tristrips 1\nproperty list int int vertex_indices"),
            Refused("format", "strips"),
        ),
        ("byte order mark.ply", [&b"\xef\xbb\xbf"[..], good.as_bytes()].concat(), Accepted("")),
        ("2^63 vertices.off", file(off("9223372036854775807 12 0")), syntax("no whole number")),
        ("4 billion vertices.off", file(off("4000000000 12 0")), truncated("20 of 4000000000 vertices")),
        ("-8 vertices.off", file(off("-8 12 0")), syntax("the number of vertices is -8 (line 2)")),
        (
            "face of -3.off",
            file(off("8 12 0").replacen("3 0 2 3", "-3 0 2 3", 1)),
            syntax("the number of corners is -3"),
        ),
        ("face of 4 billion.off", file(off("8 12 0").replacen("3 0 2 3", "4000000000 0 2 3", 1)), syntax("is missing")),
        ("four dimensions.off", file(off("8 12 0").replacen("OFF", "4OFF", 1)), Refused("", "")),
        (
            "binary.off",
            file(off("8 12 0").replacen("OFF", "OFF BINARY", 1)),
            Refused("format", "binary OFF is not read"),
        ),
        ("byte order mark.off", file(format!("\u{feff}{}", off("8 12 0"))), Accepted("")),
    ]
}

/// Files that are something else.
fn disguises() -> Vec<Hostile> {
    let utf16 = |text: String| -> Vec<u8> {
        [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    };
    let packed = |magic: &[u8]| [magic, &random_bytes(5_000)].concat();
    let compressed = |program| Refused("compressed", program);
    vec![
        ("empty.stl", Vec::new(), Refused("empty_file", "the file is empty; export or copy it again")),
        ("blanks.obj", b" \n\t\r\n".repeat(50), Refused("no_faces", "0 points, but no faces")),
        ("blanks.off", b" \n\t\r\n".repeat(50), Refused("truncated", "only comments")),
        ("gzip.stl", packed(b"\x1f\x8b\x08\x00"), compressed("its content is compressed by gzip; unpack it")),
        ("gzip.obj", packed(b"\x1f\x8b\x08\x00"), compressed("gzip")),
        ("zip.obj", packed(b"PK\x03\x04"), compressed("zip")),
        ("zstd.ply", packed(b"\x28\xb5\x2f\xfd"), compressed("zstd")),
        ("xz.off", packed(b"\xfd7zXZ\0"), compressed("xz")),
        ("UTF-16.obj", utf16(obj()), Refused("encoding", "its text is in UTF-16; save it as UTF-8 or plain ASCII")),
        ("UTF-16.stl", utf16(text_stl()), Refused("encoding", "UTF-16")),
        (
            "glTF.stl",
            packed(b"glTF\x02\0\0\0"),
            Refused("format", "its content is glTF, which is not read; convert it"),
        ),
        ("COLLADA.obj", b"<?xml version=\"1.0\"?><COLLADA/>".into(), Refused("format", "its content is XML")),
        (
            "web page.stl",
            b"\n<!DOCTYPE html><html><body>404</body></html>".into(),
            Refused("web_page", "download the file"),
        ),
        (
            "PLY.stl",
            text_ply("8", "12").into_bytes(),
            Refused("format", "looks like .ply, its name does not; rename it"),
        ),
        ("OFF.obj", off("8 12 0").into_bytes(), Refused("format", "rename it to .off")),
        ("STL.ply", text_stl().into_bytes(), Refused("format", "rename it to .stl")),
        ("noise.obj", random_bytes(200_000), Refused("", "")),
        ("noise.ply", random_bytes(200_000), Refused("format", "it does not start with \"ply\"")),
        ("noise.off", random_bytes(200_000), Refused("", "")),
    ]
}

/// A closed cylinder whose two end faces have `corners` corners each.
fn coin(corners: usize) -> String {
    let angle = |corner: usize| std::f64::consts::TAU * corner as f64 / corners as f64;
    let ring = |z: f64| (0..corners).map(angle).map(move |a| format!("v {} {} {z}\n", 0.05 * a.cos(), 0.05 * a.sin()));
    let mut text: String = ring(0.0).chain(ring(0.02)).collect();
    text += "f";
    (1..=corners).rev().for_each(|corner| write!(text, " {corner}").expect("text"));
    text += "\nf";
    (1..=corners).for_each(|corner| write!(text, " {}", corners + corner).expect("text"));
    for corner in 0..corners {
        let (a, b) = (corner + 1, (corner + 1) % corners + 1);
        write!(text, "\nf {a} {b} {} {}", corners + b, corners + a).expect("text");
    }
    text + "\n"
}

/// Spirals with a thickness, side by side: polygons of many corners whose ears lie at their ends.
fn spirals(count: usize, corners: usize) -> String {
    let (mut vertices, mut faces) = (String::new(), String::new());
    for index in 0..count {
        let along = |step: usize, inner: f64| {
            let turn = 40.0 * step as f64 / (corners / 2) as f64;
            let radius = 0.001 * (turn + 4.0) - inner;
            (0.1 * index as f64 + radius * turn.cos(), radius * turn.sin())
        };
        let outline: Vec<(f64, f64)> = (0..corners / 2)
            .map(|step| along(step, 0.0))
            .chain((0..corners / 2).rev().map(|step| along(step, 0.003)))
            .collect();
        for z in [0.0, 0.01] {
            outline.iter().for_each(|(x, y)| writeln!(vertices, "v {x} {y} {z}").expect("text"));
        }
        let (low, high) = (2 * index * corners + 1, (2 * index + 1) * corners + 1);
        let line = |mut corners: Vec<usize>, reverse: bool| {
            if reverse {
                corners.reverse();
            }
            corners.iter().fold("f".to_owned(), |line, corner| format!("{line} {corner}")) + "\n"
        };
        faces += &line((low..low + corners).collect(), true);
        faces += &line((high..high + corners).collect(), false);
        for step in 0..corners {
            let next = (step + 1) % corners;
            faces += &line(vec![low + step, low + next, high + next, high + step], false);
        }
    }
    vertices + &faces
}

/// Faces round one edge like the pages of a book.
fn book(pages: usize) -> TriMesh {
    let angle = |page: usize| std::f64::consts::TAU * page as f64 / pages as f64;
    let tip = |page: usize| [0.05 * angle(page).cos() as f32, 0.05 * angle(page).sin() as f32, 0.05];
    TriMesh {
        vertices: [[0.0; 3], [0.0, 0.0, 0.1]].into_iter().chain((0..pages).map(tip)).collect(),
        triangles: (0..pages as u32).map(|page| [0, 1, 2 + page]).collect(),
    }
}

/// Boxes in one another, each turned against the one around it.
fn nested(count: usize) -> TriMesh {
    let side = |index: usize| 0.1 * (1.0 - index as f32 / count as f32);
    let part = |index: usize| {
        let half = side(index) / 2.0;
        reversed(block([-half; 3], [half; 3]), |_| index % 2 == 1)
    };
    join(&(0..count).map(part).collect::<Vec<_>>())
}

/// Shapes that cost a careless program much.
fn costly() -> Vec<Hostile> {
    vec![
        ("million corners.obj", coin(1_000_000).into_bytes(), Open("")),
        ("thousand corners.obj", coin(1_000).into_bytes(), Open("")),
        ("spirals.obj", spirals(10, 1_000).into_bytes(), Open("")),
        ("book of 100,000 pages.stl", stl_bytes(&book(100_000)), Refused("", "")),
        ("3,000 nested boxes.stl", stl_bytes(&nested(3_000)), Open("2999 cavities inside, kept hollow")),
    ]
}

fn hostile_files() -> Vec<(&'static str, Vec<Hostile>)> {
    vec![
        ("binary STL", binary_stl()),
        ("text STL", text_stls()),
        ("OBJ", objs()),
        ("PLY and OFF", plys_and_offs()),
        ("something else", disguises()),
    ]
}

/// A row that a test judges: its verdict in a word, its problem or remarks, and whether it is the expected one.
fn judge(row: &MeshCheckRow, wanted: Wanted) -> (&'static str, String, bool) {
    if let Some(refusal) = &row.refusal {
        let text = refusal.to_string();
        let is_right = match wanted {
            Refused(reason, words) => {
                (reason.is_empty() || refusal.reason == reason) && text.contains(words) && !refusal.remedy.is_empty()
            }
            _ => false,
        };
        // A line of the table, not a page, for any content of the file.
        let is_short = text.len() < 700;
        return ("refused", text, is_right && is_short);
    }
    let record = row.record.as_ref().expect("a record or a refusal");
    let repairs: Vec<String> = record.repairs.iter().map(ToString::to_string).collect();
    let remarks = [repairs.clone(), record.warnings.clone()].concat().join("; ");
    let is_whole = record.watertight && (record.volume / VOLUME - 1.0).abs() < 1e-5;
    let (verdict, is_right) = match wanted {
        Accepted(words) => ("accepted", repairs.is_empty() && is_whole && remarks.contains(words)),
        Mended(words) => ("repaired", !repairs.is_empty() && is_whole && remarks.contains(words)),
        Open(words) => ("accepted", remarks.contains(words)),
        Refused(..) => ("accepted", false),
    };
    (verdict, remarks, is_right)
}

fn check(path: &Path) -> MeshCheckRow {
    check_report(&[path.to_owned()], ScaleRule::MetresPerUnit(1.0), SizeRule::default()).meshes.remove(0)
}

/// Judges every file of the groups; how many there are.
#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn judge_files(groups: Vec<(&str, Vec<Hostile>)>) -> usize {
    let folder = Workspace::new();
    let (mut wrong, mut count) = (Vec::new(), 0);
    println!("| file | bytes | verdict | words |\n| --- | --- | --- | --- |");
    for (group, files) in groups {
        let mut verdicts = std::collections::BTreeMap::<&str, u32>::new();
        for (name, content, wanted) in files {
            let path = folder.write(name, &content);
            let (verdict, words, is_right) = judge(&check(&path), wanted);
            let words = words.replace(&folder.folder().display().to_string(), "");
            println!("| {name} | {} | {verdict} | {words} |", content.len());
            if !is_right {
                wrong.push(format!("{name}: {verdict}: {words}: wanted {wanted:?}"));
            }
            *verdicts.entry(verdict).or_default() += 1;
            count += 1;
        }
        println!("| **{group}** | | {verdicts:?} | |");
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
    count
}

#[test]
fn every_hostile_file_gets_its_verdict() {
    let count = judge_files(hostile_files());
    assert!(count >= 80, "{count} files");
}

#[test]
#[ignore = "slow: make test-all"]
fn every_costly_file_gets_its_verdict() {
    assert_eq!(judge_files(vec![("costly", costly())]), 5);
}

/// The program itself ends on all of them, within 3 GB of address space: the largest file has 47 MB.
#[test]
#[ignore = "slow: make test-all"]
fn the_program_survives_every_hostile_file() {
    let folder = Workspace::new();
    for (_, files) in hostile_files().into_iter().chain([("costly", costly())]) {
        files.iter().for_each(|(name, content, _)| drop(folder.write(name, content)));
    }
    let line = "ulimit -v 3000000; exec \"$0\" meshes check \"$1\" --json";
    let program = Program::of_system("bash").option("-c", line).arg(env!("CARGO_BIN_EXE_graspmill"));
    let outcome = program.arg(folder.folder()).expect_code(3);
    let report: serde_json::Value = outcome.json();
    let total = report["counts"]["total"].as_u64().expect("a count");
    assert!(total >= 80 && report["counts"]["refused"].as_u64().expect("a count") >= 40, "{}", report["counts"]);
}
