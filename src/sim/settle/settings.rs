//! Bodies, their container and the rules by which they settle.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3, Rotation3};

use kernel::{
    contact::ContactBody,
    geom::{Aabb, MassProperties},
};

/// Thickness of the box that stands for the plane, and half its sides [m].
const GROUND: [f64; 2] = [2.0, 1e3];

/// Container of a scene, fixed in the world.
#[derive(Clone)]
pub enum Container {
    /// The plane z = 0. A body whose centre of mass ends outside of a rectangle around the origin is gone.
    Plane {
        /// Sides of the rectangle [m].
        size: [f64; 2],
    },
    /// An open box. A body whose centre of mass ends outside of its walls is gone.
    Bin {
        /// Mesh of the box, in the world.
        body: Arc<ContactBody>,
        /// Room inside [m]; the origin is the middle of the floor, z up.
        inner: [f64; 3],
    },
}

impl Container {
    /// Sides of the floor that bodies are put on [m].
    pub fn floor(&self) -> [f64; 2] {
        match self {
            Self::Plane { size } => *size,
            Self::Bin { inner: [x, y, _], .. } => [*x, *y],
        }
    }

    /// Box around the container, in the world [m]; a plane is the top of a wide one.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Plane { .. } => {
                let [thickness, half] = GROUND;
                Aabb { min: Point3::new(-half, -half, -thickness), max: Point3::new(half, half, 0.0) }
            }
            Self::Bin { body, .. } => *body.surface().bounds(),
        }
    }

    /// Height of the rim above the floor [m].
    pub fn rim(&self) -> f64 {
        match self {
            Self::Plane { .. } => 0.0,
            Self::Bin { inner: [_, _, z], .. } => *z,
        }
    }
}

/// A body of a scene.
#[derive(Clone)]
pub struct SceneBody {
    /// The true mesh.
    pub body: Arc<ContactBody>,
    /// Mass properties of the solid.
    pub solid: MassProperties,
    /// [kg].
    pub mass: f64,
    /// Coefficient of sliding friction; of two bodies the larger counts, the container has none of its own.
    pub friction: f64,
}

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
