//! Publication of suction: facts, page, pictures.

mod inspection;
mod page;
mod painting;
mod row;
mod templates;

pub use inspection::{CupObject, SuctionInspection, inspect_suction};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{
    inspection::SuctionSurvey,
    page::{CardView, SuctionPage},
    templates::PAGE_TEMPLATE,
};
