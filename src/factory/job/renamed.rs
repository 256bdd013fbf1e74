//! Keys and values of job files that were renamed, each declared once.
//!
//! A job that uses an old name is refused with the new one. The canonical text of a job keeps the old names: a digest names keys
//! as format 3 named them, so that a rename changes no digest and no root.

use super::schema::has_key;
use form::{Path, Schema};
use toml::{Table, Value};

/// A key that was renamed; both paths are dotted, without the indices of entries.
pub struct RenamedKey {
    /// Path that job files had.
    pub old: &'static str,
    /// Path that job files have.
    pub new: &'static str,
}

/// A value that was renamed.
pub struct RenamedValue {
    /// Path of its key in job files today.
    pub key: &'static str,
    /// Value that job files had.
    pub old: &'static str,
    /// Value that job files have.
    pub new: &'static str,
}

/// The renamed keys of all products.
pub const RENAMED_KEYS: &[RenamedKey] = &[
    renamed("antipodal.resting", "antipodal.resting_pose"),
    renamed("container.inner", "container.inner_size"),
    renamed("fusion.below", "fusion.support_height"),
    renamed("fusion.fusions", "fusion.per_scene"),
    renamed("hand.scene", "hand.model"),
    renamed("heatmaps.angle", "heatmaps.max_angle"),
    renamed("keep.edges", "keep.cone_edges"),
    renamed("objects.first", "objects.limit"),
    renamed("physics.cap", "physics.settle_timeout"),
    renamed("physics.finer", "physics.substeps"),
    renamed("physics.perturbed", "physics.perturbed_runs"),
    renamed("physics.put_back", "physics.max_redrops"),
    renamed("physics.recheck", "physics.stability_time"),
    renamed("physics.release_every", "physics.release_interval"),
    renamed("physics.roll_out_share", "physics.rollout_share"),
    renamed("physics.roll_outs", "physics.rollouts"),
    renamed("picks.awake", "picks.movable"),
    renamed("picks.take", "picks.grasps"),
    renamed("place", "region"),
    renamed("robot.scene", "robot.model"),
    renamed("touch.hand.scene", "touch.hand.model"),
];

/// The renamed values of all products.
pub const RENAMED_VALUES: &[RenamedValue] = &[
    RenamedValue { key: "antipodal.resting_pose", old: "drawn", new: "sampled" },
    RenamedValue { key: "antipodal.resting_pose", old: "likeliest", new: "most_likely" },
    RenamedValue { key: "antipodal.support", old: "air", new: "none" },
    RenamedValue { key: "physics.gravity", old: "six", new: "six_directions" },
];

const fn renamed(old: &'static str, new: &'static str) -> RenamedKey {
    RenamedKey { old, new }
}

/// The new path of a key by an old name, where jobs of this schema have it. Indices of entries are kept.
pub(super) fn new_key(schema: &Schema, path: &Path) -> Option<Path> {
    let renamed = RENAMED_KEYS.iter().find(|key| path.has_keys(key.old) && has_key(schema, key.new))?;
    Some(path.with_keys(renamed.new))
}

/// The new name of a value by an old name.
pub(super) fn new_value(path: &Path, value: &str) -> Option<&'static str> {
    RENAMED_VALUES.iter().find(|renamed| path.has_keys(renamed.key) && renamed.old == value).map(|renamed| renamed.new)
}

/// Keys of a job by the names that format 3 gave them, for its digest.
pub(super) fn with_old_names(mut keys: Table) -> Table {
    for RenamedValue { key, old, new } in RENAMED_VALUES {
        if let Some(value) = value_at(&mut keys, key).filter(|value| value.as_str() == Some(*new)) {
            *value = Value::String((*old).to_owned());
        }
    }
    for RenamedKey { old, new } in RENAMED_KEYS {
        // A rename stays within its section.
        let (section, new) = section_at(&mut keys, new);
        let Some(section) = section else { continue };
        if let Some(value) = section.remove(new) {
            let (_, old) = old.rsplit_once('.').unwrap_or(("", *old));
            section.insert(old.to_owned(), value);
        }
    }
    keys
}

fn value_at<'a>(keys: &'a mut Table, path: &'static str) -> Option<&'a mut Value> {
    let (section, key) = section_at(keys, path);
    section?.get_mut(key)
}

/// The table that holds a dotted key, and the key in it.
fn section_at<'a>(keys: &'a mut Table, path: &'static str) -> (Option<&'a mut Table>, &'static str) {
    let Some((sections, key)) = path.rsplit_once('.') else { return (Some(keys), path) };
    let section = sections.split('.').try_fold(keys, |table, name| table.get_mut(name)?.as_table_mut());
    (section, key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digest_names_keys_and_values_as_format_3_did() {
        let text =
            "region = 1\n[antipodal]\nsupport = \"none\"\nresting_pose = \"sampled\"\n[touch.hand]\nmodel = \"a\"\n";
        let old = "place = 1\n[antipodal]\nsupport = \"air\"\nresting = \"drawn\"\n[touch.hand]\nscene = \"a\"\n";
        let read = |text: &str| text.parse::<Table>().expect("TOML");
        assert_eq!(with_old_names(read(text)), read(old));
        assert_eq!(with_old_names(read(old)), read(old));
    }

    #[test]
    fn a_rename_stays_within_its_section() {
        let section = |path: &'static str| path.rsplit_once('.').map_or("", |(section, _)| section);
        for RenamedKey { old, new } in RENAMED_KEYS {
            assert_eq!(section(old), section(new));
        }
    }
}
