//! The table of products: one row each. A new product is a new row in this table, and a folder next to this file.

pub mod amodal;
mod checks;
pub mod completion;
pub mod grasps;
pub mod heatmaps;
pub mod patches;
pub mod picks;
mod product;
pub mod reachability;
mod record;
mod record_check;
pub mod scenes;
pub mod suction;
pub mod views;
pub mod volumes;

pub use checks::{CHECKS, checks_of};
pub use product::{Channel, Product};
pub use record::Record;
pub use record_check::{BrokenRule, CheckSample, CheckedRecord, ProductChecks, check_record};

use super::ProductFormat;

/// Every product, in the order of documents and help.
pub static PRODUCTS: [&ProductFormat; 11] = [
    &completion::FORMAT,
    &reachability::FORMAT,
    &grasps::FORMAT,
    &patches::FORMAT,
    &scenes::FORMAT,
    &views::FORMAT,
    &amodal::FORMAT,
    &volumes::FORMAT,
    &picks::FORMAT,
    &heatmaps::FORMAT,
    &suction::FORMAT,
];
