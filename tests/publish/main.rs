//! Reports for people, and releases: datasets that are publications.

mod release;
mod report;
#[path = "../support/mod.rs"]
mod support;
