//! What people look at: pictures of samples, charts, `report.html`, and the same facts as text or JSON.
//!
//! Everything here is drawn in plain Rust without a display, and two reports of one dataset have the same bytes.
//! Releases (checksums, cards, provenance) join this room later.

pub mod picture;
