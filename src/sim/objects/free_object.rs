//! An object that moves freely in a compiled model.

use nalgebra::Point3;

/// Part of an object that contacts are made with: its only one.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Touched {
    /// Index of a geom.
    Geom(usize),
    /// Index of a flex.
    Flex(usize),
}

/// An object that moves freely, as compiled: it weighs a kilogram.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FreeObject {
    /// Index of its body.
    pub(crate) body: usize,
    /// Part that contacts are made with.
    pub(crate) touched: Touched,
    /// Index of its position and rotation among MuJoCo's coordinates.
    pub(crate) address: usize,
    /// The first of its six velocities.
    pub(crate) dof: usize,
    /// Principal moments of inertia [kg m^2].
    pub(crate) inertia: [f64; 3],
    /// Centre of mass, in `Object` [m].
    pub(crate) centre: Point3<f64>,
}
