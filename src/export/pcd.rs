//! Point clouds as the Point Cloud Library's binary PCD, version 0.7.

use crate::geom::OccupancyGrid;

/// The indices (x, y, z) of the occupied cells as float32, in C order.
pub(super) fn of_cells(grid: &OccupancyGrid) -> Vec<u8> {
    // Indices are below 128: exact in float32.
    let points: Vec<[f32; 3]> = grid.cells().map(|cell| cell.map(|index| index as f32)).collect();
    of_points(&points)
}

/// Points as they stand.
pub(super) fn of_points(points: &[[f32; 3]]) -> Vec<u8> {
    let count = points.len();
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n\
         WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    .into_bytes();
    bytes.extend(points.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    bytes
}
