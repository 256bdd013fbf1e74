//! Point clouds as the Point Cloud Library's binary PCD, version 0.7.

use crate::{geom::OccupancyGrid, record::TouchContact};

/// The indices (x, y, z) of the occupied cells as float32, in C order.
pub(super) fn of_cells(grid: &OccupancyGrid) -> Vec<u8> {
    // Indices are below 128: exact in float32.
    let points: Vec<[f32; 3]> = grid.cells().map(|cell| cell.map(|index| index as f32)).collect();
    of_points(&points)
}

/// Points as they stand.
pub(super) fn of_points(points: &[[f32; 3]]) -> Vec<u8> {
    of_rows("x y z", points)
}

/// Contacts with their normals, as PCL calls them.
pub(super) fn of_contacts(contacts: &[TouchContact]) -> Vec<u8> {
    let row = |contact: &TouchContact| {
        let ([x, y, z], [a, b, c]) = (contact.position, contact.normal);
        [x, y, z, a, b, c]
    };
    of_rows("x y z normal_x normal_y normal_z", &contacts.iter().map(row).collect::<Vec<_>>())
}

fn of_rows<const N: usize>(fields: &str, rows: &[[f32; N]]) -> Vec<u8> {
    let (count, [four, float, one]) = (rows.len(), ["4", "F", "1"].map(|word| [word; N].join(" ")));
    let mut bytes = format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {fields}\nSIZE {four}\nTYPE {float}\nCOUNT {one}\n\
         WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n"
    )
    .into_bytes();
    bytes.extend(rows.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
    bytes
}
