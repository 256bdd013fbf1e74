//! A body of a scene.

use std::sync::Arc;

use kernel::{contact::ContactBody, geom::MassProperties};

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
