//! Publication of reachability maps: facts, cross-sections, page.

mod census;
mod contour;
mod inspection;
mod labels;
mod page;
mod row;
mod section;
mod tables;
mod templates;

pub use inspection::{
    AxisFacts, CoveringFacts, FieldFacts, ReachabilityFacts, ReachabilityRobotFacts, inspect_reachability,
};
pub use row::PAGES;

#[cfg(test)]
pub(crate) use self::{page::ReachabilityPage, templates::PAGE_TEMPLATE};
