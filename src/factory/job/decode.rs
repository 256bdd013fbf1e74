//! From text to the keys of a job: the product picks the schema, the profile the defaults.

use std::{collections::BTreeMap, sync::LazyLock};

use super::{renamed, schema, spec::HeadSpec};
use crate::{
    product::ProductFactory,
    products::{PRODUCTS, factory_of},
    sections::Profile,
};
use form::{Checker, Document, FormErrors, Hints, Path, Requirement, nearest};
use format::Product;

/// Name of a job file with all files that it names, for messages.
pub(super) const NAME: &str = "the job";

/// A job file as read, with the mistakes found so far.
pub(super) struct Decoded {
    /// The keys that every job has, defaults filled in.
    pub head: HeadSpec,
    /// The product.
    pub factory: &'static ProductFactory,
    /// All keys, defaults filled in.
    pub keys: toml::Table,
    /// The document and its mistakes.
    pub checker: Checker,
}

/// Reads a job file and the overrides laid over it.
///
/// # Errors
/// When the schema lets something pass that the spec does not: a mistake of ours, not of the job.
pub(super) fn decode(label: &str, text: &str, overrides: &[String]) -> Result<Decoded, FormErrors> {
    let (document, syntax) = Document::read(label, text, overrides);
    let factory = factory_of(product_of(&document));
    let mut checker = Checker::new(document.named(NAME), syntax);
    checker.check_schema(schema::of(factory), &JobHints(factory));
    let mut written = checker.document().to_table();
    if has_objects(factory) {
        // An empty list replaces a missing one, which was reported.
        written.entry("objects").or_insert_with(|| toml::Value::Array(Vec::new()));
    }
    let profile = match written.get("profile").and_then(toml::Value::as_str) {
        Some("thesis") => Profile::Thesis,
        _ => Profile::Standard,
    };
    let mut keys = schema::defaults(factory, profile);
    schema::of(factory).lay_over(&mut keys, written);
    let (head, checker) = checker.value_of(&keys)?;
    Ok(Decoded { head, factory, keys, checker })
}

/// The product that was meant: a misspelt one is a mistake of that key alone, and a job that names none is of the first.
fn product_of(document: &Document) -> Product {
    let near = document.text("product").and_then(|word| nearest(word, Product::all().map(|product| product.name)));
    near.and_then(Product::from_name).unwrap_or(PRODUCTS[0].product)
}

fn has_objects(factory: &ProductFactory) -> bool {
    schema::of(factory).value()["properties"].get("objects").is_some()
}

/// Hints for the keys of a product's jobs.
struct JobHints(&'static ProductFactory);

impl Hints for JobHints {
    fn unknown_key(&self, path: &Path, key: &str) -> Option<String> {
        let written = path.to_string();
        if let Some((_, help)) = self.0.key_hints.iter().find(|(word, _)| *word == written) {
            return Some((*help).to_owned());
        }
        let paths = |factory: &ProductFactory| KEY_PATHS.get(factory.product.name);
        let elsewhere = paths(self.0)?.get(key).map(|path| format!("did you mean `{path}`?"));
        elsewhere.or_else(|| {
            let has_key = |other: &&&ProductFactory| paths(other).is_some_and(|paths| paths.contains_key(key));
            let other = PRODUCTS.iter().find(has_key)?.product;
            Some(format!("`{key}` is a key of {other} jobs: `product = \"{other}\"`"))
        })
    }

    fn renamed_key(&self, path: &Path) -> Option<Path> {
        renamed::new_key(schema::of(self.0), path)
    }

    fn renamed_value(&self, path: &Path, value: &str) -> Option<String> {
        renamed::new_value(path, value).map(str::to_owned)
    }

    fn missing(&self, path: &Path) -> Option<(Requirement, String)> {
        let is_objects = has_objects(self.0) && *path == Path::from("objects");
        is_objects.then(|| {
            let expected = "at least one [[objects]] entry with a folder, list, package or built_in";
            (expected.into(), "`[[objects]]` with `built_in = 24` needs no download".to_owned())
        })
    }
}

/// Dotted path of each key, per product.
static KEY_PATHS: LazyLock<BTreeMap<&'static str, BTreeMap<String, String>>> =
    LazyLock::new(|| PRODUCTS.iter().map(|factory| (factory.product.name, key_paths(factory))).collect());

fn key_paths(factory: &'static ProductFactory) -> BTreeMap<String, String> {
    let mut paths = BTreeMap::new();
    for (section, schema) in schema::of(factory).value()["properties"].as_object().into_iter().flatten() {
        paths.insert(section.clone(), section.clone());
        let of_entries = schema["items"]["properties"].as_object();
        for key in schema["properties"].as_object().or(of_entries).into_iter().flat_map(|keys| keys.keys()) {
            paths.entry(key.clone()).or_insert(format!("{section}.{key}"));
        }
    }
    paths
}
