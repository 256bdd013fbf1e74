//! The input of a baseline.

use kernel::geom::{GridPlacement, OccupancyGrid};
use nalgebra::{Point3, Vector3};

/// A seen point of an object's surface, in `CameraCv`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenPoint {
    /// Position [m].
    pub position: Point3<f64>,
    /// Unit normal of the surface, towards the camera.
    pub normal: Vector3<f64>,
}

/// An object as far as it was seen.
#[derive(Clone, Copy, Debug)]
pub struct SeenCells<'a> {
    /// Cells that hold a seen point.
    pub partial: &'a OccupancyGrid,
    /// Cells that the camera sees through, where they are known.
    pub free: Option<&'a OccupancyGrid>,
    /// Seen points with normals, for baselines that need them ([`Baseline::needs_points`](crate::Baseline::needs_points)).
    pub points: &'a [SeenPoint],
    /// Where the grids lie; z points away from the camera.
    pub placement: &'a GridPlacement,
    /// Direction away from the table, in the camera's frame.
    pub up: [f64; 3],
}

impl SeenCells<'_> {
    /// Up as the picture has it, where no table is known.
    pub const IMAGE_UP: [f64; 3] = [0.0, -1.0, 0.0];
}
