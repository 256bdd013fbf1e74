//! Job files, and sets of several.

mod sets;
mod specs;
#[path = "../support/mod.rs"]
mod support;
