//! Files whose content differs from their extension: archives, web pages, text in UTF-16, other formats of meshes.

use super::raw::CONVERT;
use crate::Refuse;

/// First bytes of compressed files and archives, with the programs that make them.
const COMPRESSED: [(&[u8], &str); 6] = [
    (b"\x1f\x8b", "gzip"),
    (b"PK\x03\x04", "zip"),
    (b"\x28\xb5\x2f\xfd", "zstd"),
    (b"\xfd7zXZ\0", "xz"),
    (b"BZh", "bzip2"),
    (b"7z\xbc\xaf\x27\x1c", "7-Zip"),
];

/// First bytes of formats that are not read, with their names.
const NOT_READ: [(&[u8], &str); 4] =
    [(b"glTF", "glTF"), (b"Kaydara FBX Binary", "FBX"), (b"ISO-10303-21", "STEP"), (b"<?xml", "XML, such as COLLADA")];

/// First words of the text formats that are read, with the extensions of their files.
const READ: [(&[u8], &str); 3] = [(b"ply", "ply"), (b"OFF", "off"), (b"solid", "stl")];

/// Refusal of a file that cannot be read as its extension, if its first bytes identify another format.
pub(super) fn refusal(bytes: &[u8], extension: Option<&str>) -> Option<Refuse> {
    let starts = |magic: &[u8]| bytes.starts_with(magic);
    if let Some((_, program)) = COMPRESSED.iter().find(|(magic, _)| starts(magic)) {
        let remedy = "unpack it, and name the file that comes out";
        return Some(Refuse::new("compressed", format!("its content is compressed by {program}"), remedy));
    }
    if starts(b"\xff\xfe") || starts(b"\xfe\xff") {
        return Some(Refuse::new("encoding", "its text is in UTF-16", "save it as UTF-8 or plain ASCII"));
    }
    if let Some((_, format)) = NOT_READ.iter().find(|(magic, _)| starts(magic)) {
        return Some(Refuse::new("format", format!("its content is {format}, which is not read"), CONVERT));
    }
    let text = bytes.trim_ascii_start();
    let says = |word: &[u8]| text.get(..word.len()).is_some_and(|start| start.eq_ignore_ascii_case(word));
    if says(b"<!doctype html") || says(b"<html") {
        let remedy = "download the file itself: the address led to a page about it";
        return Some(Refuse::new("web_page", "the file is a web page instead of a mesh", remedy));
    }
    // A whole word: a comment or a name may begin with the same letters.
    let is_word = |word: &[u8]| says(word) && text.get(word.len()).is_some_and(u8::is_ascii_whitespace);
    let (_, other) = READ.iter().find(|(word, other)| is_word(word) && extension != Some(other))?;
    let problem = format!("its content looks like .{other}, its name does not");
    Some(Refuse::new("format", problem, format!("rename it to .{other}")))
}
