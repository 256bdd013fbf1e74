//! A closed mesh in a grid that lies anywhere: its inside and its surface.

use nalgebra::Point3;

use super::{cells::pack_rows, interior::winding_rows, surface::ColumnsMet};
use crate::geom::{OccupancyGrid, TriMesh};

/// Cells whose centre is inside a closed mesh, or whose closed box meets a triangle, as binvox fills them with its exact
/// surface. The grid's lower corner lies at `low` [m], its cells have sides of `cell_size` [m]; what lies outside of it is not
/// in it.
///
/// # Panics
/// If `resolution` is not 1 to 128.
pub fn cells_met(mesh: &TriMesh, low: &Point3<f64>, cell_size: f64, resolution: u32) -> OccupancyGrid {
    let n = resolution as usize;
    assert!((1..=128).contains(&n), "a row of cells is a word of 128 bits");
    let corner = |vertex: &[f32; 3]| -> [f64; 3] {
        std::array::from_fn(|axis| (f64::from(vertex[axis]) - low[axis]) / cell_size)
    };
    let corners: Vec<[f64; 3]> = mesh.vertices.iter().map(corner).collect();
    let triangles = || mesh.triangles.iter().map(|triangle| triangle.map(|vertex| corners[vertex as usize]));
    let mut rows = winding_rows(triangles(), n);
    let mut columns = ColumnsMet::new(n);
    for triangle in triangles() {
        columns.each(&triangle, |x, y, first, end| rows[x * n + y] |= (u128::MAX >> (128 - (end - first))) << first);
    }
    let mut grid = OccupancyGrid::new(resolution);
    pack_rows(&rows, resolution, &mut grid);
    grid
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::solid::tests::block;

    #[test]
    fn a_box_holds_its_inside_and_every_cell_that_its_faces_meet() {
        let block = block([0.1, -0.2, 0.3], [0.14, -0.17, 0.35]);
        let bounds = block.aabb().expect("a box");
        let cell = 0.004;
        // A third of a cell before the box, so that no face lies on a border of cells.
        let low = bounds.min.map(|value| value - cell / 3.0);
        for resolution in [5, 24, 80] {
            let grid = cells_met(&block, &low, cell, resolution);
            let last = |axis: usize| ((bounds.extents()[axis] / cell + 1.0 / 3.0) as u32).min(resolution - 1);
            assert_eq!(grid.count(), (0..3).map(|axis| last(axis) + 1).product::<u32>(), "{resolution}");
            assert!(grid.cells().all(|cell| (0..3).all(|axis| cell[axis] <= last(axis))));
        }
        // A grid inside of the box is full.
        assert_eq!(cells_met(&block, &bounds.centre(), 1e-4, 20).count(), 8000);
        assert_eq!(cells_met(&TriMesh::default(), &low, cell, 5).count(), 0);
    }
}
