//! Fixed things around a fixed object, and contacts of a hand with one.

use std::sync::Arc;

use nalgebra::{IsometryMatrix3, Point3};

use kernel::contact::ContactSurface;

/// A fixed thing around a fixed object.
#[derive(Clone)]
pub struct StillThing {
    /// Shape of the thing.
    pub shape: StillShape,
    /// Pose of the thing, expressed in the object's frame.
    pub object_from_thing: IsometryMatrix3<f64>,
}

/// Shape of a fixed thing.
#[derive(Clone)]
pub enum StillShape {
    /// A true mesh.
    Mesh(Arc<ContactSurface>),
    /// All below the plane z = 0.
    Ground,
}

/// A hand that touches a thing other than the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThingTouch {
    /// Index of the thing.
    pub thing: usize,
    /// The link; 0 is the base.
    pub link: usize,
    /// The point where the two touch, expressed in the object's frame [m].
    pub point: Point3<f64>,
}
