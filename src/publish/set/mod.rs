//! Publication of sets: `report.html` next to the datasets, with one picture of their joint content.

mod cover;
mod figure;
mod page;
mod report;
mod surveyed;
mod templates;

pub use cover::Cover;
pub use report::{SetReportSummary, report_set};

#[cfg(test)]
pub(super) use self::{
    page::SetPage,
    templates::{PAGE_TEMPLATE, TEMPLATES},
};
