//! JSON Schemas of files, made from Rust types.
//!
//! The schema is the only source: documents are checked against it, editors complete and check with it, and references are
//! printed from it. Draft 7 without references, because TOML editors support it best.

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::{Map, Value, json};

/// The schema of a file. Additional keywords are `x-unit`, the unit of a number, and `x-default-NAME`, a default with that name.
#[derive(Clone, Debug, PartialEq)]
pub struct Schema(Value);

/// The schema of the type `T`; `title` describes such a file.
///
/// # Panics
/// When a string has a pattern other than a fixed number of hexadecimal digits: no other pattern is checked.
pub fn schema_of<T: JsonSchema>(title: &str) -> Schema {
    let generator = SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true).into_generator();
    let mut schema = generator.into_root_schema_for::<T>().to_value();
    simplify(&mut schema);
    let root = schema.as_object_mut().expect("the schema of a struct is an object");
    root.remove("$schema");
    root.insert("title".to_owned(), json!(title));
    Schema(schema)
}

impl Schema {
    /// JSON of the schema.
    pub fn value(&self) -> &Value {
        &self.0
    }

    /// JSON of the schema, to express more than the types do.
    pub fn value_mut(&mut self) -> &mut Value {
        &mut self.0
    }

    /// Appends the keys of another schema. Unknown keys remain forbidden.
    pub fn add_keys(&mut self, other: Self) {
        let Self(other) = other;
        for keyword in ["properties", "required"] {
            match (self.0.get_mut(keyword), &other[keyword]) {
                (Some(Value::Object(keys)), Value::Object(more)) => keys.extend(more.clone()),
                (Some(Value::Array(keys)), Value::Array(more)) => keys.extend(more.iter().cloned()),
                (_, Value::Null) => {}
                (_, more) => self.0[keyword] = more.clone(),
            }
        }
        self.0["additionalProperties"] = json!(false);
    }

    /// Merges one file of this schema over another: sections are merged key by key; a value, and a table with several forms, is
    /// replaced as a whole.
    pub fn lay_over(&self, below: &mut toml::Table, above: toml::Table) {
        lay_over(below, above, &self.0);
    }

    /// Writes the defaults under `keyword`, skipping those equal to `unless`; a key with a default is not required.
    pub fn insert_defaults(&mut self, defaults: &toml::Table, keyword: &str, unless: Option<&toml::Table>) {
        insert_defaults(&mut self.0, defaults, keyword, unless);
    }
}

fn lay_over(below: &mut toml::Table, above: toml::Table, schema: &Value) {
    for (key, value) in above {
        let section = &schema["properties"][&key];
        match (below.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) if section.get("properties").is_some() => {
                lay_over(old, new, section);
            }
            (_, value) => {
                below.insert(key, value);
            }
        }
    }
}

fn insert_defaults(schema: &mut Value, defaults: &toml::Table, keyword: &str, unless: Option<&toml::Table>) {
    if let Some(Value::Array(required)) = schema.get_mut("required") {
        required.retain(|key| key.as_str().is_none_or(|key| !defaults.contains_key(key)));
        if required.is_empty() {
            schema.as_object_mut().map(|map| map.remove("required"));
        }
    }
    for (key, value) in defaults {
        let property = &mut schema["properties"][key];
        let other = unless.and_then(|unless| unless.get(key));
        match value {
            toml::Value::Table(table) if property.get("properties").is_some() => {
                insert_defaults(property, table, keyword, other.and_then(toml::Value::as_table));
            }
            value if other != Some(value) => {
                let value = serde_json::to_value(value).expect("a default is plain data");
                property.as_object_mut().unwrap_or(&mut Map::new()).insert(keyword.to_owned(), value);
            }
            _ => {}
        }
    }
}

/// Removes values that TOML cannot express (null) and formats that editors do not know (Rust's number formats).
fn simplify(schema: &mut Value) {
    let Value::Object(map) = schema else { return };
    if let Some(Value::Array(types)) = map.get_mut("type") {
        types.retain(|kind| kind != "null");
        if let [single] = types.as_slice() {
            let single = single.clone();
            map.insert("type".to_owned(), single);
        }
    }
    if let Some(Value::Array(branches)) = map.get_mut("anyOf") {
        branches.retain(|branch| branch["type"] != "null");
        if let [Value::Object(single)] = branches.as_slice() {
            let single = single.clone();
            map.remove("anyOf");
            for (key, value) in single {
                map.entry(key).or_insert(value);
            }
        }
    }
    if map.remove("format").is_some_and(|format| format == "uint32") {
        map.entry("maximum").or_insert(json!(u32::MAX));
    }
    if let Some(pattern) = map.get("pattern") {
        assert!(hexadecimal_digits(pattern).is_some(), "the pattern {pattern} would not be checked");
    }
    // Only at positions of schemas: examples and defaults are data, keys of `properties` are names.
    for (keyword, below) in map {
        match (keyword.as_str(), below) {
            ("properties" | "definitions", Value::Object(keys)) => keys.values_mut().for_each(simplify),
            ("anyOf" | "oneOf" | "allOf", Value::Array(branches)) => branches.iter_mut().for_each(simplify),
            ("items", Value::Array(elements)) => elements.iter_mut().for_each(simplify),
            ("items" | "additionalProperties", below) => simplify(below),
            _ => {}
        }
    }
}

/// Number of hexadecimal digits that a string must have, if its schema requires them.
pub(super) fn digits_of_pattern(schema: &Value) -> Option<usize> {
    hexadecimal_digits(schema.get("pattern")?)
}

/// Reads `^[0-9a-f]{64}$`.
fn hexadecimal_digits(pattern: &Value) -> Option<usize> {
    pattern.as_str()?.strip_prefix("^[0-9a-f]{")?.strip_suffix("}$")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    use super::*;

    /// A box.
    #[derive(Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only its schema is read")]
    struct Crate {
        /// Sides.
        size: Option<Size>,
        /// Pieces.
        #[schemars(extend("examples" = [{ "format": "data", "type": ["null", "x"] }]))]
        count: u32,
        /// Digest.
        #[schemars(regex(pattern = "^[0-9a-f]{8}$"))]
        content: Option<String>,
    }

    #[derive(Deserialize, JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only its schema is read")]
    struct Size {
        /// Width.
        width: f64,
        /// A key that is named like a keyword.
        format: f64,
    }

    #[test]
    fn schemas_are_plain() {
        let schema = schema_of::<Crate>("a box");
        let keys = &schema.value()["properties"];
        assert_eq!(schema.value()["title"], "a box");
        assert_eq!(schema.value()["required"], json!(["count"]));
        assert_eq!(keys["content"]["type"], "string");
        assert_eq!((&keys["count"]["maximum"], keys["count"].get("format")), (&json!(u32::MAX), None));
        assert_eq!(digits_of_pattern(&keys["content"]), Some(8));
        // Without null and references; keys and data that look like keywords stay.
        assert_eq!(keys["size"]["type"], "object");
        assert!(keys["size"]["properties"].get("format").is_some());
        assert_eq!(keys["count"]["examples"], json!([{ "format": "data", "type": ["null", "x"] }]));
    }

    #[test]
    fn defaults_make_keys_optional_and_are_laid_under_files() {
        let mut schema = schema_of::<Crate>("a box");
        let read = |text: &str| text.parse::<toml::Table>().expect("TOML");
        let standard = read("count = 3\nsize = { width = 1.0, format = 2.0 }");
        schema.insert_defaults(&standard, "default", None);
        schema.insert_defaults(&read("count = 3\nsize = { width = 5.0 }"), "x-default-wide", Some(&standard));
        let keys = &schema.value()["properties"];
        assert_eq!(schema.value().get("required"), None);
        assert_eq!((&keys["count"]["default"], keys["count"].get("x-default-wide")), (&json!(3), None));
        assert_eq!(keys["size"]["properties"]["width"]["x-default-wide"], json!(5.0));
        let mut filled = standard;
        schema.lay_over(&mut filled, read("size = { width = 7.0 }"));
        assert_eq!(filled, read("count = 3\nsize = { width = 7.0, format = 2.0 }"));
    }

    #[test]
    fn keys_of_two_schemas_are_joined() {
        let mut schema = schema_of::<Crate>("a box");
        schema.add_keys(schema_of::<Size>("a size"));
        let keys: Vec<&String> = schema.value()["properties"].as_object().expect("keys").keys().collect();
        assert_eq!(keys, ["content", "count", "format", "size", "width"]);
        assert_eq!(schema.value()["required"], json!(["count", "width", "format"]));
        assert_eq!(schema.value()["additionalProperties"], false);
    }
}
