//! Subjects of a dataset: rows of the asset table as roots take them.

use std::{collections::BTreeMap, path::Path};

use super::{
    DatasetError,
    layout::ASSETS,
    merkle::{self, Tree},
};
use kernel::ids::{Digest, ObjectId};

/// Root over the rows of the asset table, in order of their objects.
pub(crate) fn asset_tree<'a>(assets: impl Iterator<Item = &'a serde_json::Value>) -> Digest {
    let mut rows: Vec<_> = assets.map(|row| (object_of(row), merkle::canonical_json(row))).collect();
    rows.sort();
    let mut tree = Tree::default();
    rows.iter().for_each(|(_, row)| tree.push(merkle::asset_leaf(row)));
    tree.root()
}

/// The object of a row of the asset table.
pub(crate) fn object_of(row: &serde_json::Value) -> Option<ObjectId> {
    row.get("object")?.as_str().and_then(Digest::from_hex).map(ObjectId)
}

/// Subject -> (rank among the subjects' ids, name, id in hexadecimal digits).
pub(crate) type Subjects = BTreeMap<ObjectId, (u32, String, String)>;

/// The subjects of the rows of the asset table.
pub(crate) fn asset_names<'a>(
    folder: &Path,
    assets: impl IntoIterator<Item = &'a serde_json::Value>,
) -> Result<Subjects, DatasetError> {
    let invalid = |problem: String| DatasetError::Invalid {
        path: folder.join(ASSETS),
        problem,
        remedy: "each row of the asset table is one object with 'object' (64 hexadecimal digits) and 'name'",
    };
    let mut subjects = Subjects::new();
    for (index, row) in assets.into_iter().enumerate() {
        let name = row.get("name").and_then(|name| name.as_str());
        let (Some(object), Some(name)) = (object_of(row), name) else {
            return Err(invalid(format!("row {index} has no object or no name")));
        };
        if subjects.insert(object, (0, name.to_owned(), object.to_string())).is_some() {
            return Err(invalid(format!("object {object} is listed in two rows")));
        }
    }
    for (rank, (own, _, _)) in (0..).zip(subjects.values_mut()) {
        *own = rank;
    }
    Ok(subjects)
}
