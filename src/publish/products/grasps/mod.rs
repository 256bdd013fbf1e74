//! Publication of grasps: facts, pictures of grasps, trials and their calibration, page.

mod calibration;
mod gallery;
mod inspection;
mod page;
mod replayed;
mod row;
mod templates;
mod trials;
mod ways;

pub use calibration::{Calibration, ReliabilityBin};
pub use inspection::{GraspObjectFacts, GraspsInspection, TableFacts, inspect_grasps};
pub use row::PAGES;
pub use trials::{TrialsInspection, VariantsInspection};
pub use ways::WayFacts;

#[cfg(test)]
pub(crate) use self::{
    gallery::CardView, inspection::GraspSurvey, page::GraspsPage, replayed::ReplayView, templates::PAGE_TEMPLATE,
};
