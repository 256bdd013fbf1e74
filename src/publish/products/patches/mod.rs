//! Publication of patches: facts, sheets of patches, page.

mod inspection;
mod page;
mod row;
mod sheets;
mod templates;

pub use inspection::{ChosenType, PatchObjectFacts, PatchesInspection, inspect_patches};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{inspection::PatchSurvey, page::PatchesPage, sheets::CardView, templates::PAGE_TEMPLATE};
