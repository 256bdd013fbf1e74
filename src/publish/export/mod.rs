//! Datasets in other formats. A format is one row of [`FORMATS`] and one file of this folder; nothing else names it.
//!
//! An export is a view of a dataset, not a second truth: `export.json` in it names the root digest that it was made
//! from, and `samples.csv` says which sample each row or file of a completion dataset is.

mod binvox;
mod error;
mod graspit;
mod mujoco;
mod names;
mod npy;
mod pair_table;
mod pairs;
mod pcd;
mod table;
mod target;
mod webdataset;

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use serde_json::{Map, Value, json};

pub use error::ExportError;

use self::target::Target;
use format::{
    Noun, Product,
    dataset::{AssetRow, DatasetReader, Selection},
};
use kernel::ids::ObjectId;

/// Every format, in the order in which help lists them.
pub static FORMATS: [&ExportFormat; 7] = [
    &npy::FORMAT,
    &pair_table::FORMAT,
    &webdataset::FORMAT,
    &binvox::FORMAT,
    &pcd::FORMAT,
    &graspit::FORMAT,
    &mujoco::FORMAT,
];

/// A format that datasets can be exported in: one row of the table of formats.
pub struct ExportFormat {
    /// Name on the command line and in `export.json`.
    pub name: &'static str,
    /// Content, one sentence.
    pub summary: &'static str,
    /// Product of the datasets that have this form.
    pub product: Product,
    /// Noun of one thing that is counted and of several.
    pub counted: Noun,
    /// Whether the format can hold one byte per cell instead of packed bits ([`ExportSelection::unpacked`]).
    pub has_unpacked: bool,
    /// Layout of the files in words, for `export.json`; the argument is [`ExportSelection::unpacked`].
    layout: fn(bool) -> &'static str,
    /// Writes the files.
    write: fn(&DatasetReader, &ExportSelection, &mut Target) -> Result<Written, ExportError>,
}

impl ExportFormat {
    /// The format of a name; `None` for any other text.
    pub fn from_name(name: &str) -> Option<&'static Self> {
        FORMATS.into_iter().find(|format| format.name == name)
    }
}

/// Selection of samples, and how they are written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExportSelection {
    /// Samples of a split or of a nested training subset.
    pub samples: Selection,
    /// Names of the objects to export; every object when empty.
    pub objects: Vec<String>,
    /// Maximal count, in the dataset's order; grasps that were tried are taken evenly over the selection.
    pub limit: Option<u64>,
    /// One byte per cell, in the formats that offer it.
    pub unpacked: bool,
}

/// Result of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportSummary {
    /// The folder.
    pub folder: PathBuf,
    /// Count of what the format counts ([`ExportFormat::counted`]).
    pub count: u64,
    /// Files.
    pub files: u64,
}

/// Content that a format has written.
struct Written {
    /// Count of what the format counts.
    count: u64,
    /// Facts for `export.json` beside root, format and layout.
    facts: Map<String, Value>,
}

impl Written {
    /// A selection of samples that was written, with its facts.
    fn selection(count: u64, counted: &str, selection: &ExportSelection) -> Self {
        let facts = json!({
            counted: count,
            "split": selection.samples.split,
            "training_subset": selection.samples.subset,
            "objects": selection.objects,
        });
        Self::new(count, facts)
    }

    /// Content with facts that are a JSON object.
    fn new(count: u64, facts: Value) -> Self {
        let Value::Object(facts) = facts else { unreachable!("facts are written as an object") };
        Self { count, facts }
    }
}

/// Writes samples of the finished dataset in `folder` to `out`, which must not exist yet or be empty.
///
/// Samples stream through: one chunk of a shard is in memory at a time. The folder appears when it is complete, and
/// the same dataset and selection give the same bytes.
///
/// # Errors
/// When the dataset is not finished, damaged, or of a product without this form; `out` holds something; an object is unknown,
/// nothing is selected, or a file cannot be written.
pub fn export(
    folder: &Path,
    format: &'static ExportFormat,
    out: &Path,
    selection: &ExportSelection,
) -> Result<ExportSummary, ExportError> {
    let reader = DatasetReader::open(folder)?;
    let product = reader.manifest().product;
    if product != format.product {
        return Err(ExportError::OtherProduct { product, format: format.name, of: format.product });
    }
    if selection.unpacked && !format.has_unpacked {
        return Err(ExportError::AlwaysPacked { format: format.name });
    }
    let mut target = Target::create(out)?;
    let Written { count, mut facts } = (format.write)(&reader, selection, &mut target)?;
    facts.insert("root".to_owned(), json!(reader.manifest().root));
    facts.insert("format".to_owned(), format.name.into());
    facts.insert("layout".to_owned(), (format.layout)(selection.unpacked).into());
    let text = serde_json::to_string_pretty(&facts).expect("plain data with text keys") + "\n";
    target.write("export.json", text.as_bytes())?;
    Ok(ExportSummary { folder: out.to_owned(), count, files: target.publish()? })
}

/// The objects of these names; every name must be known.
fn wanted_objects(assets: &[AssetRow], names: &[String]) -> Result<BTreeSet<ObjectId>, ExportError> {
    names
        .iter()
        .map(|name| {
            let row = assets.iter().find(|row| row.name == *name);
            row.map(|row| row.object).ok_or_else(|| ExportError::UnknownObject {
                name: name.clone(),
                known: assets.iter().map(|row| row.name.clone()).collect(),
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_is_found_by_its_name_and_no_two_share_one() {
        for format in FORMATS {
            assert!(std::ptr::eq(ExportFormat::from_name(format.name).expect("a name of the table"), format));
            assert!(!(format.layout)(false).is_empty() && format.summary.ends_with('.'));
        }
        assert!(ExportFormat::from_name("obj").is_none());
    }
}
