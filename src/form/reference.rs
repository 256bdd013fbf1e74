//! The keys of a file as Markdown, printed from its schema: type, unit, default, meaning, example.

use std::fmt::Write as _;

use serde_json::Value;

use super::{
    requirement::{Requirement, is_required},
    schema::Schema,
};

/// Prefix of the keyword of a named default.
const DEFAULT_NAME: &str = "x-default-";

/// Prints references: sections and tables of keys.
pub struct Reference<'a> {
    /// Keys that come first, in this order; the others follow alphabetically.
    pub order: &'a [&'a str],
    /// Whether the choices of a top-level key are listed.
    pub with_top_choices: bool,
}

impl Reference<'_> {
    /// Prints every key of a file.
    pub fn print(&self, schema: &Schema) -> String {
        let root = schema.value();
        let mut text = format!("{}\n\n## Top level\n\n", words(root));
        self.table(&mut text, "", root);
        for (key, section) in self.keys(root) {
            let entry = if section.get("items").is_some() { &section["items"] } else { section };
            if entry.get("properties").is_some() || section.get("anyOf").is_some() {
                let _ = writeln!(text, "\n## `{key}`\n\n{}\n", words(section));
                self.forms(&mut text, key, entry);
            } else if section.get("oneOf").is_some() && self.with_top_choices {
                let _ = writeln!(text, "\n`{key}` is one of\n");
                choices(&mut text, section, "");
            }
        }
        text
    }

    /// Prints the keys of a table and of the tables below it.
    fn forms(&self, text: &mut String, path: &str, schema: &Value) {
        // A table with several forms: each with its meaning and its keys.
        for (index, branch) in schema["anyOf"].as_array().into_iter().flatten().enumerate() {
            let before = if index > 0 { "\n" } else { "" };
            let _ = writeln!(text, "{before}- {}: {}", kind(branch), words(branch));
            choices(text, branch, "  ");
            if branch.get("properties").is_some() {
                text.push('\n');
                self.table(text, path, branch);
            }
        }
        if schema.get("properties").is_some() {
            self.table(text, path, schema);
        }
        // The tables below it; free keys are shown as NAME.
        for (key, below) in self.keys(schema) {
            let path = format!("{path}.{key}");
            let entries = &below["additionalProperties"];
            let is_table = |schema: &Value| schema.get("properties").is_some();
            if is_table(below) || below["anyOf"].as_array().is_some_and(|forms| forms.iter().any(is_table)) {
                let _ = writeln!(text, "\n### `{path}`\n\n{}\n", words(below));
                self.forms(text, &path, below);
            } else if entries.get("properties").is_some() {
                let _ = writeln!(text, "\n### `{path}.NAME`\n\n{}\n", words(below));
                self.forms(text, &format!("{path}.NAME"), entries);
            } else if below.get("oneOf").is_some() {
                let _ = writeln!(text, "\n`{path}` is one of\n");
                choices(text, below, "");
            }
        }
    }

    fn table(&self, text: &mut String, path: &str, schema: &Value) {
        text.push_str("| key | type | default | example | meaning |\n| --- | --- | --- | --- | --- |\n");
        for (key, property) in self.keys(schema) {
            let example = example(property).map(|value| format!("`{key} = {}`", toml_of(value))).unwrap_or_default();
            let name = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
            let default = default(property, is_required(schema, key));
            let cells = [format!("`{name}`"), kind(property), default, example, words(property)];
            let _ = writeln!(text, "| {} |", cells.map(|cell| cell.replace('|', "\\|")).join(" | "));
        }
    }

    /// Keys of a table in their order.
    fn keys<'s>(&self, schema: &'s Value) -> Vec<(&'s str, &'s Value)> {
        let rank = |key: &str| self.order.iter().position(|known| *known == key).unwrap_or(self.order.len());
        let properties = schema["properties"].as_object().into_iter().flatten();
        let mut keys: Vec<(&str, &Value)> = properties.map(|(key, value)| (key.as_str(), value)).collect();
        keys.sort_by_key(|(key, _)| (rank(key), *key));
        keys
    }
}

fn choices(text: &mut String, schema: &Value, indent: &str) {
    for choice in schema["oneOf"].as_array().into_iter().flatten() {
        let _ = writeln!(text, "{indent}- `{}`: {}", choice["const"], words(choice));
    }
}

/// The default and named defaults; `required` if there is none and a value is required.
fn default(property: &Value, is_required: bool) -> String {
    let standard = property.get("default").map(|value| format!("`{}`", toml_of(value)));
    let keywords = property.as_object().into_iter().flatten();
    let named = keywords.filter_map(|(keyword, value)| Some((keyword.strip_prefix(DEFAULT_NAME)?, value)));
    let named: String = named.map(|(name, value)| format!("; {name}: `{}`", toml_of(value))).collect();
    match standard {
        Some(standard) => standard + &named,
        None if !named.is_empty() => format!("none{named}"),
        None if is_required => "required".to_owned(),
        None => String::new(),
    }
}

/// Short name of the type of a value.
fn kind(schema: &Value) -> String {
    match (schema["type"].as_str(), schema.get("anyOf")) {
        (_, Some(branches)) => {
            let kinds: Vec<String> = branches.as_array().into_iter().flatten().map(kind).collect();
            kinds.join(" or ")
        }
        (Some("object"), _) => "table".to_owned(),
        (Some("array"), _) if schema["items"].get("properties").is_some() => "`[[...]]` tables".to_owned(),
        (Some("array"), _) => format!("array of {}", plural(&kind(&schema["items"]))),
        _ => Requirement::of(schema).to_string(),
    }
}

/// Plural of a type.
fn plural(kind: &str) -> String {
    let singulars =
        [("a string", "strings"), ("a whole number", "whole numbers"), ("a number", "numbers"), ("array", "arrays")];
    let plural = |kind: &str| match singulars.iter().find(|(singular, _)| kind.starts_with(singular)) {
        Some((singular, plural)) => kind.replacen(singular, plural, 1),
        None => kind.to_owned(),
    };
    kind.split(" or ").map(plural).collect::<Vec<_>>().join(" or ")
}

/// A value to show: an example, the default, or the first choice.
fn example(property: &Value) -> Option<&Value> {
    let given = property["examples"].get(0).or_else(|| property.get("default"));
    given.or_else(|| property["oneOf"].get(0).and_then(|choice| choice.get("const")))
}

/// The description on one line.
fn words(schema: &Value) -> String {
    schema["description"].as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A JSON value as TOML writes it.
fn toml_of(value: &Value) -> String {
    toml::Value::try_from(value).map_or_else(|_| value.to_string(), |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use schemars::JsonSchema;
    use serde::Deserialize;

    use super::*;
    use crate::schema_of;

    /// A lamp.
    #[derive(Deserialize, JsonSchema)]
    #[expect(dead_code, reason = "only its schema is read")]
    struct Lamp {
        /// Position of the
        /// switch.
        switch: Switch,
        /// Bulbs.
        bulbs: Vec<Bulb>,
    }

    #[derive(Deserialize, JsonSchema)]
    #[serde(rename_all = "snake_case")]
    enum Switch {
        /// By hand.
        Hand,
    }

    /// A bulb.
    #[derive(Deserialize, JsonSchema)]
    #[expect(dead_code, reason = "only its schema is read")]
    struct Bulb {
        /// Power.
        #[schemars(range(max = 9), extend("x-unit" = "W", "examples" = [4]))]
        power: u32,
    }

    #[test]
    fn keys_are_printed_with_what_is_known_of_them() {
        let mut schema = schema_of::<Lamp>("a lamp");
        let dim = "[[bulbs]]\npower = 1".parse().expect("TOML");
        schema.insert_defaults(&dim, "x-default-dim", None);
        let text = Reference { order: &["switch"], with_top_choices: true }.print(&schema);
        let expected = "A lamp.\n\n## Top level\n\n\
            | key | type | default | example | meaning |\n| --- | --- | --- | --- | --- |\n\
            | `switch` | one of \"hand\" | required | `switch = \"hand\"` | Position of the switch. |\n\
            | `bulbs` | `[[...]]` tables | none; dim: `[{ power = 1 }]` |  | Bulbs. |\n\
            \n`switch` is one of\n\n- `\"hand\"`: By hand.\n\
            \n## `bulbs`\n\nBulbs.\n\n\
            | key | type | default | example | meaning |\n| --- | --- | --- | --- | --- |\n\
            | `bulbs.power` | a whole number from 0 to 9 [W] | required | `power = 4` | Power. |\n";
        assert_eq!(text, expected);
    }
}
