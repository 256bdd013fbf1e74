//! Publication of amodal pairs: facts, page, pictures.

mod headline;
mod inspection;
mod page;
mod painting;
mod row;
mod templates;

pub use inspection::{AmodalInspection, inspect_amodal};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{
    inspection::AmodalSurvey,
    page::{AmodalPage, CardView},
    templates::PAGE_TEMPLATE,
};
