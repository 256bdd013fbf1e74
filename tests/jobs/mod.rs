//! Job files, and sets of several.

mod sets;
mod specs;
