//! From a document to the keys of a job, by walking it with the schema: every mistake is reported, none stops the walk.
//!
//! What is wrong is taken out of the document, so that the profile's default stands in for it and the checks that
//! follow can report their mistakes in the same run.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, de::DeserializeOwned};
use serde_json::Value;

use super::{
    checked::Profile,
    document::{Document, Node, NodeValue, Path},
    errors::{JobError, JobErrors, Problem},
    schema,
    spec::{BodySpec, HeadSpec, set::SetSpec},
};
use crate::ids::Product;

/// A document as read, with what was wrong in it.
pub(super) struct Decoded {
    /// The keys that every job has, defaults filled in.
    pub head: HeadSpec,
    /// The keys of its product, likewise.
    pub body: BodySpec,
    /// As written, without the mistakes.
    pub document: Document,
    /// The mistakes.
    pub errors: Vec<JobError>,
    /// Where the mistakes were, so that nothing is reported twice.
    pub wrong: Vec<Path>,
}

/// Reads a job file and the overrides laid over it.
///
/// # Errors
/// When the schema lets something pass that the spec does not: a mistake of ours, not of the job.
pub(super) fn decode(label: &str, text: &str, overrides: &[String]) -> Result<Decoded, JobErrors> {
    let (mut document, errors) = Document::read(label, text, overrides);
    let mut root = document.root.clone();
    let product = product_of(&root);
    let mut walk = Walk { product: Some(product), document: &document, errors, wrong: Vec::new() };
    walk.value(&mut root, schema::of(product), &Path::default());
    let Walk { mut errors, mut wrong, .. } = walk;
    let mut written = match root.to_toml() {
        toml::Value::Table(table) => table,
        _ => toml::Table::new(),
    };
    let has_objects = matches!(product, Product::Completion | Product::Grasps);
    if has_objects && !written.contains_key("objects") {
        let path = Path::of("objects");
        if !wrong.iter().any(|wrong| path.holds(wrong)) {
            let expected = "at least one [[objects]] entry with a folder, list, package or built_in".to_owned();
            errors.push(
                JobError::at(document.place_of(&path), "objects", Problem::Missing { expected })
                    .with_help("`[[objects]]` with `built_in = 24` needs no download"),
            );
        }
        wrong.push(path);
        written.insert("objects".to_owned(), toml::Value::Array(Vec::new()));
    }
    let profile = match written.get("profile").and_then(toml::Value::as_str) {
        Some("thesis") => Profile::Thesis,
        _ => Profile::Standard,
    };
    let mut filled = schema::defaults(product, profile);
    schema::lay_over(&mut filled, written, schema::of(product));
    let (head, body) = match read(product, &toml::Value::Table(filled)) {
        Ok(read) => read,
        Err(error) => {
            let problem = Problem::Syntax { message: error.message().to_owned() };
            let place = document.place_of(&Path::default());
            errors.push(JobError::at(place, "", problem).with_help("this is a mistake in graspmill's own schema"));
            return Err(JobErrors::of(errors));
        }
    };
    document.root = root;
    Ok(Decoded { head, body, document, errors, wrong })
}

/// The product that was meant: a misspelt one is a mistake of that key alone.
fn product_of(root: &Node) -> Product {
    let NodeValue::Table(table) = &root.value else { return Product::Completion };
    let Some(NodeValue::Text(text)) = table.get("product").map(|node| &node.value) else { return Product::Completion };
    let near = nearest(text, Product::ALL.into_iter().map(Product::name));
    near.and_then(Product::from_name).unwrap_or(Product::Completion)
}

fn read(product: Product, filled: &toml::Value) -> Result<(HeadSpec, BodySpec), toml::de::Error> {
    let body = match product {
        Product::Completion => BodySpec::Completion(Deserialize::deserialize(filled.clone())?),
        Product::Reachability => BodySpec::Reachability(Deserialize::deserialize(filled.clone())?),
        Product::Grasps => BodySpec::Grasps(Deserialize::deserialize(filled.clone())?),
        Product::Patches => BodySpec::Patches(Deserialize::deserialize(filled.clone())?),
    };
    Ok((HeadSpec::deserialize(filled.clone())?, body))
}

/// A file of one form as read, with what was wrong in it.
pub(super) struct DecodedAs<T> {
    /// Its keys.
    pub spec: T,
    /// As written, without the mistakes.
    pub document: Document,
    /// The mistakes.
    pub errors: Vec<JobError>,
    /// Where the mistakes were.
    pub wrong: Vec<Path>,
}

/// Reads a job file that names job files.
///
/// # Errors
/// When a key that it cannot do without is missing or wrong: nothing further can be said.
pub(super) fn decode_set(label: &str, text: &str) -> Result<DecodedAs<SetSpec>, JobErrors> {
    decode_as(label, text, schema::of_sets())
}

/// Reads a file whose form `schema` says.
///
/// # Errors
/// When a key that it cannot do without is missing or wrong: nothing further can be said.
pub(super) fn decode_as<T: DeserializeOwned>(
    label: &str,
    text: &str,
    schema: &Value,
) -> Result<DecodedAs<T>, JobErrors> {
    let (mut document, errors) = Document::read(label, text, &[]);
    let mut root = document.root.clone();
    let mut walk = Walk { product: None, document: &document, errors, wrong: Vec::new() };
    walk.value(&mut root, schema, &Path::default());
    let Walk { mut errors, wrong, .. } = walk;
    let spec = match T::deserialize(root.to_toml()) {
        Ok(spec) => spec,
        Err(error) => {
            if errors.is_empty() {
                let problem = Problem::Syntax { message: error.message().to_owned() };
                errors.push(JobError::at(document.place_of(&Path::default()), "", problem));
            }
            return Err(JobErrors::of(errors));
        }
    };
    document.root = root;
    Ok(DecodedAs { spec, document, errors, wrong })
}

struct Walk<'a> {
    /// `None` in a file that is no job of one product.
    product: Option<Product>,
    document: &'a Document,
    errors: Vec<JobError>,
    wrong: Vec<Path>,
}

impl Walk<'_> {
    fn report(&mut self, place: super::Place, path: &Path, problem: Problem, help: Option<String>) {
        self.wrong.push(path.clone());
        self.errors.push(JobError { place, key: path.to_string(), problem, help });
    }

    fn reject(&mut self, node: &Node, path: &Path, problem: Problem) -> bool {
        self.report(self.document.place(&node.span), path, problem, None);
        false
    }

    /// Whether the value may stay.
    fn value(&mut self, node: &mut Node, schema: &Value, path: &Path) -> bool {
        if let Some(choices) = choices(schema) {
            return self.choice(node, &choices, path);
        }
        if let Some(branches) = schema["anyOf"].as_array() {
            if self.no_form(node, branches, path) {
                return false;
            }
            return match best_branch(node, branches) {
                Some(branch) => self.value(node, branch, path),
                None => self.wrong_type(node, schema, path),
            };
        }
        match (&node.value, schema["type"].as_str()) {
            (NodeValue::Table(_), Some("object")) => self.table(node, schema, path),
            (NodeValue::Array(_), Some("array")) => self.array(node, schema, path),
            (NodeValue::Boolean(_), Some("boolean")) => true,
            (NodeValue::Text(text), Some("string")) => {
                let digest = schema.get("pattern").is_some();
                if digest && crate::ids::Digest::from_hex(text).is_none() {
                    let problem =
                        Problem::Senseless { expected: "64 hexadecimal digits".to_owned(), found: node.describe() };
                    return self.reject(node, path, problem);
                }
                true
            }
            (NodeValue::Integer(number), Some("integer" | "number")) => {
                let number = *number as f64;
                self.range(node, number, schema, path)
            }
            (NodeValue::Float(number), Some("number")) => self.range(node, *number, schema, path),
            _ => self.wrong_type(node, schema, path),
        }
    }

    /// Reports the keys of a table of which no form knows any: it cannot be told what else is missing.
    fn no_form(&mut self, node: &Node, branches: &[Value], path: &Path) -> bool {
        let NodeValue::Table(table) = &node.value else { return false };
        let forms = branches.iter().filter_map(|branch| branch["properties"].as_object());
        let known: BTreeSet<String> = forms.flat_map(|properties| properties.keys().cloned()).collect();
        if known.is_empty() || table.is_empty() || table.keys().any(|key| known.contains(key)) {
            return false;
        }
        let known: Vec<String> = known.into_iter().collect();
        for (key, child) in table {
            self.unknown_key(child, key, known.clone(), path);
        }
        true
    }

    fn unknown_key(&mut self, child: &Node, key: &str, known: Vec<String>, path: &Path) {
        let help = suggestion(self.product, key, &known);
        let problem = Problem::UnknownKey { found: key.to_owned(), known };
        self.report(self.document.place(&child.key_span), &path.key(key), problem, help);
    }

    fn wrong_type(&mut self, node: &Node, schema: &Value, path: &Path) -> bool {
        self.reject(node, path, Problem::WrongType { expected: describe(schema), found: node.describe() })
    }

    fn choice(&mut self, node: &Node, choices: &[String], path: &Path) -> bool {
        let NodeValue::Text(text) = &node.value else {
            let expected = format!("one of {}", quoted(choices));
            return self.reject(node, path, Problem::WrongType { expected, found: node.describe() });
        };
        if choices.contains(text) {
            return true;
        }
        let problem = Problem::NotAChoice { found: text.clone(), choices: choices.to_vec() };
        let help = did_you_mean(text, choices.iter().map(String::as_str));
        self.report(self.document.place(&node.span), path, problem, help);
        false
    }

    fn range(&mut self, node: &Node, number: f64, schema: &Value, path: &Path) -> bool {
        let limit = |keyword: &str| schema[keyword].as_f64();
        let fits = number.is_finite()
            && limit("minimum").is_none_or(|limit| number >= limit)
            && limit("maximum").is_none_or(|limit| number <= limit)
            && limit("exclusiveMinimum").is_none_or(|limit| number > limit)
            && limit("exclusiveMaximum").is_none_or(|limit| number < limit);
        fits || self.reject(node, path, Problem::OutOfRange { expected: describe(schema), found: node.describe() })
    }

    fn array(&mut self, node: &mut Node, schema: &Value, path: &Path) -> bool {
        let (before, mut kept) = (node.clone(), true);
        let NodeValue::Array(elements) = &mut node.value else { return false };
        let count = elements.len() as u64;
        if schema["minItems"].as_u64().is_some_and(|least| count < least)
            || schema["maxItems"].as_u64().is_some_and(|most| count > most)
        {
            let problem = Problem::OutOfRange { expected: describe(schema), found: before.describe() };
            return self.reject(&before, path, problem);
        }
        let of_tables = schema["items"].get("properties").is_some();
        let mut index = 0;
        elements.retain_mut(|element| {
            let fine = self.value(element, &schema["items"], &path.index(index));
            index += 1;
            kept &= fine || of_tables;
            fine || !of_tables
        });
        kept
    }

    fn table(&mut self, node: &mut Node, schema: &Value, path: &Path) -> bool {
        let place = self.document.place(&node.key_span);
        let NodeValue::Table(table) = &mut node.value else { return false };
        let properties = schema["properties"].as_object();
        let free = schema.get("additionalProperties").filter(|free| free.is_object());
        table.retain(|key, child| match (properties.and_then(|properties| properties.get(key)), free) {
            (Some(schema), _) | (None, Some(schema)) => self.value(child, schema, &path.key(key)),
            (None, None) => {
                let known = properties.into_iter().flat_map(|known| known.keys().cloned()).collect();
                self.unknown_key(child, key, known, path);
                false
            }
        });
        let required = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str);
        let missing: Vec<&str> = required.filter(|key| !table.contains_key(*key) && *key != "objects").collect();
        for key in &missing {
            let below = path.key(key);
            // Written, but wrong: that has been said.
            if !self.wrong.iter().any(|wrong| below.holds(wrong)) {
                let expected = describe(&schema["properties"][*key]);
                self.report(place.clone(), &below, Problem::Missing { expected }, None);
            }
        }
        missing.is_empty()
    }
}

/// The strings of an enumeration.
fn choices(schema: &Value) -> Option<Vec<String>> {
    let of = |list: &Vec<Value>, pick: fn(&Value) -> Option<&str>| {
        list.iter().map(|value| pick(value).map(str::to_owned)).collect::<Option<Vec<String>>>()
    };
    if let Some(list) = schema["enum"].as_array() {
        return of(list, Value::as_str);
    }
    schema["oneOf"].as_array().and_then(|list| of(list, |branch| branch["const"].as_str()))
}

/// The form of a value that was most likely meant.
fn best_branch<'a>(node: &Node, branches: &'a [Value]) -> Option<&'a Value> {
    let score = |branch: &Value| -> Option<usize> {
        match (&node.value, branch["type"].as_str()) {
            (NodeValue::Text(_), _) if choices(branch).is_some() => Some(0),
            (NodeValue::Boolean(_), Some("boolean"))
            | (NodeValue::Text(_), Some("string"))
            | (NodeValue::Array(_), Some("array"))
            | (NodeValue::Float(_) | NodeValue::Integer(_), Some("number")) => Some(0),
            (NodeValue::Integer(_), Some("integer")) => Some(1),
            (NodeValue::Table(table), Some("object")) => {
                let known = branch["properties"].as_object()?;
                Some(table.keys().filter(|key| known.contains_key(*key)).count())
            }
            _ => None,
        }
    };
    let scored = branches.iter().filter_map(|branch| Some((score(branch)?, branch)));
    // The first of the best.
    scored
        .fold(None, |best: Option<(usize, &Value)>, next| match best {
            Some(best) if best.0 >= next.0 => Some(best),
            _ => Some(next),
        })
        .map(|(_, branch)| branch)
}

/// What a schema asks for, in words.
pub(super) fn describe(schema: &Value) -> String {
    if let Some(choices) = choices(schema) {
        return format!("one of {}", quoted(&choices));
    }
    if let Some(branches) = schema["anyOf"].as_array() {
        let forms: Vec<String> = branches.iter().map(describe).collect();
        return forms.join(", or ");
    }
    let unit = schema["x-unit"].as_str().map(|unit| format!(" [{unit}]")).unwrap_or_default();
    match schema["type"].as_str() {
        Some("integer") => format!("a whole number{}{unit}", range_of(schema)),
        Some("number") => format!("a number{}{unit}", range_of(schema)),
        Some("boolean") => "true or false".to_owned(),
        Some("string") => "a string".to_owned(),
        Some("array") => {
            let count = match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                (Some(least), Some(most)) if least == most => format!(" of {least}"),
                (Some(least), Some(most)) => format!(" of {least} to {most}"),
                (Some(least), None) => format!(" of at least {least}"),
                (None, Some(most)) => format!(" of at most {most}"),
                (None, None) => String::new(),
            };
            format!("an array{count}, each {}", describe(&schema["items"]))
        }
        Some("object") => match schema["properties"].as_object() {
            Some(properties) => {
                let needed =
                    |key: &str| schema["required"].as_array().is_some_and(|list| list.iter().any(|k| k == key));
                let mut keys: Vec<String> = properties.keys().filter(|key| needed(key)).cloned().collect();
                if keys.is_empty() {
                    keys = properties.keys().cloned().collect();
                }
                format!("a table with {}", keys.join(", "))
            }
            None => "a table".to_owned(),
        },
        _ => "another value".to_owned(),
    }
}

fn range_of(schema: &Value) -> String {
    let number = |keyword: &str| schema[keyword].as_f64().filter(|limit| *limit < f64::from(u32::MAX));
    let low = number("minimum").map(|limit| format!(" from {limit}"));
    let low = low.or_else(|| number("exclusiveMinimum").map(|limit| format!(" above {limit}")));
    let high = number("maximum").map(|limit| format!(" to {limit}"));
    let high = high.or_else(|| number("exclusiveMaximum").map(|limit| format!(" below {limit}")));
    match (low, high) {
        (None, Some(high)) => high.replace(" to ", " up to "),
        (low, high) => [low, high].into_iter().flatten().collect(),
    }
}

fn quoted(choices: &[String]) -> String {
    choices.iter().map(|choice| format!("\"{choice}\"")).collect::<Vec<_>>().join(", ")
}

/// The key that was meant: one that is known here, else the same key in another section or of another product.
fn suggestion(product: Option<Product>, key: &str, known: &[String]) -> Option<String> {
    let Some(product) = product else { return did_you_mean(key, known.iter().map(String::as_str)) };
    let elsewhere = || KEY_PLACES[product as usize].get(key).map(|path| format!("did you mean `{path}`?"));
    let other = |other: &Product| KEY_PLACES[*other as usize].contains_key(key);
    let of_another = || {
        let other = Product::ALL.into_iter().find(other)?;
        Some(format!("`{key}` is a key of {other} jobs: `product = \"{other}\"`"))
    };
    did_you_mean(key, known.iter().map(String::as_str)).or_else(elsewhere).or_else(of_another)
}

/// Key -> its dotted path, a map a product.
static KEY_PLACES: std::sync::LazyLock<[BTreeMap<String, String>; 4]> =
    std::sync::LazyLock::new(|| Product::ALL.map(key_places));

fn key_places(product: Product) -> BTreeMap<String, String> {
    let mut places = BTreeMap::new();
    for (section, schema) in schema::of(product)["properties"].as_object().into_iter().flatten() {
        places.insert(section.clone(), section.clone());
        let of_entries = schema["items"]["properties"].as_object();
        for key in schema["properties"].as_object().or(of_entries).into_iter().flat_map(|keys| keys.keys()) {
            places.entry(key.clone()).or_insert(format!("{section}.{key}"));
        }
    }
    places
}

/// `did you mean ...?` for the name that is nearest, when one is near.
pub(super) fn did_you_mean<'a>(found: &str, known: impl Iterator<Item = &'a str>) -> Option<String> {
    nearest(found, known).map(|name| format!("did you mean `{name}`?"))
}

/// The name that is nearest, when one is near.
fn nearest<'a>(found: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace(['-', ' '], "_");
    let wanted = plain(found);
    let distance = |name: &str| {
        let name = plain(name);
        let part = wanted.len() >= 3 && name.split('_').any(|word| word == wanted);
        if part { 1 } else { strsim::damerau_levenshtein(&wanted, &name) }
    };
    let (distance, name) = known.map(|name| (distance(name), name)).min()?;
    (distance <= (wanted.chars().count() / 3).max(1)).then_some(name)
}
