//! Arrangements of others: poses of the job's objects out of files. Nothing is stepped to rest; what the checks of settled scenes
//! measure is stored and decides nothing.
//!
//! ```text
//! folders of BOP, a table of poses, or the job itself --read--> Import --place--> poses on the table or in the container
//! ```

mod arrangement;
mod bop;
mod found;
mod place;
mod read;
pub mod spec;
mod table;

pub use arrangement::{Import, ImportedBody, ImportedScene, SourceFrame};
pub(super) use place::place;
pub(super) use read::read;
