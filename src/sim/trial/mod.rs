//! Physics labels: a grasp closed on a free object, which floats or rests on a table, lifted and shaken.
//!
//! The hand's base is the world, so that a move of the hand is a field of acceleration: an object at rest in a hand
//! that accelerates by `a` feels `g - a`. For translations this is exact, for the object and for the links of the hand
//! alike, and each worker has its own model whose gravity it may set. A constant speed is not felt, so that the shake
//! may begin at its full speed: its acceleration begins and ends at 0. The table recedes as the hand lifts. To MuJoCo
//! it is fixed in every step: an object that follows it down does so in small falls.

mod conditions;
mod ladder;
mod margins;
mod outcome;
mod phase;
mod reason;
mod replay;
mod series;
pub(crate) mod usable;
mod variant;
mod worker;

use std::sync::Arc;

pub use conditions::{
    Gravity, TableSupport, TrialConditions, TrialProtocol, TrialSpread, WhileClosing, mass_of_volume,
};
pub use ladder::{Climb, Rung, TrialLevel, climb, conditions_at};
pub use margins::{FOLLOWED, Limit, Loss, Margins, Peak};
pub use outcome::{Grip, Outcome, Slip, Start, Verdict};
pub(super) use outcome::{deepest, pressing_links};
pub use phase::Phase;
pub use reason::{TrialFailure, failure_reason};
pub use replay::{PlainHand, plain_hand};
pub use series::{Series, SeriesSample};
pub use variant::Variant;
pub use worker::TrialWorker;
pub(super) use worker::{PUSHED_AWAY, deepest_start, steps_in};

use crate::{
    error::HandError,
    hand::{model::HandModel, sim::HandSim},
    objects::native_mesh::NativeContacts,
    physics::Numerics,
};
use kernel::{
    contact::ContactSurface,
    geom::{MassProperties, TriMesh},
};
use robot::hand::Hand;

/// A hand and a free object, compiled once per object. Shared by threads; each makes its own [`TrialWorker`].
#[derive(Debug)]
pub struct TrialSim {
    sim: Arc<HandSim>,
    protocol: TrialProtocol,
}

impl TrialSim {
    /// Compiles the hand with a true mesh and its mass; trials follow [`TrialProtocol::STANDARD`].
    ///
    /// # Errors
    /// When a geom of the hand that would touch the mesh is no box, ball, capsule or cylinder, no solid has such mass
    /// properties, or MuJoCo refuses the hand.
    pub fn new(model: &HandModel, object: &Arc<ContactSurface>, mass: &MassProperties) -> Result<Self, HandError> {
        let sim = Arc::new(HandSim::with_free_mesh(model, object, mass)?);
        Ok(Self { sim, protocol: TrialProtocol::STANDARD })
    }

    /// Compiles as [`TrialSim::new`], with a table on which the object can rest: for conditions with a
    /// [table](TrialConditions::table). Trials without one have the results of [`TrialSim::new`].
    ///
    /// # Errors
    /// Errors of [`TrialSim::new`], and when the mesh lies in a plane.
    pub fn on_table(model: &HandModel, object: &Arc<ContactSurface>, mass: &MassProperties) -> Result<Self, HandError> {
        let sim = Arc::new(HandSim::with_free_mesh_on_table(model, object, mass)?);
        Ok(Self { sim, protocol: TrialProtocol::STANDARD })
    }

    /// Compiles the trial with the mesh as MuJoCo itself touches it: slow and right, or its convex hull. For
    /// comparison.
    ///
    /// # Errors
    /// If no solid has such mass properties, MuJoCo refuses the mesh or the hand, or [`TrialSim::can_touch_triangles`]
    /// is false for contacts of triangles.
    pub fn with_native_mesh(
        model: &HandModel,
        object: &TriMesh,
        mass: &MassProperties,
        contacts: NativeContacts,
    ) -> Result<Self, HandError> {
        let sim = Arc::new(HandSim::with_free_native_mesh(model, object, mass, contacts)?);
        Ok(Self { sim, protocol: TrialProtocol::STANDARD })
    }

    /// Whether a mesh has few enough triangles for contacts of each of them with the hand, which may take a gibibyte:
    /// 150,000 if each link is one solid.
    pub fn can_touch_triangles(model: &HandModel, object: &TriMesh) -> bool {
        NativeContacts::can_touch_triangles(model.max_geoms_per_body(), object)
    }

    /// Returns the trial with another protocol.
    ///
    /// # Errors
    /// When a number of it is not finite or below 0.
    pub fn with_protocol(self, protocol: TrialProtocol) -> Result<Self, HandError> {
        protocol.check()?;
        Ok(Self { protocol, ..self })
    }

    /// The protocol.
    pub fn protocol(&self) -> &TrialProtocol {
        &self.protocol
    }

    /// The hand.
    pub fn hand(&self) -> &Hand {
        self.sim.hand()
    }
}
