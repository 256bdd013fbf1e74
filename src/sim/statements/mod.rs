//! The table of statements of descriptions: each is honoured, ignored with a reason, or refused with a remedy.
//!
//! The rows of `mjcf.rs` and `urdf.rs` are the only declaration. The check of a description follows them, the page `docs/mjcf.md` is
//! [printed](reference()) from them, and tests try every row and compare them with the schema of the linked MuJoCo.

mod check;
mod mjcf;
mod page;
mod row;
mod table;
#[cfg(test)]
mod tests;
mod urdf;

pub use page::reference;
pub use row::{Decision, Row, Usage};
pub use table::{row, rows};

pub(super) use check::check;
pub(super) use table::condition_of;
