//! The rules by which bodies settle.

use nalgebra::{IsometryMatrix3, Rotation3};

/// Start of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// Released one after another, above the bodies already there.
    Dropped {
        /// Rotation of the object.
        rotation: Rotation3<f64>,
        /// Position along x and y, from 0 to 1 over the room that the floor leaves it.
        shares: [f64; 2],
    },
    /// Released at once, from a pose.
    Placed {
        /// The pose.
        world_from_object: IsometryMatrix3<f64>,
    },
}

/// Rules of settling. SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettleSettings {
    /// Length of a step [s].
    pub timestep: f64,
    /// Rolling friction [m].
    pub rolling: f64,
    /// Time from one body's release to the next one's [s].
    pub release_every: f64,
    /// Height of a body's lowest point above the bodies already there at its release [m].
    pub release_height: f64,
    /// Bodies rest when none is faster than this [m/s]; angular speeds count at half the diagonal of the body.
    pub rest_speed: f64,
    /// Time for which bodies have to rest [s].
    pub rest_time: f64,
    /// Limit on the time from the last release until the bodies rest [s].
    pub cap: f64,
    /// Time of the check from the stored poses [s].
    pub recheck: f64,
    /// Bodies that end up in one another settle once more, in steps that are shorter by this factor; 1: they do not.
    pub finer: u32,
    /// Number of times at most that dropped bodies that leave the container, where too few would stay, are dropped
    /// again, each time half as far from the middle.
    pub put_back: u32,
}
