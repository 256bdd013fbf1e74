//! Objects selected for an export.

use std::collections::BTreeSet;

use super::error::ExportError;
use format::dataset::AssetRow;
use kernel::ids::ObjectId;

/// Noun of the selected items if they are objects.
pub(super) const OBJECT: &str = "object";

/// The objects of these names, or the scenes for products made from scenes (`what`); every name must be known.
pub(super) fn wanted_objects(
    assets: &[AssetRow],
    names: &[String],
    what: &'static str,
) -> Result<BTreeSet<ObjectId>, ExportError> {
    names
        .iter()
        .map(|name| {
            let row = assets.iter().find(|row| row.name == *name);
            row.map(|row| row.object).ok_or_else(|| ExportError::UnknownObject {
                what,
                name: name.clone(),
                known: assets.iter().map(|row| row.name.clone()).collect(),
            })
        })
        .collect()
}
