//! Walls around the middle of a plane, between which bodies are dropped, and which are lifted away from them.
//!
//! In a model, walls are one more body, far heavier than the others, whose height and speed are prescribed before each
//! step, with the force that carries their weight. So they push and rub like any other moving body, and nothing moves
//! them.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3};

use crate::{objects::scene_body::SimBody, physics::GRAVITY};
use kernel::{contact::ContactBody, geom::MassProperties};

/// Mass of the walls: a body of 1 kg that is thrown against them at 1 m/s moves them by 1 mm/s within its step [kg].
const MASS: f64 = 1000.0;

/// Room below the walls in place: less than the thickness of any body [m].
const ABOVE_PLANE: f64 = 5e-4;

/// Height to which walls are lifted if a body moves along with them, as a multiple of their own.
const LIFTED_AT_MOST: f64 = 2.0;

/// Four walls around the middle of a plane.
#[derive(Clone)]
pub struct Walls {
    pub(super) body: SimBody,
    /// Room inside [m].
    pub(super) inner: [f64; 3],
    /// [m/s].
    pub(super) lift_speed: f64,
}

/// Walls of a scene that is being settled.
#[derive(Clone, Copy)]
pub(super) struct StandingWalls {
    /// Index among the bodies of the model.
    pub(super) index: usize,
    /// Room inside [m].
    pub(super) inner: [f64; 3],
    /// Height of their foot over the plane [m].
    pub(super) foot: f64,
    /// Speed at which they rise [m/s].
    pub(super) speed: f64,
}

impl Walls {
    /// Walls of a mesh around a room, whose middle of the foot is the mesh's origin, z up [m]; they are lifted at a speed [m/s].
    pub fn new(body: Arc<ContactBody>, inner: [f64; 3], lift_speed: f64) -> Self {
        // Nothing rotates them, so that moments about as large as those of a block do.
        let [x, y, z] = inner.map(|side| side * side / 12.0);
        let inertia = Matrix3::from_diagonal(&[y + z, x + z, x + y].into());
        let solid =
            MassProperties { volume: inner.iter().product(), centre: Point3::new(0.0, 0.0, inner[2] / 2.0), inertia };
        // The larger of two frictions applies: walls have none.
        Self { body: SimBody { body, solid, mass: MASS, friction: 0.0 }, inner, lift_speed }
    }

    /// The walls as the body of this index, on the plane.
    pub(super) fn standing(&self, index: usize) -> StandingWalls {
        StandingWalls { index, inner: self.inner, foot: ABOVE_PLANE, speed: 0.0 }
    }
}

impl StandingWalls {
    /// Force that carries their weight [N].
    pub(super) const LIFT: f64 = MASS * GRAVITY;

    /// Whether they are clear of bodies whose highest point is this high [m], or were lifted to their limit.
    pub(super) fn are_away(&self, top: f64) -> bool {
        self.foot > top || self.foot > LIFTED_AT_MOST * self.inner[2]
    }
}
