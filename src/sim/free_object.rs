//! An object that moves freely in a compiled model.

use nalgebra::Point3;

/// An object that moves freely, as compiled: it weighs a kilogram.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeObject {
    /// Index of its body.
    pub(super) body: usize,
    /// Index of its only geom.
    pub(super) geom: usize,
    /// Index of its position and rotation among MuJoCo's coordinates.
    pub(super) address: usize,
    /// The first of its six velocities.
    pub(super) dof: usize,
    /// Principal moments of inertia [kg m^2].
    pub(super) inertia: [f64; 3],
    /// Centre of mass, in `Object` [m].
    pub(super) centre: Point3<f64>,
}
