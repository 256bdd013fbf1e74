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
    /// The plane below the object; `None` where no table is known.
    pub support: Option<SupportPlane>,
}

/// Plane that supports an object, in `CameraCv`: points with `normal . point + offset = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupportPlane {
    /// Unit normal, away from the table.
    pub normal: Vector3<f64>,
    /// Height of the camera above the plane [m].
    pub offset: f64,
}

impl SupportPlane {
    /// Height of a point above the plane [m].
    pub fn height(&self, point: &Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) + self.offset
    }
}

impl SeenCells<'_> {
    /// Direction away from the table in the camera's frame: up in the picture where no table is known.
    pub fn up(&self) -> Vector3<f64> {
        self.support.map_or(-Vector3::y(), |support| support.normal)
    }
}
