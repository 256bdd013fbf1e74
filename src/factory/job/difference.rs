//! Settings in which two resolved jobs differ.

use std::collections::BTreeMap;

use serde::Serialize;

/// A setting that two jobs do not share.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SettingDifference {
    /// Dotted key; entries of lists by index, counted from 0: `objects.0.unit`.
    pub key: String,
    /// Value in the first job, as TOML; `None` where it has none.
    pub a: Option<String>,
    /// Value in the second job.
    pub b: Option<String>,
}

/// A resolved job that is no TOML.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not TOML: {0}")]
pub struct InvalidSettings(String);

/// The settings of two job files that differ, by key. Files are compared as written: two resolved jobs have every
/// default written out.
///
/// # Errors
/// When one is no TOML.
pub fn setting_differences(a: &str, b: &str) -> Result<Vec<SettingDifference>, InvalidSettings> {
    let read = |text: &str| -> Result<BTreeMap<String, String>, InvalidSettings> {
        let table: toml::Table = toml::from_str(text).map_err(|error| InvalidSettings(error.message().to_owned()))?;
        let mut values = BTreeMap::new();
        flatten("", &table.into(), &mut values);
        Ok(values)
    };
    let (a, mut b) = (read(a)?, read(b)?);
    let mut found: Vec<SettingDifference> = Vec::new();
    for (key, value) in a {
        let other = b.remove(&key);
        if other.as_ref() != Some(&value) {
            found.push(SettingDifference { key, a: Some(value), b: other });
        }
    }
    found.extend(b.into_iter().map(|(key, value)| SettingDifference { key, a: None, b: Some(value) }));
    found.sort_by(|one, other| one.key.cmp(&other.key));
    Ok(found)
}

/// The values of a tree by their dotted keys; empty tables and lists are values.
fn flatten(key: &str, value: &toml::Value, values: &mut BTreeMap<String, String>) {
    let below = |name: &str| if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") };
    match value {
        toml::Value::Table(table) if !table.is_empty() => {
            table.iter().for_each(|(name, value)| flatten(&below(name), value, values));
        }
        toml::Value::Array(items) if items.iter().any(toml::Value::is_table) => {
            items.iter().enumerate().for_each(|(index, value)| flatten(&below(&index.to_string()), value, values));
        }
        plain => {
            values.insert(key.to_owned(), plain.to_string());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_compared_by_key() {
        let a =
            "seed = 1\nname = \"x\"\n[grid]\nresolution = 40\n[[objects]]\nunit = \"mm\"\n[[objects]]\nunit = \"m\"\n";
        let b = "name = \"x\"\nseed = 2\n[grid]\nresolution = 40\npad = 0.5\n[[objects]]\nunit = \"mm\"\n";
        let found = setting_differences(a, b).unwrap();
        let keys: Vec<&str> = found.iter().map(|setting| setting.key.as_str()).collect();
        assert_eq!(keys, ["grid.pad", "objects.1.unit", "seed"]);
        assert_eq!((found[2].a.as_deref(), found[2].b.as_deref()), (Some("1"), Some("2")));
        assert_eq!((found[1].a.as_deref(), found[1].b.as_deref()), (Some("\"m\""), None));
        assert_eq!(setting_differences(a, a), Ok(vec![]));
        assert!(setting_differences("= 1", a).is_err());
    }
}
