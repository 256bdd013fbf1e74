//! A touch of a hand's link.

use nalgebra::{Point3, Unit, Vector3};

/// A link that presses on the object, at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkTouch {
    /// The link; 0 is the base.
    pub link: usize,
    /// The point on the object's surface, expressed in the hand's base frame [m].
    pub point: Point3<f64>,
    /// Unit normal out of the object, expressed in the hand's base frame.
    pub normal: Unit<Vector3<f64>>,
    /// Distance from the object to the link [m], negative where they overlap.
    pub distance: f64,
    /// Normal force between the two [N].
    pub force: f64,
}
