//! Publication of volumes: facts, page, pictures.

mod headline;
mod inspection;
mod page;
mod painting;
mod row;
mod templates;

pub use inspection::{VolumesInspection, inspect_volumes};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{
    inspection::VolumeSurvey,
    page::{CardView, VolumesPage},
    templates::PAGE_TEMPLATE,
};
