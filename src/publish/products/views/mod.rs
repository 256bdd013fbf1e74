//! Publication of views: facts, page, pictures.

mod headline;
mod inspection;
mod nearness;
mod page;
mod painting;
mod row;
mod templates;

pub use inspection::{ViewsInspection, inspect_views};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{
    inspection::ViewSurvey,
    page::{CardView, ViewsPage},
    templates::PAGE_TEMPLATE,
};
