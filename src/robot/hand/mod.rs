//! Hands as data: which joints are driven, what follows them, where a hand touches, and how it closes.
//!
//! A hand is a tree of joints. Motors drive a few of them; the others follow, each at its own ratio. A hand's posture
//! is one value for each driven joint. Some fingers have a clutch: when the driven joint is stopped, it stays, and the
//! motor moves only a follower ([`Driven`]). This module is independent of a simulator: `sim` reads a [`Skeleton`] from
//! MJCF or URDF, and a table in the same folder has the other properties (`docs/hands.md`).

mod description;
mod drive;
mod table;

pub use description::{ContactPoint, Coupling, Eigengrasps, Hand, HandParts, Mount, Skeleton};
pub use drive::{Breakaway, Driven, Follower, Motor};
pub use table::{HandTable, HandTableError};
