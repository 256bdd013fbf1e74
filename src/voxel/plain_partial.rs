//! Depth to grid: where a sample's grid lies, and which of its cells the camera saw.

use nalgebra::Point3;

use super::placement::NoGrid;
use crate::geom::{DepthCrop, GridPlacement, Intrinsics, OccupancyGrid};

/// The grid of a partial cloud: centre of its box at (0.5, 0.5, 0.45) of the grid, longest side 0.8 of it
/// (thesis ch. 5.3: 32 of 40 cells, centre at (20, 20, 18)).
///
/// # Errors
/// When there is no box.
pub fn place_grid(crop: &DepthCrop, camera: &Intrinsics, resolution: u32) -> Result<GridPlacement, NoGrid> {
    let mut low = [f64::INFINITY; 3];
    let mut high = [f64::NEG_INFINITY; 3];
    let mut seen = false;
    for_each_point(crop, camera, |point| {
        seen = true;
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    });
    if !seen {
        return Err(NoGrid::NothingSeen);
    }
    let side = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    if !(side > 0.0 && side.is_finite()) {
        return Err(NoGrid::NoExtent);
    }
    let centre = Point3::from(std::array::from_fn::<f64, 3, _>(|axis| (low[axis] + high[axis]) / 2.0));
    Ok(GridPlacement { resolution, centre, cell_size: side / (GridPlacement::FILL * f64::from(resolution)) })
}

/// Marks the cell of every point that the camera saw: floor((p - centre) / cell + anchor). `drop_index_zero` is the
/// thesis's quirk: a cell with index 0 on any axis is lost.
pub fn partial_occupancy(
    crop: &DepthCrop,
    camera: &Intrinsics,
    placement: &GridPlacement,
    drop_index_zero: bool,
    grid: &mut OccupancyGrid,
) {
    grid.reset(placement.resolution);
    let (anchor, n) = (placement.anchor(), f64::from(placement.resolution));
    let least = if drop_index_zero { 1.0 } else { 0.0 };
    for_each_point(crop, camera, |point| {
        let cell: [f64; 3] = std::array::from_fn(|axis| {
            ((point[axis] - placement.centre[axis]) / placement.cell_size + anchor[axis]).floor()
        });
        if cell.iter().all(|index| *index >= least && *index < n) {
            grid.set(cell.map(|index| index as u32));
        }
    });
}

/// Every pixel with a return as a point in `CameraCv` [m], in pixel order.
pub fn for_each_point(crop: &DepthCrop, camera: &Intrinsics, mut visit: impl FnMut([f64; 3])) {
    for (y, row) in crop.depth.chunks_exact(crop.width.max(1) as usize).enumerate() {
        let v = (f64::from(crop.top) + y as f64 + 0.5 - camera.cy) / camera.fy;
        for (x, depth) in row.iter().enumerate() {
            if !depth.is_nan() {
                let depth = f64::from(*depth);
                let u = (f64::from(crop.left) + x as f64 + 0.5 - camera.cx) / camera.fx;
                visit([u * depth, v * depth, depth]);
            }
        }
    }
}
