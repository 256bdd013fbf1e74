//! Quality of a grasp in the space of wrenches: which forces and torques its contacts resist, and how well.
//!
//! Every contact pushes with a unit normal force and the friction force that it allows: the edges of a
//! [`FrictionCone`]. Their wrenches make a [`WrenchSet`]; the hull of all of them (the L1 space of Ferrari and Canny
//! 1992, "Planning optimal grasps") contains the wrenches that the grasp resists with normal forces that sum to 1.
//! *Epsilon* is the radius of the largest ball about the origin inside it: 0 without force closure. Its volume is the
//! other measure.
//!
//! Epsilon comes from an expanding polytope: a linear programme finds a simplex of wrenches around the origin, and the facet
//! nearest to the origin is pushed out to its support point until it lies on the hull. Nothing but its surroundings is built,
//! so that twenty edges per contact cost not twice what eight do. Of class `exact`.
//!
//! Wrenches are moved by up to [`JOGGLE`], each by a fixed amount, because the edges of one contact are in a plane and
//! a facet through them has no unique triangulation. Hulls thinner than [`FLAT`] count as flat.

mod contact;
mod enclose;
mod epsilon;
mod polytope;
mod set;
mod volume;

#[cfg(test)]
mod tests;

pub use contact::{Contact, FrictionCone, MassFrame, SOFT_LATITUDE_COSINE};
pub use epsilon::{Epsilon, EpsilonEnd, EpsilonLimits, EpsilonSolver, MAX_FACETS};
pub use set::{FLAT, JOGGLE, WrenchSet};
pub use volume::{HullSolver, HullVolume};
