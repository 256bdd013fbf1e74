//! Files of ROS packages, by the URIs that URDFs name them with.

use std::path::{Component, Path, PathBuf};

use super::{
    error::DescriptionError,
    statement::Place,
    xml::{TagKind, Tags},
};
use crate::files::{self, Bound};

/// A URI as URDFs have them.
pub(super) enum Uri<'u> {
    /// `package://NAME/PATH`, or Gazebo's `model://NAME/PATH`.
    Package { whole: &'u str, name: &'u str, path: &'u str },
    /// `file:///PATH`.
    File(&'u str),
}

/// The URI that a name is; `None` for a plain path.
pub(super) fn uri(written: &str) -> Option<Uri<'_>> {
    if let Some(path) = written.strip_prefix("file://") {
        return Some(Uri::File(path));
    }
    let rest = ["package://", "model://"].iter().find_map(|scheme| written.strip_prefix(scheme))?;
    let (name, path) = rest.split_once('/').unwrap_or((rest, ""));
    Some(Uri::Package { whole: written, name, path })
}

impl Uri<'_> {
    /// Where the file is; `folder` is that of the description.
    pub(super) fn find(&self, folder: &Path, place: &Place) -> Result<PathBuf, DescriptionError> {
        let (whole, name, path) = match self {
            Self::File(path) => return Ok(PathBuf::from(path)),
            Self::Package { whole, name, path } => (whole, name, path),
        };
        // The folder of a bare file name is empty.
        let folder = std::path::absolute(Path::new(".").join(folder)).unwrap_or_else(|_| folder.to_owned());
        let is_plain = matches!(Path::new(name).components().collect::<Vec<_>>()[..], [Component::Normal(_)]);
        let looked_in: Vec<PathBuf> = folder.ancestors().map(Path::to_owned).collect();
        let found = looked_in.iter().filter(|_| is_plain).find_map(|ancestor| package_at(ancestor, name));
        match found {
            Some(package) => Ok(package.join(path)),
            None => Err(DescriptionError::NoPackage {
                place: place.clone(),
                uri: (*whole).to_owned(),
                package: (*name).to_owned(),
                looked_in,
            }),
        }
    }
}

/// The package of a name that a folder is or holds: by its name, or by the name in its `package.xml`.
fn package_at(folder: &Path, name: &str) -> Option<PathBuf> {
    if folder.file_name().is_some_and(|own| own == name) || declared_name(folder).is_some_and(|own| own == name) {
        return Some(folder.to_owned());
    }
    Some(folder.join(name)).filter(|inside| files::is_folder(inside))
}

/// The name that the `package.xml` of a folder declares.
fn declared_name(folder: &Path) -> Option<String> {
    let text = files::read_text(&folder.join("package.xml"), Bound::PACKAGE).ok()?;
    let mut tags = Tags::new(&text);
    while let Ok(Some(tag)) = tags.read_tag() {
        if tag.kind == TagKind::Start && tag.name == "name" && tags.depth() == 2 {
            return Some(tags.text().trim().to_owned());
        }
    }
    None
}
