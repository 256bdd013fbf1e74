//! An export format: its row with a form per product, the selection of samples, and the written content.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::{error::ExportError, target::Target};
use format::{
    Noun, Product,
    dataset::{DatasetReader, Selection},
};

/// A format that datasets can be exported in: one row of the table of formats.
pub struct ExportFormat {
    /// Name on the command line and in `export.json`.
    pub name: &'static str,
    /// Content, one sentence.
    pub summary: &'static str,
    /// Whether the format can hold one byte per cell instead of packed bits ([`ExportSelection::unpacked`]).
    pub has_unpacked: bool,
    /// Form of each product that has this format.
    pub forms: &'static [ExportForm],
}

/// Form of a format for the datasets of one product.
pub struct ExportForm {
    /// Product of the datasets.
    pub product: Product,
    /// Singular and plural noun of the counted items.
    pub counted: Noun,
    /// Numbers that the form needs and that no dataset contains.
    pub keys: &'static [ExportKey],
    /// Text about the layout of the files, for `export.json`; the argument is [`ExportSelection::unpacked`].
    pub(super) layout: fn(bool) -> &'static str,
    /// Writes the files.
    pub(super) write: fn(&DatasetReader, &ExportSelection, &mut Target) -> Result<Written, ExportError>,
}

/// A number that a form needs and that no dataset contains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExportKey {
    /// Name, as in the files of the format.
    pub name: &'static str,
    /// Default value.
    pub default: f64,
    /// Meaning with unit, a sentence.
    pub meaning: &'static str,
}

impl ExportFormat {
    /// The form for datasets of a product; `None` if the format does not support it.
    pub fn form(&self, product: Product) -> Option<&'static ExportForm> {
        self.forms.iter().find(|form| form.product == product)
    }
}

/// Selection of samples, and options of the output.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExportSelection {
    /// Samples of a split or of a nested training subset.
    pub samples: Selection,
    /// Names of the objects to export; every object when empty.
    pub objects: Vec<String>,
    /// Maximum number, in the dataset's order; tried grasps are spread evenly over the selection.
    pub limit: Option<u64>,
    /// Whether to write one byte per cell, in formats that support it.
    pub unpacked: bool,
    /// Numbers for [`ExportForm::keys`], by name; the others have their defaults.
    pub numbers: BTreeMap<String, f64>,
}

impl ExportSelection {
    /// Value of a key of a form.
    pub(super) fn number(&self, key: &ExportKey) -> f64 {
        self.numbers.get(key.name).copied().unwrap_or(key.default)
    }
}

/// Content written by a format.
pub(super) struct Written {
    /// Number of counted items.
    pub count: u64,
    /// Facts for `export.json` in addition to root, format and layout.
    pub facts: Map<String, Value>,
}

impl Written {
    /// Creates the content of a written selection, with its facts.
    pub fn selection(count: u64, counted: &str, selection: &ExportSelection) -> Self {
        let facts = json!({
            counted: count,
            "split": selection.samples.split,
            "training_subset": selection.samples.subset,
            "objects": selection.objects,
        });
        Self::new(count, facts)
    }

    /// Content with facts that are a JSON object.
    pub fn new(count: u64, facts: Value) -> Self {
        let Value::Object(facts) = facts else { unreachable!("facts are written as an object") };
        Self { count, facts }
    }
}
