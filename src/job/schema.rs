//! The JSON Schema of job files, made from the spec and the profiles' default files.
//!
//! One truth: the decoder (`decode`) walks a job file with this schema, editors complete and check with it, and
//! docs/jobs.md is printed from it. Draft 7, without references, since that is what TOML editors know best.

use std::sync::LazyLock;

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::{Map, Value, json};

use super::{
    checked::Profile,
    spec::{
        HeadSpec, completion::CompletionSpec, grasp::GraspsSpec, patches::PatchesSpec, reachability::ReachabilitySpec,
        set::SetSpec,
    },
};
use crate::{
    ids::Product,
    render::{SENSOR_CONSTANTS, SensorConstant, SensorModel},
};

/// Default file of each profile: `standard`, and what `thesis` changes of it.
const COMPLETION: [&str; 2] =
    [include_str!("profiles/completion/standard.toml"), include_str!("profiles/completion/thesis.toml")];
const REACHABILITY: [&str; 2] =
    [include_str!("profiles/reachability/standard.toml"), include_str!("profiles/reachability/thesis.toml")];
const GRASPS: [&str; 2] = [include_str!("profiles/grasps/standard.toml"), include_str!("profiles/grasps/thesis.toml")];
const PATCHES: [&str; 2] =
    [include_str!("profiles/patches/standard.toml"), include_str!("profiles/patches/thesis.toml")];

static SCHEMA: LazyLock<Value> = LazyLock::new(|| {
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "graspmill job",
        "oneOf": Product::ALL.map(alone).into_iter().chain([SET.clone()]).collect::<Vec<_>>(),
    })
});
static SCHEMAS: LazyLock<[Value; 4]> = LazyLock::new(|| Product::ALL.map(build));
static SET: LazyLock<Value> = LazyLock::new(build_set);

/// The JSON Schema of a job file. Beyond the draft's keywords: `x-unit`, and `x-default-thesis` where the `thesis`
/// profile has another default.
pub fn schema() -> &'static Value {
    &SCHEMA
}

/// The schema of one product's job files; `product` may still name any.
pub(super) fn of(product: Product) -> &'static Value {
    &SCHEMAS[product as usize]
}

/// The schema of a set.
pub(super) fn of_sets() -> &'static Value {
    &SET
}

/// The schema of one product's job files and of no other's.
fn alone(product: Product) -> Value {
    let mut schema = of(product).clone();
    let name = &mut schema["properties"]["product"];
    if let Some(name) = name.as_object_mut() {
        name.remove("oneOf");
        name.remove("type");
        name.insert("const".to_owned(), json!(product.name()));
    }
    schema
}

/// The defaults of a profile, as a job file without the keys that every file must have.
pub(super) fn defaults(product: Product, profile: Profile) -> toml::Table {
    let read = |text: &str| text.parse::<toml::Table>().expect("the profiles are TOML (a test reads them)");
    let [standard, thesis] = match product {
        Product::Completion => COMPLETION,
        Product::Reachability => REACHABILITY,
        Product::Grasps => GRASPS,
        Product::Patches => PATCHES,
    };
    let mut defaults = read(standard);
    if profile == Profile::Thesis {
        lay_over(&mut defaults, read(thesis), &bare(product));
    }
    defaults
}

/// Lays one job over another: sections are joined key by key; a value, and a table that stands for one of several forms
/// (views, distance), is replaced whole.
pub(super) fn lay_over(below: &mut toml::Table, above: toml::Table, schema: &Value) {
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

/// The schema without defaults: the keys that every job has, and those of the product.
fn bare(product: Product) -> Value {
    let generator = || SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true).into_generator();
    let mut head = generator().into_root_schema_for::<HeadSpec>().to_value();
    let mut schema = match product {
        Product::Completion => generator().into_root_schema_for::<CompletionSpec>().to_value(),
        Product::Reachability => generator().into_root_schema_for::<ReachabilitySpec>().to_value(),
        Product::Grasps => generator().into_root_schema_for::<GraspsSpec>().to_value(),
        Product::Patches => generator().into_root_schema_for::<PatchesSpec>().to_value(),
    };
    if let (Some(keys), Some(more)) = (schema["properties"].as_object_mut(), head["properties"].as_object_mut()) {
        keys.append(more);
    }
    if let (Some(keys), Some(more)) = (schema["required"].as_array_mut(), head["required"].as_array_mut()) {
        keys.append(more);
    }
    schema["additionalProperties"] = json!(false);
    simplify(&mut schema);
    if product == Product::Completion {
        describe_sensors(&mut schema["properties"]["sensor"]["properties"]);
    }
    schema
}

/// The sensor model lists its own profiles and constants.
fn describe_sensors(sensor: &mut Value) {
    let profiles: Vec<&str> = ["none"].into_iter().chain(SensorModel::profiles()).collect();
    sensor["profile"]["enum"] = json!(profiles);
    let models: Vec<SensorModel> = SensorModel::profiles().filter_map(SensorModel::profile).collect();
    let constant = |(place, constant): (usize, &SensorConstant)| {
        let SensorConstant { key, unit, min, max, meaning } = constant;
        let value_of = |model: &SensorModel| format!("{}: {}", model.profile_name(), model.canonical()[place].1);
        let values: Vec<String> = models.iter().map(value_of).collect();
        let description = format!("{meaning}. {}.", values.join(", "));
        let mut schema = json!({ "type": "number", "minimum": min, "maximum": max, "description": description });
        schema["examples"] = json!([models[0].canonical()[place].1]);
        if *unit != "1" {
            schema["x-unit"] = json!(unit);
        }
        ((*key).to_owned(), schema)
    };
    let constants: Map<String, Value> = SENSOR_CONSTANTS.iter().enumerate().map(constant).collect();
    sensor["constants"]["properties"] = Value::Object(constants);
    sensor["constants"]["additionalProperties"] = json!(false);
}

fn build(product: Product) -> Value {
    let mut schema = bare(product);
    let standard = defaults(product, Profile::Standard);
    insert_defaults(&mut schema, &standard, "default", None);
    insert_defaults(&mut schema, &defaults(product, Profile::Thesis), "x-default-thesis", Some(&standard));
    let root = schema.as_object_mut().expect("the schema of a struct is an object");
    root.remove("$schema");
    if product != Product::Completion {
        // Only the first product may be left unsaid.
        if let Some(Value::Object(name)) = root.get_mut("properties").map(|keys| &mut keys["product"]) {
            name.remove("default");
        }
        if let Some(Value::Array(required)) = root.get_mut("required") {
            required.insert(0, json!("product"));
        }
    }
    root.insert("title".to_owned(), json!(format!("graspmill {product} job")));
    schema
}

fn build_set() -> Value {
    of_form::<SetSpec>("graspmill set of jobs")
}

/// The schema of any file that is read as strictly as a job.
pub(super) fn of_form<T: JsonSchema>(title: &str) -> Value {
    let generator = SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true).into_generator();
    let mut schema = generator.into_root_schema_for::<T>().to_value();
    simplify(&mut schema);
    let root = schema.as_object_mut().expect("the schema of a struct is an object");
    root.remove("$schema");
    root.insert("title".to_owned(), json!(title));
    schema
}

/// Takes out what TOML cannot say (null) and what editors stumble over (Rust's number formats).
fn simplify(schema: &mut Value) {
    let Value::Object(map) = schema else {
        if let Value::Array(list) = schema {
            list.iter_mut().for_each(simplify);
        }
        return;
    };
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
    // In a map of properties the keys are names, not keywords; they hold schemas all the same.
    map.values_mut().for_each(simplify);
}

/// Writes the defaults into the schema, those that differ from `unless`; what has a default is not required.
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
