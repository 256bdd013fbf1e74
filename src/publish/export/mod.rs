//! Datasets in other formats. A format is one row of [`FORMATS`] and one file of this folder, and is not mentioned elsewhere.
//!
//! An export is a view of a dataset, not a second source: its `export.json` contains the root digest of the dataset, and
//! `samples.csv` lists the sample of each row or file of a completion dataset.

mod acronym;
mod binvox;
mod bop;
mod coco;
mod error;
mod form;
mod graspit;
mod half;
mod image_file;
mod mujoco;
mod names;
mod npy;
mod npz;
mod object_mesh;
mod objects;
mod pair;
mod pairs;
mod pcd;
mod rle;
mod row_tables;
mod selected;
mod suctionnet;
mod table;
mod target;
mod vgn;
mod webdataset;

use std::path::{Path, PathBuf};

use serde_json::json;

pub use error::ExportError;
pub use form::{ExportForm, ExportFormat, ExportKey, ExportSelection};

use self::{form::Written, target::Target};
use format::{Noun, dataset::DatasetReader};
use kernel::files::Folder;

/// Every format, in the order of the help.
pub static FORMATS: [&ExportFormat; 12] = [
    &npy::FORMAT,
    &row_tables::FORMAT,
    &webdataset::FORMAT,
    &binvox::FORMAT,
    &pcd::FORMAT,
    &graspit::FORMAT,
    &mujoco::FORMAT,
    &acronym::FORMAT,
    &bop::FORMAT,
    &coco::FORMAT,
    &vgn::FORMAT,
    &suctionnet::FORMAT,
];

impl ExportFormat {
    /// The format of a name; `None` for any other text.
    pub fn from_name(name: &str) -> Option<&'static Self> {
        FORMATS.into_iter().find(|format| format.name == name)
    }
}

/// Result of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportSummary {
    /// The folder.
    pub folder: PathBuf,
    /// Number of counted items.
    pub count: u64,
    /// Noun of the counted items.
    pub counted: Noun,
    /// Files.
    pub files: u64,
}

/// Writes samples of the finished dataset in `folder` to `out`, which must not exist yet or be empty.
///
/// Samples are streamed: one chunk of a shard is in memory at a time. The folder appears when it is complete, and the same
/// dataset and selection give the same bytes.
///
/// # Errors
/// When the dataset is not finished, damaged, or of a product without this form; `out` holds something; an object is unknown,
/// nothing is selected, or a file cannot be written.
pub fn export(
    folder: &Folder,
    format: &'static ExportFormat,
    out: &Path,
    selection: &ExportSelection,
) -> Result<ExportSummary, ExportError> {
    let reader = DatasetReader::open(folder)?;
    let product = reader.manifest().product;
    let form = format.form(product).ok_or_else(|| {
        let others = FORMATS.iter().filter(|format| format.form(product).is_some()).map(|format| format.name);
        let of = format.forms.iter().map(|form| form.product.name).collect();
        ExportError::OtherProduct { product, format: format.name, of, forms: others.collect() }
    })?;
    if selection.unpacked && !format.has_unpacked {
        return Err(ExportError::AlwaysPacked { format: format.name });
    }
    for (name, value) in &selection.numbers {
        if !form.keys.iter().any(|key| key.name == name) {
            let known = form.keys.iter().map(|key| key.name).collect();
            return Err(ExportError::UnknownKey { format: format.name, product, key: name.clone(), known });
        }
        if !(*value > 0.0 && value.is_finite()) {
            return Err(ExportError::BadNumber { key: name.clone(), value: *value });
        }
    }
    let mut target = Target::create(out)?;
    let Written { count, mut facts } = (form.write)(&reader, selection, &mut target)?;
    facts.insert("root".to_owned(), json!(reader.manifest().root));
    facts.insert("format".to_owned(), format.name.into());
    facts.insert("layout".to_owned(), (form.layout)(selection.unpacked).into());
    target.write_json("export.json", &facts.into())?;
    Ok(ExportSummary { folder: out.to_owned(), count, counted: form.counted, files: target.publish()? })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_is_found_by_its_name_and_no_two_share_one() {
        for format in FORMATS {
            assert!(std::ptr::eq(ExportFormat::from_name(format.name).expect("a name of the table"), format));
            assert!(format.summary.ends_with('.') && !format.forms.is_empty());
            for form in format.forms {
                assert!(std::ptr::eq(format.form(form.product).expect("a form"), form), "{}", format.name);
                assert!(!(form.layout)(false).is_empty() && !(form.layout)(true).is_empty());
            }
        }
        assert!(ExportFormat::from_name("obj").is_none());
    }
}
