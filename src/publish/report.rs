//! `report.html`: one file that shows a dataset, with no link to anything outside it.

use std::path::{Path, PathBuf};

use super::{
    notes::write_atomically,
    product::{Page, Survey},
    products::pages_of,
};
use format::dataset::{DatasetError, DatasetReader, layout::REPORT};

/// A report that was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReportSummary {
    /// The page.
    pub path: PathBuf,
    /// Size [bytes].
    pub bytes: u64,
    /// Things with pictures: samples, objects or cross-sections, by product.
    pub shown: usize,
}

/// Writes the page of the finished dataset in `folder` to `out` ([`REPORT`] in the folder when `None`).
///
/// Reads what the inspection reads, and decodes the samples that it shows. The page depends on the dataset and on
/// `notes.json`, not on clock, machine or path (but for a job without a name).
///
/// # Errors
/// When the dataset is not finished, a file is missing or damaged, or the page can't be written.
pub fn report(folder: &Path, out: Option<&Path>) -> Result<ReportSummary, DatasetError> {
    let reader = DatasetReader::open(folder)?;
    let survey = (pages_of(reader.manifest().product).survey)(&reader)?;
    let path = out.map_or_else(|| folder.join(REPORT), Path::to_owned);
    write_page(&reader, survey.as_ref(), path)
}

/// Writes the page of a dataset that was surveyed.
///
/// # Errors
/// When a file of the dataset is missing or damaged, or the page can't be written.
pub(super) fn write_page(
    reader: &DatasetReader,
    survey: &dyn Survey,
    path: PathBuf,
) -> Result<ReportSummary, DatasetError> {
    let Page { values, shown } = survey.page(reader)?;
    let html = pages_of(reader.manifest().product).templates.render_page(&values);
    write_atomically(&path, html.as_bytes())?;
    Ok(ReportSummary { path, bytes: html.len() as u64, shown })
}
