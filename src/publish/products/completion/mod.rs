//! Publication of completion: facts, pictures of samples, page.

mod card;
mod charts;
mod gallery;
mod inspection;
mod page;
mod row;
mod survey;
mod templates;
mod text;

pub use inspection::{CompletionInspection, CompletionObjectFacts, Setup, SplitFacts};
pub use row::PAGES;
pub use survey::inspect_completion;

#[cfg(test)]
pub(crate) use self::{card::CardView, page::CompletionPage, survey::CompletionSurvey, templates::PAGE_TEMPLATE};
