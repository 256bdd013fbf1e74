//! The rules by which bodies settle.

use nalgebra::{IsometryMatrix3, Rotation3};

/// Start of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Placement {
    /// Let go in turn, above what lies there already.
    Dropped {
        /// Rotation of the object.
        rotation: Rotation3<f64>,
        /// Position along x and y, from 0 to 1 over the room that the floor leaves it.
        shares: [f64; 2],
    },
    /// Let go at once, from a pose.
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
    /// Height of a body's lowest point above what lies there when it is let go [m].
    pub release_height: f64,
    /// Bodies rest when none is faster than this [m/s], angular speeds taken at half the diagonal of the body.
    pub rest_speed: f64,
    /// Time for which bodies have to rest [s].
    pub rest_time: f64,
    /// Bodies that do not rest so long after the last release [s] never do.
    pub cap: f64,
    /// Time of the check from the stored poses [s].
    pub recheck: f64,
    /// Bodies that end up in one another settle once more, in steps that are shorter by this factor; 1: they do not.
    pub finer: u32,
    /// Dropped bodies that leave the container, where too few would stay, are dropped again so many times at most, each time
    /// half as far from the middle.
    pub put_back: u32,
}
