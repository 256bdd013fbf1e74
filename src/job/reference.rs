//! The reference of all keys as Markdown, printed from the schema: docs/jobs.md is its copy (a test compares them).

use std::fmt::Write as _;

use serde_json::Value;

use super::{schema, set::SET};
use crate::ids::Product;

/// Order of the sections, and of the keys whose alphabetical order would mislead; the others follow by name.
const ORDER: &[&str] = &[
    "product",
    "name",
    "seed",
    "profile",
    "jobs",
    "job",
    "objects",
    "grasps",
    "annealing",
    "keep",
    "dataset",
    "root",
    "types",
    "patches",
    "robot",
    "poses",
    "solver",
    "collisions",
    "field",
    "views",
    "pivot",
    "camera",
    "distance",
    "renderer",
    "sensor",
    "grid",
    "truth",
    "gate",
    "split",
    "channels",
    "touch",
    "render",
    "shards",
    "overrides",
    "folder",
    "list",
    "package",
    "built_in",
    "triangles",
    "include",
    "exclude",
    "first",
    "optional",
    "unit",
    "scale",
    "size",
    "limits",
    "group",
    "licence",
    "citation",
    "table",
    "meshes",
    "width",
    "height",
    "horizontal_fov",
    "fx",
    "fy",
    "cx",
    "cy",
    "near",
    "rule",
    "from",
    "to",
    "count",
    "min",
    "max",
    "x",
    "y",
    "z",
    "roll",
    "pitch",
    "yaw",
    "holdout_views",
    "validation_models",
    "test_models",
    "visibility",
    "depth",
    "depth_step",
    "cloud",
    "tsdf",
    "tsdf_truncation",
    "coverage",
    "implicit",
    "random_rays",
    "rays",
    "ray_target",
    "exploration",
    "approaches",
    "grasp",
    "hand",
    "resolution",
    "min_partial_cells",
    "scene",
    "joints",
    "target",
    "frame",
    "fixed",
    "content",
];

/// Every key of a job file, product by product: type, unit, default of each profile, meaning, example.
pub fn reference() -> String {
    let mut text = String::new();
    let products = Product::ALL.into_iter().map(|product| (product.name(), schema::of(product)));
    for (place, (product, root)) in products.chain([(SET, schema::of_sets())]).enumerate() {
        let before = if place > 0 { "\n" } else { "" };
        let _ = writeln!(text, "{before}# Keys of `product = \"{product}\"`\n\n{}\n", words(root));
        let _ = writeln!(text, "## Top level\n");
        table(&mut text, "", root);
        for (key, section) in keys(root) {
            let entry = if section.get("items").is_some() { &section["items"] } else { section };
            if entry.get("properties").is_some() || section.get("anyOf").is_some() {
                let _ = writeln!(text, "\n## `{key}`\n\n{}\n", words(section));
                forms(&mut text, key, entry);
            } else if section.get("oneOf").is_some() && product != Product::Completion.name() {
                let _ = writeln!(text, "\n`{key}` is one of\n");
                choices(&mut text, section, "");
            }
        }
    }
    text
}

/// The keys of a table, and of the tables below it.
fn forms(text: &mut String, path: &str, schema: &Value) {
    for (place, branch) in schema["anyOf"].as_array().into_iter().flatten().enumerate() {
        let before = if place > 0 { "\n" } else { "" };
        let _ = writeln!(text, "{before}- {}: {}", form(branch), words(branch));
        choices(text, branch, "  ");
        if branch.get("properties").is_some() {
            text.push('\n');
            table(text, path, branch);
        }
    }
    if schema.get("properties").is_some() {
        table(text, path, schema);
    }
    for (key, below) in keys(schema) {
        let path = format!("{path}.{key}");
        let entries = &below["additionalProperties"];
        let is_table = |schema: &Value| schema.get("properties").is_some();
        if is_table(below) || below["anyOf"].as_array().is_some_and(|forms| forms.iter().any(is_table)) {
            let _ = writeln!(text, "\n### `{path}`\n\n{}\n", words(below));
            forms(text, &path, below);
        } else if entries.get("properties").is_some() {
            let _ = writeln!(text, "\n### `{path}.NAME`\n\n{}\n", words(below));
            forms(text, &format!("{path}.NAME"), entries);
        } else if below.get("oneOf").is_some() {
            let _ = writeln!(text, "\n`{path}` is one of\n");
            choices(text, below, "");
        }
    }
}

fn choices(text: &mut String, schema: &Value, indent: &str) {
    for choice in schema["oneOf"].as_array().into_iter().flatten() {
        let _ = writeln!(text, "{indent}- `{}`: {}", choice["const"], words(choice));
    }
}

fn table(text: &mut String, path: &str, schema: &Value) {
    text.push_str("| key | type | default | example | meaning |\n| --- | --- | --- | --- | --- |\n");
    let required = |key: &str| schema["required"].as_array().is_some_and(|list| list.iter().any(|known| known == key));
    for (key, property) in keys(schema) {
        let default = match (property.get("default"), property.get("x-default-thesis")) {
            (Some(standard), None) => format!("`{}`", toml_of(standard)),
            (standard, Some(thesis)) => {
                let standard = standard.map_or("none".to_owned(), |value| format!("`{}`", toml_of(value)));
                format!("{standard}; thesis: `{}`", toml_of(thesis))
            }
            (None, None) if required(key) => "required".to_owned(),
            (None, None) => String::new(),
        };
        let example = example(property).map(|value| format!("`{key} = {}`", toml_of(value))).unwrap_or_default();
        let name = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        let (kind, meaning) = (form(property), words(property));
        let cells = [format!("`{name}`"), kind, default, example, meaning].map(|cell| cell.replace('|', "\\|"));
        let _ = writeln!(text, "| {} |", cells.join(" | "));
    }
}

/// The keys of a table in the order of [`ORDER`].
fn keys(schema: &Value) -> Vec<(&str, &Value)> {
    let place = |key: &str| ORDER.iter().position(|known| *known == key).unwrap_or(ORDER.len());
    let properties = schema["properties"].as_object().into_iter().flatten();
    let mut keys: Vec<(&str, &Value)> = properties.map(|(key, value)| (key.as_str(), value)).collect();
    keys.sort_by_key(|(key, _)| (place(key), *key));
    keys
}

/// The type of a value, in short.
fn form(schema: &Value) -> String {
    match (schema["type"].as_str(), schema.get("anyOf")) {
        (_, Some(branches)) => {
            let forms: Vec<String> = branches.as_array().into_iter().flatten().map(form).collect();
            forms.join(" or ")
        }
        (Some("object"), _) => "table".to_owned(),
        (Some("array"), _) if schema["items"].get("properties").is_some() => "`[[...]]` tables".to_owned(),
        (Some("array"), _) => format!("array of {}", plural(&form(&schema["items"]))),
        _ => super::decode::describe(schema),
    }
}

/// Of several such values.
fn plural(form: &str) -> String {
    let singulars =
        [("a string", "strings"), ("a whole number", "whole numbers"), ("a number", "numbers"), ("array", "arrays")];
    let plural = |form: &str| match singulars.iter().find(|(singular, _)| form.starts_with(singular)) {
        Some((singular, plural)) => form.replacen(singular, plural, 1),
        None => form.to_owned(),
    };
    form.split(" or ").map(plural).collect::<Vec<_>>().join(" or ")
}

/// A value to show: an example, the default, or the first of the choices.
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
