//! Imported arrangements: poses of the job's objects from files. Nothing is stepped to rest; the measures that the
//! gates of settled scenes use are stored and decide nothing.
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
