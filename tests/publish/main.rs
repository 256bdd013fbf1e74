//! Reports for people, and releases: datasets that are publications.

mod pictures;
mod release;
mod report;
#[path = "../support/mod.rs"]
mod support;
