//! A body of a scene.

use std::sync::Arc;

use kernel::{contact::ContactBody, geom::MassProperties};

/// A body of a scene.
#[derive(Clone)]
pub struct SimBody {
    /// The true mesh.
    pub body: Arc<ContactBody>,
    /// Mass properties of the solid.
    pub solid: MassProperties,
    /// [kg].
    pub mass: f64,
    /// Coefficient of sliding friction; the larger one of two bodies applies, the container has none.
    pub friction: f64,
}
