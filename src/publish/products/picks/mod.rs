//! Publication of picks: facts, page, pictures.

mod headline;
mod inspection;
mod page;
mod painting;
mod row;
mod templates;

pub use inspection::{PickedObject, PicksInspection, SampledPicks, inspect_picks};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{
    inspection::PickSurvey,
    page::{CardView, PicksPage},
    templates::PAGE_TEMPLATE,
};
