//! `report.html` of a set, and those of its datasets.

use std::path::Path;

use super::{Cover, figure, page::SetPage, surveyed::SurveyedDataset, templates::TEMPLATES};
use crate::{
    report::{ReportSummary, write_html, write_page},
    templates::page_values,
};
use format::dataset::{DatasetError, SetTable};
use kernel::files::Folder;

/// The written reports of a set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SetReportSummary {
    /// The page of the set; its items are the panels of the first picture.
    pub set: ReportSummary,
    /// The pages of the datasets, in their order; empty if the page of the set was written elsewhere.
    pub datasets: Vec<ReportSummary>,
}

/// Writes the page of the finished set in `folder`, and the page of each dataset in the dataset's own folder; the former links
/// only to the latter. With `out`, only the page of the set is written, to that path and without links. `cover` is the page's first
/// picture, before those of the data.
///
/// The page depends only on the data and the cover, not on time, machine or path.
///
/// # Errors
/// When a dataset is not finished, a file is missing or damaged, or a page can't be written.
pub fn report_set(
    folder: &Folder,
    table: &SetTable,
    out: Option<&Path>,
    cover: Option<&Cover>,
) -> Result<SetReportSummary, DatasetError> {
    let content = table.content(folder)?;
    let surveyed = SurveyedDataset::all(folder, table)?;
    let mut datasets = Vec::new();
    if out.is_none() {
        for SurveyedDataset { reader, survey, .. } in &surveyed {
            datasets.push(write_page(reader, survey.as_ref(), None)?);
        }
    }
    let panels = figure::draw(&surveyed)?;
    let page = SetPage::of(table, &content, &surveyed, (cover, &panels), out.is_none())?;
    let html = TEMPLATES.render_page(&page_values(&page));
    let path = write_html(folder, out, &html)?;
    let set = ReportSummary { path, bytes: html.len() as u64, shown: panels.len() };
    Ok(SetReportSummary { set, datasets })
}
