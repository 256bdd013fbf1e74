//! An object that moves freely in a compiled model.

use nalgebra::Point3;

/// An object that moves freely, as compiled: it weighs a kilogram.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreeObject {
    /// Its body.
    pub(super) body: usize,
    /// Its only geom.
    pub(super) geom: usize,
    /// Its place and turn among MuJoCo's coordinates.
    pub(super) address: usize,
    /// The first of its six velocities.
    pub(super) dof: usize,
    /// Its principal moments of inertia [kg m^2].
    pub(super) inertia: [f64; 3],
    /// Its centre of mass, in `Object` [m].
    pub(super) centre: Point3<f64>,
}
