//! Truncated signed distance at a sample's grid.

use nalgebra::{Point3, Vector3};

use super::surface::{Closest, Surface};
use crate::geom::{CameraCv, GridPlacement, Object, Pose, SolidCells, SolidGrid};

/// Steps of the truncation distance; also the value of everything beyond.
pub const TSDF_STEPS: i16 = i16::MAX;

/// Inputs that stay the same for every block of a grid.
struct Field<'a> {
    surface: &'a Surface,
    solid: &'a SolidGrid,
    /// Lower corner of the grid, in `Object` [m].
    corner: Point3<f64>,
    /// One cell along each axis of the grid, in `Object` [m].
    steps: [Vector3<f64>; 3],
    cell_size: f64,
    truncation: f64,
    resolution: usize,
}

/// Writes the truncated signed distance at the centre of every cell to `out`.
///
/// True distance to the mesh's surface, visible or not (no distance along the line of sight), negative inside, cut at
/// `truncation` cells, which must be positive. Shape (resolution, resolution, resolution), C order, indexed (x, y, z)
/// as in [`GridPlacement`]. Each value is the distance in steps of truncation / 32767, rounded to nearest: distance [m]
/// = value / 32767 * truncation * cell size, and -32767 and 32767 mean "at least this far".
pub fn tsdf(
    surface: &Surface,
    solid: &SolidGrid,
    camera_from_object: &Pose<CameraCv, Object>,
    placement: &GridPlacement,
    truncation: f64,
    out: &mut Vec<i16>,
) {
    debug_assert!(truncation > 0.0, "a truncation of {truncation} cells");
    let object_from_camera = camera_from_object.inverse();
    let rotation = object_from_camera.rotation().matrix();
    let resolution = placement.resolution as usize;
    let field = Field {
        surface,
        solid,
        corner: object_from_camera.point(&placement.lower_corner()),
        steps: std::array::from_fn(|axis| rotation.column(axis) * placement.cell_size),
        cell_size: placement.cell_size,
        truncation: truncation * placement.cell_size,
        resolution,
    };
    out.clear();
    out.resize(resolution.pow(3), TSDF_STEPS);
    field.fill([0; 3], resolution.next_power_of_two(), None, out);
}

impl Field<'_> {
    /// Fills the block of `side` cells from `cell` on: at once where the surface is too far from all of it, else by its
    /// eight parts.
    fn fill(&self, cell: [usize; 3], side: usize, hint: Option<&Closest>, out: &mut [i16]) {
        if cell.iter().any(|first| *first >= self.resolution) {
            return;
        }
        // Middle of the block, in the object's frame.
        let middle = cell.map(|first| first as f64 + 0.5 * side as f64);
        let point = self.corner + self.steps[0] * middle[0] + self.steps[1] * middle[1] + self.steps[2] * middle[2];
        // From the block's middle to its farthest cell centre.
        let radius = 0.5 * (side - 1) as f64 * 3f64.sqrt() * self.cell_size;
        let Some(closest) = self.surface.closest_from(&point, self.truncation + radius, hint) else {
            // No surface near: the whole block is on one side.
            if self.solid.holds(&point) {
                self.set(cell, side, -TSDF_STEPS, out);
            }
            return;
        };
        // Single cell: truncated signed distance, rounded to steps.
        if side == 1 {
            let distance = closest.distance_squared.sqrt() / self.truncation;
            let signed = if self.surface.inside(self.solid, &point, Some(&closest)) { -distance } else { distance };
            let value = (signed.clamp(-1.0, 1.0) * f64::from(TSDF_STEPS) + 0.5).floor() as i16;
            self.set(cell, 1, value, out);
            return;
        }
        // Octree descent: each of the eight parts starts from this closest point.
        let half = side / 2;
        for part in 0..8 {
            let corner = [cell[0] + (part >> 2) * half, cell[1] + (part >> 1 & 1) * half, cell[2] + (part & 1) * half];
            self.fill(corner, half, Some(&closest), out);
        }
    }

    /// Sets the cells of a block that lie inside the grid.
    fn set(&self, cell: [usize; 3], side: usize, value: i16, out: &mut [i16]) {
        let n = self.resolution;
        let end = cell.map(|first| (first + side).min(n));
        for x in cell[0]..end[0] {
            for y in cell[1]..end[1] {
                out[(x * n + y) * n..][cell[2]..end[2]].fill(value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::channels::surface::shapes::{self, Shape};

    /// The worst error [m] over some views, and how many cells are at the cut.
    fn errors(shape: &Shape, truncation: f64) -> (f64, usize) {
        let (mut worst, mut full) = (0.0f64, 0);
        let mut out = Vec::new();
        for (pose, placement) in shapes::views(shape) {
            tsdf(&Surface::new(&shape.mesh), &shape.solid, &pose, &placement, truncation, &mut out);
            let cut = truncation * placement.cell_size;
            for (i, value) in out.iter().enumerate() {
                let cell = [i / 1600, i / 40 % 40, i % 40].map(|v| v as f64 + 0.5);
                let point = placement.lower_corner() + Vector3::from(cell) * placement.cell_size;
                let truth = (shape.distance)(&pose.inverse().point(&point)).clamp(-cut, cut);
                worst = worst.max((f64::from(*value) / f64::from(TSDF_STEPS) * cut - truth).abs());
                full += usize::from(value.unsigned_abs() == TSDF_STEPS.unsigned_abs());
            }
        }
        (worst, full)
    }

    #[test]
    fn a_box_has_its_closed_form() {
        // Half a step of 3 cells is 1.5e-7 m.
        let (worst, full) = errors(&shapes::cuboid([0.1, 0.06, 0.03]), 3.0);
        assert!(worst <= 2e-7, "{worst} m off");
        assert!(full > 1000);
        let (worst, _) = errors(&shapes::cuboid([0.1, 0.06, 0.03]), 50.0);
        assert!(worst <= 3e-6, "{worst} m off without truncation");
    }

    #[test]
    fn a_sphere_has_its_closed_form() {
        // The facets of the mesh dip up to 1.3e-5 m below the sphere.
        let (worst, _) = errors(&shapes::sphere(0.05), 4.0);
        assert!(worst <= 1.5e-5, "{worst} m off");
    }

    #[test]
    fn a_thin_plate_keeps_its_sign() {
        // A tenth of a cell thick, less than the fine cells of the solid: the surface decides, not the solid.
        let (worst, _) = errors(&shapes::cuboid([0.1, 0.1, 0.0003]), 3.0);
        assert!(worst <= 2e-7, "{worst} m off");
    }
}
