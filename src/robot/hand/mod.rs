//! Hands as data: which joints are driven, what follows them, where a hand touches, and how it closes.
//!
//! A hand is a tree of joints. A few of them are driven by motors; the others follow, each at a ratio of its own. A hand's
//! posture is one value for each driven joint. Some fingers have a clutch: when the driven joint is stopped, it stays, and
//! the motor moves a follower alone ([`Driven`]). Nothing here knows a simulator: `sim` reads a [`Skeleton`] out of MJCF or URDF, and
//! a table beside it says the rest (`docs/hands.md`).

mod description;
mod drive;
mod table;

pub use description::{ContactPoint, Coupling, Eigengrasps, Hand, HandParts, Mount, Skeleton};
pub use drive::{Breakaway, Driven, Follower, Motor};
pub use table::{HandTable, HandTableError};
