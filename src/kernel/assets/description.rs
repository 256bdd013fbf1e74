//! A robot's or scene's description by content: the MJCF text and every file that it names.

use std::{
    collections::BTreeSet,
    io,
    path::{Path, PathBuf},
};

use super::description_limits::{DescriptionTooLarge, MAX_COPIES, check_values, copies};
use crate::{
    files::{self, Bound},
    ids::Digest,
    remedy,
    words::Show,
};

/// Why a description has no digest.
#[derive(Debug, thiserror::Error)]
#[error("{} ({source}){}", path.shown(), named_by(by.as_deref()))]
pub struct DescriptionError {
    /// The file that could not be read.
    pub path: PathBuf,
    /// The file that names it; `None` for the description itself.
    pub by: Option<PathBuf>,
    /// Why not.
    pub source: io::Error,
}

impl DescriptionError {
    /// Remedy for the error, as a sentence for the user.
    pub fn remedy(&self) -> &'static str {
        match (self.source.kind(), &self.by) {
            (io::ErrorKind::NotFound, Some(_)) => missing_remedy(&self.path),
            (io::ErrorKind::NotFound, None) if self.path.extension().is_some_and(|ending| ending == TABLE) => {
                "a hand's table stands beside its description under the same name: docs/hands.md"
            }
            (io::ErrorKind::NotFound, None) => "check the path: it starts at the job file's folder",
            (io::ErrorKind::FileTooLarge, _) => "write it with less",
            _ => remedy::for_reading(&self.source),
        }
    }
}

/// Ending of a hand's table.
const TABLE: &str = "toml";

/// Remedy for a missing file that a robot's description names.
pub fn missing_remedy(file: &Path) -> &'static str {
    let parts: Vec<_> = file.components().map(|part| part.as_os_str()).collect();
    let fetched =
        parts.windows(2).any(|pair| pair[0] == ".deps" && ["fetch", "panda"].iter().any(|name| pair[1] == *name));
    if fetched { "run `make robots`, which fetches it" } else { "check meshdir and the file's name" }
}

fn named_by(by: Option<&Path>) -> String {
    by.map(|by| format!(", named by {}", by.shown())).unwrap_or_default()
}

/// Contents of an MJCF file and of the files that it names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// The name that it gives itself; MuJoCo's own word for a model without one otherwise.
    pub name: String,
    /// Digest of its text and of all files that it includes or takes meshes, height fields and textures from, in the
    /// order in which they are named. The location of the files does not count, their names only as they stand in the text.
    pub digest: Digest,
}

impl Description {
    /// Reads an MJCF file and what it names.
    ///
    /// # Errors
    /// When a file can't be read, or asks for too much ([`DescriptionTooLarge`]).
    pub fn read(path: &Path) -> Result<Self, DescriptionError> {
        let mut walk = Walk::new(path, Some(Vec::new()));
        walk.text(path, None)?;
        let digests = walk.digests.unwrap_or_default();
        let parts = digests.iter().map(|digest| digest.0.as_slice());
        let digest = Digest::of_parts([b"graspmill description".as_slice()].into_iter().chain(parts));
        Ok(Self { name: walk.name.unwrap_or_else(|| "MuJoCo Model".to_owned()), digest })
    }

    /// Opens an MJCF file and what it names, and reads of it the text alone.
    ///
    /// # Errors
    /// When a file can't be opened, or asks MuJoCo for more memory or copies than any robot, hand or scene needs
    /// ([`DescriptionTooLarge`]).
    pub fn check_files(path: &Path) -> Result<(), DescriptionError> {
        Walk::new(path, None).text(path, None)
    }
}

impl Description {
    /// Reads a hand's MJCF file and what it names, and the table beside it, which has the same name and ends in `.toml`.
    ///
    /// # Errors
    /// When a file can't be read.
    pub fn of_hand(path: &Path) -> Result<Self, DescriptionError> {
        let Self { name, digest } = Self::read(path)?;
        let table = path.with_extension(TABLE);
        let bytes = files::read(&table, Bound::HAND_TABLE).map_err(|source| DescriptionError {
            path: table,
            by: None,
            source,
        })?;
        let digest = Digest::of_parts([b"graspmill hand".as_slice(), &digest.0, &Digest::of(&bytes).0]);
        Ok(Self { name, digest })
    }
}

fn unreadable(path: &Path, by: Option<&Path>) -> impl FnOnce(io::Error) -> DescriptionError {
    move |source| DescriptionError { path: path.to_owned(), by: by.map(Path::to_owned), source }
}

/// Where files of a kind lie, as the `compiler` element says.
#[derive(Default)]
struct Folders {
    meshes: PathBuf,
    textures: PathBuf,
    strip: bool,
}

struct Walk<'a> {
    /// Folder of the description: names are relative to it.
    main: &'a Path,
    folders: Folders,
    /// The first model's name.
    name: Option<String>,
    seen: BTreeSet<PathBuf>,
    /// Copies of what stands at this point of the text, one factor per open element that makes copies.
    factors: Vec<f64>,
    /// Copies that elements asked for so far.
    copies: f64,
    /// Digests of all files; `None` where only text is read.
    digests: Option<Vec<Digest>>,
}

impl<'a> Walk<'a> {
    fn new(path: &'a Path, digests: Option<Vec<Digest>>) -> Self {
        let main = path.parent().unwrap_or(Path::new(""));
        let (seen, factors) = (BTreeSet::new(), Vec::new());
        Self { main, folders: Folders::default(), name: None, seen, factors, copies: 0.0, digests }
    }

    fn text(&mut self, path: &Path, by: Option<&Path>) -> Result<(), DescriptionError> {
        let bytes = self.bytes(path, by)?;
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let elements = elements(&text);
        for element in elements.iter().filter(|element| element.tag != Tag::End) {
            match element.name {
                "compiler" => self.compiler(element),
                "mujoco" if by.is_none() => self.name = element.get("model").map(str::to_owned),
                _ => {}
            }
        }
        for element in &elements {
            let too_large = |error| unreadable(path, by)(io::Error::new(io::ErrorKind::FileTooLarge, error));
            self.check_size(element).map_err(too_large)?;
            let Element { name, attributes, .. } = element;
            let files = attributes.iter().filter(|(key, _)| key.starts_with("file"));
            for file in files.map(|(_, file)| Path::new(*file)).filter(|file| !file.as_os_str().is_empty()) {
                let below = match *name {
                    "mesh" | "hfield" | "skin" | "flexcomp" | "composite" => self.folders.meshes.as_path(),
                    "texture" => self.folders.textures.as_path(),
                    _ => Path::new(""),
                };
                let is_text = matches!(*name, "include" | "model");
                let stripped = file.file_name().filter(|_| self.folders.strip && !is_text).map(Path::new);
                let named = below.join(stripped.unwrap_or(file));
                let beside = path.parent().unwrap_or(Path::new("")).join(file);
                let file =
                    Some(self.main.join(named)).filter(|file| files::is_present(file) || !files::is_present(&beside));
                let file = file.unwrap_or(beside);
                if self.seen.insert(file.clone()) {
                    if is_text { self.text(&file, Some(path))? } else { self.data(&file, Some(path))? }
                }
            }
        }
        Ok(())
    }

    /// Refuses an element that asks for too much, and keeps count of copies.
    fn check_size(&mut self, element: &Element) -> Result<(), DescriptionTooLarge> {
        let Element { name, attributes, tag } = element;
        let Some(copies) = copies(name, element.get("count")) else { return check_values(name, attributes) };
        if *tag == Tag::End {
            self.factors.pop();
            return Ok(());
        }
        self.copies += self.factors.iter().product::<f64>() * copies;
        if *tag == Tag::Start {
            self.factors.push(copies);
        }
        if self.copies > MAX_COPIES {
            return Err(DescriptionTooLarge::Copies { copies: self.copies, element: (*name).to_owned() });
        }
        Ok(())
    }

    fn bytes(&mut self, path: &Path, by: Option<&Path>) -> Result<Vec<u8>, DescriptionError> {
        let bytes = files::read(path, Bound::DESCRIPTION).map_err(unreadable(path, by))?;
        if let Some(digests) = &mut self.digests {
            digests.push(Digest::of(&bytes));
        }
        Ok(bytes)
    }

    /// A file that names no others: a mesh, a height field, a texture.
    fn data(&mut self, path: &Path, by: Option<&Path>) -> Result<(), DescriptionError> {
        let file = files::open_bounded(path, Bound::DESCRIPTION_DATA).map_err(unreadable(path, by))?;
        if let Some(digests) = &mut self.digests {
            digests.push(Digest::of_reader(file).map_err(unreadable(path, by))?.0);
        }
        Ok(())
    }

    fn compiler(&mut self, element: &Element) {
        for (key, value) in &element.attributes {
            match *key {
                "meshdir" => self.folders.meshes = value.into(),
                "texturedir" => self.folders.textures = value.into(),
                "assetdir" => (self.folders.meshes, self.folders.textures) = (value.into(), value.into()),
                "strippath" => self.folders.strip = *value == "true",
                _ => {}
            }
        }
    }
}

/// Kind of a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tag {
    Start,
    /// A tag without content, `<geom/>`.
    Empty,
    End,
}

/// A tag.
struct Element<'a> {
    tag: Tag,
    name: &'a str,
    attributes: Vec<(&'a str, &'a str)>,
}

impl Element<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(name, _)| *name == key).map(|(_, value)| *value)
    }
}

/// The tags of an XML text that an XML parser has taken: comments and declarations are passed over.
fn elements(text: &str) -> Vec<Element<'_>> {
    let mut elements = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        let end = if rest.starts_with("<!--") { rest.find("-->").map(|end| end + 3) } else { end_of_tag(rest) };
        let Some(end) = end else { break };
        let tag = &rest[1..end.max(2) - 1];
        rest = &rest[end..];
        let (kind, tag) = match tag.strip_prefix('/') {
            Some(tag) => (Tag::End, tag),
            None if tag.ends_with('/') => (Tag::Empty, tag),
            None => (Tag::Start, tag),
        };
        if tag.starts_with(|c: char| c.is_alphabetic() || c == '_') {
            let split = tag.find(|c: char| c.is_whitespace() || c == '/').unwrap_or(tag.len());
            elements.push(Element { tag: kind, name: &tag[..split], attributes: attributes(&tag[split..]) });
        }
    }
    elements
}

/// Just behind the `>` that ends a tag; those in quotes are no ends.
fn end_of_tag(text: &str) -> Option<usize> {
    let mut quote = None;
    for (index, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return Some(index + 1),
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), byte) if open == byte => quote = None,
            _ => {}
        }
    }
    None
}

fn attributes(mut text: &str) -> Vec<(&str, &str)> {
    let mut attributes = Vec::new();
    while let Some((key, rest)) = text.split_once('=') {
        let rest = rest.trim_start();
        let Some(quote) = rest.chars().next().filter(|quote| matches!(quote, '"' | '\'')) else { break };
        let Some((value, rest)) = rest[1..].split_once(quote) else { break };
        attributes.push((key.trim(), value));
        text = rest;
    }
    attributes
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    const MAIN: &str = "<!-- file=\"no.xml\" --><mujoco model='arm'>\n<compiler meshdir=\"parts\" angle='radian'/>\
        <include file=\"arm.xml\"/><asset><mesh name='a > b' file='a.stl'/></asset></mujoco>";

    fn write(folder: &Path, main: &str, mesh: &[u8]) {
        fs::create_dir_all(folder.join("parts")).unwrap();
        fs::write(folder.join("robot.xml"), main).unwrap();
        fs::write(folder.join("arm.xml"), "<mujoco><asset><mesh file=\"b.stl\"/></asset></mujoco>").unwrap();
        fs::write(folder.join("parts/a.stl"), mesh).unwrap();
        fs::write(folder.join("parts/b.stl"), "b").unwrap();
    }

    #[test]
    fn a_description_is_named_by_its_text_and_all_files_that_it_names() {
        let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        let digest = |index: usize| Description::read(&folders[index].path().join("robot.xml"));
        write(folders[0].path(), MAIN, b"a");
        write(folders[1].path(), MAIN, b"a");
        let first = digest(0).unwrap();
        assert_eq!(first.name, "arm");
        assert_eq!(digest(1).unwrap(), first, "another folder");
        write(folders[1].path(), MAIN, b"A");
        assert_ne!(digest(1).unwrap(), first, "another mesh");
        write(folders[1].path(), &MAIN.replace("radian", "degree"), b"a");
        assert_ne!(digest(1).unwrap(), first, "another text");
        write(folders[1].path(), MAIN, b"a");
        fs::write(folders[1].path().join("parts/b.stl"), "B").unwrap();
        assert_ne!(digest(1).unwrap(), first, "another mesh of an included file");
        fs::write(folders[1].path().join("parts/b.stl"), "b").unwrap();
        let hand = |index: usize| Description::of_hand(&folders[index].path().join("robot.xml"));
        let error = hand(1).unwrap_err();
        assert!(error.to_string().contains("robot.toml") && error.remedy().contains("docs/hands.md"), "{error}");
        folders.iter().for_each(|folder| fs::write(folder.path().join("robot.toml"), "x = 1").unwrap());
        let with_table = hand(0).unwrap();
        assert_eq!((&with_table.name, hand(1).unwrap()), (&first.name, with_table.clone()), "another folder");
        assert_ne!(with_table.digest, first.digest);
        fs::write(folders[1].path().join("robot.toml"), "x = 2").unwrap();
        assert_ne!(hand(1).unwrap(), with_table, "another table");
        fs::write(folders[1].path().join("parts/b.stl"), "B").unwrap();
        fs::write(folders[1].path().join("robot.toml"), "x = 1").unwrap();
        assert_ne!(hand(1).unwrap(), with_table, "another mesh of a hand");
        fs::remove_file(folders[1].path().join("parts/b.stl")).unwrap();
        let error = digest(1).unwrap_err().to_string();
        assert!(error.contains("b.stl") && error.contains("arm.xml"), "{error}");
    }

    #[test]
    fn few_letters_that_ask_for_much_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let check = |body: &str| {
            let path = folder.path().join("scene.xml");
            fs::write(&path, format!("<mujoco><worldbody>{body}</worldbody></mujoco>")).unwrap();
            fs::write(folder.path().join("part.xml"), "<mujoco><replicate count='1000'><geom/></replicate></mujoco>")
                .unwrap();
            Description::check_files(&path).map_err(|error| error.to_string())
        };
        let nested = |count: u32, content: &str| format!("<replicate count=\"{count}\">{content}</replicate>");
        for fine in [
            nested(300, &nested(300, "<geom/>")),
            // One after the other they add up, they do not multiply.
            nested(20_000, "<geom/>").repeat(4),
            "<replicate count='9'/>".repeat(1000),
            nested(10, "<include file='part.xml'/>"),
        ] {
            assert_eq!(check(&fine), Ok(()), "{fine}");
        }
        for bomb in [
            nested(1_000_000_000, "<geom/>"),
            nested(1000, &nested(1000, "<geom/>")),
            nested(20_000, "<geom/>").repeat(6),
            nested(1000, "<include file='part.xml'/>"),
            "<flexcomp count='1000 1000 1000'/>".to_owned(),
        ] {
            let error = check(&bomb).unwrap_err();
            assert!(error.contains("copies of elements"), "{error}");
        }
        let error = check("<texture width=\"9999999\" height=\"1\"/>").unwrap_err();
        assert!(error.contains("`width` of `texture` is 9999999"), "{error}");
    }
}
