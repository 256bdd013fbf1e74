//! Publication of scenes: facts, page, pictures from above.

mod headline;
mod inspection;
mod page;
mod painting;
mod row;
mod templates;

pub use inspection::{ImportedChecks, SceneObject, ScenesInspection, inspect_scenes};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{
    inspection::SceneSurvey,
    page::{CardView, ScenesPage},
    templates::PAGE_TEMPLATE,
};
