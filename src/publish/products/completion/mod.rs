//! Completion as people meet it: facts, pictures of samples, page.

mod card;
mod charts;
mod gallery;
mod inspection;
mod page;
mod row;
mod survey;
mod text;
mod touch;

pub use inspection::{CompletionInspection, ObjectFacts, Setup, SplitFacts, inspect_completion};
pub use row::PAGES;
pub use touch::{HandFacts, TouchFacts, TouchKind};

#[cfg(test)]
pub(super) use self::{
    card::CardView,
    page::{CompletionPage, TEMPLATE},
    survey::CompletionSurvey,
};
