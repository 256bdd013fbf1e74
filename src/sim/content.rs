//! What a robot's description says, whatever its path: the digest of its files.

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

use mujoco_rs::wrappers::mj_model::{MjtGeomBase, MjtObjBase};

use super::{
    error::RobotError,
    robot::{RobotModel, index},
};
use crate::ids::Digest;

impl RobotModel {
    /// Digest of the MJCF file, of those that it includes or attaches, and of the meshes that can be hit. The same files
    /// elsewhere give the same digest; meshes that are only seen, textures and height fields don't count.
    ///
    /// # Errors
    /// When a file can't be read.
    pub fn digest(&self) -> Result<Digest, RobotError> {
        let model = &self.model;
        let mut parts = vec![b"graspmill robot 1".to_vec()];
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let (mut waiting, mut seen) = (vec![self.path.clone()], BTreeSet::new());
        while let Some(path) = waiting.pop() {
            if seen.insert(path.clone()) {
                let text = self.read(&path)?;
                waiting.extend(files_named(&String::from_utf8_lossy(&text), folder, &path).into_iter().rev());
                parts.push(text);
            }
        }
        let mut meshes = BTreeSet::new();
        for (geom, kind) in model.geom_type().iter().enumerate() {
            let can_be_hit = model.geom_contype()[geom] != 0 || model.geom_conaffinity()[geom] != 0;
            if can_be_hit && *kind == MjtGeomBase::mjGEOM_MESH {
                meshes.insert(index(model.geom_dataid()[geom]));
            }
        }
        for mesh in meshes {
            if let Some(file) = &self.meshes[mesh].file {
                parts.push(model.id_to_name(MjtObjBase::mjOBJ_MESH, mesh).unwrap_or_default().as_bytes().to_vec());
                parts.push(self.read(file)?);
            }
        }
        Ok(Digest::of_parts(parts.iter().map(Vec::as_slice)))
    }

    fn read(&self, file: &Path) -> Result<Vec<u8>, RobotError> {
        fs::read(file).map_err(|error| match error.kind() {
            io::ErrorKind::NotFound => RobotError::Missing { path: self.path.clone(), file: file.to_owned() },
            _ => RobotError::Unreadable { path: self.path.clone(), file: file.to_owned(), reason: error.to_string() },
        })
    }
}

/// MJCF files that a text names, in its order: `<include file="..."/>` and `<model file="..."/>`. MuJoCo seeks them from the
/// main file's folder, or from that of the file that names them.
fn files_named(text: &str, folder: &Path, path: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(start) = rest.find('<') {
        rest = &rest[start..];
        if let Some(comment) = rest.strip_prefix("<!--") {
            rest = comment.split_once("-->").map_or("", |(_, after)| after);
            continue;
        }
        let (tag, after) = rest[1..].split_once('>').unwrap_or((&rest[1..], ""));
        rest = after;
        let mut words = tag.split(|letter: char| letter.is_whitespace() || letter == '/');
        if let (Some("include" | "model"), Some(file)) = (words.next(), attribute(tag, "file")) {
            let seen_from_main = folder.join(file);
            let beside = path.parent().unwrap_or(Path::new("")).join(file);
            found.push(if seen_from_main.exists() || !beside.exists() { seen_from_main } else { beside });
        }
    }
    found
}

/// The value of an attribute of a tag, in either kind of quotes.
fn attribute<'a>(tag: &'a str, name: &str) -> Option<&'a str> {
    let mut rest = tag;
    while let Some(at) = rest.find(name) {
        let is_word = rest[..at].ends_with(char::is_whitespace);
        rest = &rest[at + name.len()..];
        let value = rest.trim_start().strip_prefix('=').map(str::trim_start);
        if let Some((quote, value)) = value.and_then(|value| value.chars().next().map(|quote| (quote, &value[1..])))
            && is_word
            && (quote == '"' || quote == '\'')
        {
            return value.split(quote).next();
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_as_xml_names_them() {
        let text = r#"<mujoco><!-- <include file="no.xml"/> --><include  file = 'a.xml'/><asset><model name="file=x"
            file="b/c.xml"/><mesh file="m.stl"/></asset><include file="d.xml"></include><included file="e.xml"/></mujoco>"#;
        let found = files_named(text, Path::new("f"), Path::new("f/main.xml"));
        assert_eq!(found, ["f/a.xml", "f/b/c.xml", "f/d.xml"].map(PathBuf::from));
    }
}
