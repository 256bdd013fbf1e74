//! `report.html`: one self-contained file that shows a dataset.

use std::path::{Path, PathBuf};

use super::{
    product::{Page, Survey},
    products::pages_of,
};
use format::dataset::{DatasetError, DatasetReader, layout::REPORT};
use kernel::files::{self, Folder, Temporary};

/// A written report.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportSummary {
    /// The page.
    pub path: PathBuf,
    /// Size [bytes].
    pub bytes: u64,
    /// Number of items with pictures: samples, objects or cross-sections, by product.
    pub shown: usize,
}

/// Writes the page of the finished dataset in `folder` to `out` ([`REPORT`] in the folder when `None`).
///
/// Reads the same files as the inspection, and decodes the samples on the page. The page depends on the dataset and on
/// `notes.json`, not on time, machine or path (except for a job without a name).
///
/// # Errors
/// When the dataset is not finished, a file is missing or damaged, or the page can't be written.
pub fn report(folder: &Folder, out: Option<&Path>) -> Result<ReportSummary, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    let survey = (pages_of(reader.manifest().product).survey)(&reader)?;
    write_page(&reader, survey.as_ref(), out)
}

/// Writes the page of a surveyed dataset to `out` or into its folder.
///
/// # Errors
/// When a file of the dataset is missing or damaged, or the page can't be written.
pub(super) fn write_page(
    reader: &DatasetReader,
    survey: &dyn Survey,
    out: Option<&Path>,
) -> Result<ReportSummary, DatasetError> {
    let Page { values, shown } = survey.page(reader)?;
    let html = pages_of(reader.manifest().product).templates.render_page(&values);
    let path = write_html(reader.folder(), out, &html)?;
    Ok(ReportSummary { path, bytes: html.len() as u64, shown })
}

/// Writes a page to `out`, or as [`REPORT`] into a folder. The target of `out` is replaced; in the folder, a link is replaced
/// itself.
///
/// # Errors
/// When the page can't be written.
pub(super) fn write_html(folder: &Folder, out: Option<&Path>, html: &str) -> Result<PathBuf, DatasetError> {
    let path = out.map_or_else(|| folder.path_of(REPORT), Path::to_owned);
    let written = match out {
        Some(out) => files::replace(out, html.as_bytes()),
        None => Temporary::write(folder, REPORT, html.as_bytes()),
    };
    written.map_err(DatasetError::io("writing", &path))?;
    Ok(path)
}
