//! Publication of heatmaps of scenes: facts, page, pictures.

mod headline;
mod inspection;
mod page;
mod painting;
mod row;
mod templates;

pub use inspection::{HeatmapsInspection, inspect_heatmaps};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{
    inspection::HeatmapSurvey,
    page::{CardView, HeatmapsPage},
    templates::PAGE_TEMPLATE,
};
