//! Reports for people, and releases: datasets that are publications.

mod pages;
mod pictures;
mod release;
mod report;
mod wheel;
