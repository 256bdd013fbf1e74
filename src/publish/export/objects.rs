//! Objects that an export is asked for.

use std::collections::BTreeSet;

use super::error::ExportError;
use format::dataset::AssetRow;
use kernel::ids::ObjectId;

/// The objects of these names; every name must be known.
pub(super) fn wanted_objects(assets: &[AssetRow], names: &[String]) -> Result<BTreeSet<ObjectId>, ExportError> {
    names
        .iter()
        .map(|name| {
            let row = assets.iter().find(|row| row.name == *name);
            row.map(|row| row.object).ok_or_else(|| ExportError::UnknownObject {
                name: name.clone(),
                known: assets.iter().map(|row| row.name.clone()).collect(),
            })
        })
        .collect()
}
