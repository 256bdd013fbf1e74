//! The JSON Schema of job files, made from the keys of each product and the files of its profiles.

use std::{collections::BTreeMap, sync::LazyLock};

use serde_json::{Value, json};

use super::spec::{HeadSpec, SetSpec};
use crate::{product::ProductFactory, products::PRODUCTS, sections::Profile};
use form::{Schema, schema_of};

static SCHEMA: LazyLock<Value> = LazyLock::new(|| {
    let products = PRODUCTS.iter().map(|factory| alone(factory));
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "graspmill job",
        "oneOf": products.chain([SET.value().clone()]).collect::<Vec<_>>(),
    })
});
static SCHEMAS: LazyLock<BTreeMap<&'static str, Schema>> =
    LazyLock::new(|| PRODUCTS.iter().map(|factory| (factory.product.name, build(factory))).collect());
static SET: LazyLock<Schema> = LazyLock::new(|| schema_of::<SetSpec>("graspmill set of jobs"));

/// The JSON Schema of a job file. Beyond the draft's keywords: `x-unit`, and `x-default-thesis` where the `thesis`
/// profile has another default.
pub fn schema() -> &'static Value {
    &SCHEMA
}

/// The schema of one product's job files; `product` may still name any.
pub(super) fn of(factory: &ProductFactory) -> &'static Schema {
    &SCHEMAS[factory.product.name]
}

/// Whether files of a schema have a dotted key, in its sections or in the entries of its lists.
pub(super) fn has_key(schema: &Schema, dotted: &str) -> bool {
    let below = |level: &Value, key: &str| {
        let level = if level["items"].is_object() { &level["items"] } else { level };
        level["properties"].get(key).cloned()
    };
    dotted.split('.').try_fold(schema.value().clone(), |level, key| below(&level, key)).is_some()
}

/// The schema of a set.
pub(super) fn of_sets() -> &'static Schema {
    &SET
}

/// The schema of one product's job files and of no other's.
fn alone(factory: &ProductFactory) -> Value {
    let mut schema = of(factory).value().clone();
    let name = &mut schema["properties"]["product"];
    if let Some(name) = name.as_object_mut() {
        name.remove("oneOf");
        name.remove("type");
        name.insert("const".to_owned(), json!(factory.product.name));
    }
    schema
}

/// The defaults of a profile, as a job file without the keys that every file must have.
pub(super) fn defaults(factory: &ProductFactory, profile: Profile) -> toml::Table {
    let read = |text: &str| text.parse::<toml::Table>().expect("the profiles are TOML (a test reads them)");
    let [standard, thesis] = factory.profiles;
    let mut defaults = read(standard);
    if profile == Profile::Thesis {
        bare(factory).lay_over(&mut defaults, read(thesis));
    }
    defaults
}

/// The schema without defaults: the keys that every job has, and those of the product.
fn bare(factory: &ProductFactory) -> Schema {
    let title = format!("graspmill {} job", factory.product);
    let mut schema = (factory.keys)(&title);
    schema.add_keys(schema_of::<HeadSpec>(&title));
    schema
}

fn build(factory: &ProductFactory) -> Schema {
    let mut schema = bare(factory);
    let standard = defaults(factory, Profile::Standard);
    schema.insert_defaults(&standard, "default", None);
    schema.insert_defaults(&defaults(factory, Profile::Thesis), "x-default-thesis", Some(&standard));
    if factory.product != PRODUCTS[0].product {
        // Only the first product can be omitted.
        let root = schema.value_mut();
        if let Some(name) = root["properties"]["product"].as_object_mut() {
            name.remove("default");
        }
        if let Some(required) = root.get_mut("required").and_then(Value::as_array_mut) {
            required.insert(0, json!("product"));
        }
    }
    schema
}
