//! Where solids touch a true mesh: not its convex hull, and not a decomposition.
//!
//! A [`ContactSurface`] is a mesh prepared for contacts with solids. A [`DistanceGrid`] of signed distances selects the
//! parts of a solid that may be near the surface; exact closest points decide those. A solid is represented as a core
//! with a thickness (a capsule as its axis, a box as a slightly smaller one: its edges are rounded), so that the core
//! of a solid that presses in stays outside and the direction from the surface to it is well defined.
//!
//! A [`ContactBody`] is a mesh prepared for contacts with other meshes; a [`PairTracker`] follows the contacts of two
//! of them.

mod bodies;
mod crossing;
mod distance_grid;
mod meets;
mod nearest;
mod overlap;
mod piece;
mod points;
mod probe;
mod surface;
mod tracker;
mod trail;

pub use bodies::{BodyScratch, ContactBody, MAX_CONTACTS, PairTracker, plane_contacts};
pub use crossing::crosses;
pub use distance_grid::DistanceGrid;
pub use overlap::OverlapProbe;
pub use points::{POINT_CELL, Sampled};
pub use probe::{EDGE_RADIUS, Probe};
pub use surface::{ContactScratch, ContactSurface, SurfaceContact};
pub use tracker::ContactTracker;
