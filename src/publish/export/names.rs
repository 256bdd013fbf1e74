//! File names made from object names.

use std::collections::{BTreeMap, BTreeSet};

use format::dataset::AssetRow;
use kernel::ids::ObjectId;

/// A folder for each object: its name if it is a valid folder name, with the object's digest if two names would coincide.
pub(super) fn object_folders(assets: &[AssetRow]) -> BTreeMap<ObjectId, String> {
    let mut taken = BTreeSet::new();
    let mut rows: Vec<&AssetRow> = assets.iter().collect();
    rows.sort_by_key(|row| row.object);
    rows.into_iter()
        .map(|row| {
            let name = safe(&row.name);
            // Some file systems do not distinguish capitals from small letters.
            let name =
                if taken.insert(name.to_lowercase()) { name } else { format!("{name}_{}", row.object.0.short()) };
            (row.object, name)
        })
        .collect()
}

/// Keeps letters, digits and `. _ - +`, and replaces everything else by `_`; the result is never empty, hidden or a parent
/// folder.
fn safe(name: &str) -> String {
    let fits = |character: char| character.is_alphanumeric() || "._-+".contains(character);
    let name: String = name.chars().take(100).map(|character| if fits(character) { character } else { '_' }).collect();
    match name.chars().next() {
        None => "_".to_owned(),
        Some('.') => format!("_{name}"),
        Some(_) => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernel::ids::Digest;

    #[test]
    fn names_stay_readable_and_apart() {
        assert_eq!(safe("025_mug"), "025_mug");
        assert_eq!(safe("Ölflasche 2"), "Ölflasche_2");
        assert_eq!(safe("../../etc"), "_.._.._etc");
        assert_eq!(safe(""), "_");
        let row = |name: &str, byte| AssetRow {
            object: ObjectId(Digest([byte; 32])),
            name: name.to_owned(),
            facts: Default::default(),
        };
        let folders = object_folders(&[row("a b", 1), row("a/b", 2), row("A_b", 3)]);
        let names: Vec<&str> = folders.values().map(String::as_str).collect();
        assert_eq!(names, ["a_b", "a_b_0202020202020202", "A_b_0303030303030303"]);
    }
}
