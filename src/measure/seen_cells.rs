//! The input of a baseline.

use kernel::geom::{GridPlacement, OccupancyGrid};

/// An object as far as it was seen.
#[derive(Clone, Copy, Debug)]
pub struct SeenCells<'a> {
    /// Cells that hold a seen point.
    pub partial: &'a OccupancyGrid,
    /// Cells that the camera sees through, where they are known.
    pub free: Option<&'a OccupancyGrid>,
    /// Where the grids lie; z points away from the camera.
    pub placement: &'a GridPlacement,
    /// Direction away from the table, in the camera's frame.
    pub up: [f64; 3],
}

impl SeenCells<'_> {
    /// Up as the picture has it, where no table is known.
    pub const IMAGE_UP: [f64; 3] = [0.0, -1.0, 0.0];
}
