//! Meshes to solid grids.

use nalgebra::Point3;

use super::{
    columns::{Columns, Lattice},
    surface::mark_surface,
    winding::fill_by_winding,
};
use crate::geom::{SolidGrid, TriMesh};

/// Test that separates the solid from the empty cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InsideTest {
    /// Signed crossings along each column: exact for closed surfaces wound outward, by index or by position. Bodies
    /// may overlap or lie in one another: a cell is solid where the winding number is not 0, so an overlap is solid, and
    /// a cavity wound inward is empty. Not for surfaces with holes.
    Crossings,
    /// Generalised winding number: for surfaces with holes, soups and mixed winding; inside is 1/2 or more,
    /// in either winding. The same as `Crossings` where the surface is closed.
    WindingNumber,
}

/// The solid of a mesh: a cell is solid when its centre is inside; `with_surface` adds every cell whose closed box meets
/// a triangle, as binvox does.
///
/// The grid spans the mesh's box as described at [`SolidGrid`]. A mesh without triangles, without extent or with
/// coordinates that are not finite gives an empty grid; preparation refuses such meshes.
pub fn solid_occupancy(mesh: &TriMesh, test: InsideTest, with_surface: bool) -> SolidGrid {
    let Some(lattice) = Lattice::of(mesh) else {
        return SolidGrid::new(mesh.aabb().map_or(Point3::origin(), |aabb| aabb.min), 1.0);
    };
    let mut grid = SolidGrid::new(lattice.origin, lattice.longest_side);
    let vertices = lattice.vertices(mesh);
    let triangles = || mesh.triangles.iter().map(|triangle| triangle.map(|vertex| vertices[vertex as usize]));
    match test {
        InsideTest::Crossings => Columns::<{ SolidGrid::SIDE }>::of(triangles()).fill(&mut grid),
        InsideTest::WindingNumber => fill_by_winding(&vertices, &mesh.triangles, &mut grid),
    }
    if with_surface {
        mark_surface(triangles(), &mut grid);
    }
    grid
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A closed box wound outward, corners `low` and `high` [m].
    pub(in crate::voxel) fn block(low: [f32; 3], high: [f32; 3]) -> TriMesh {
        let vertices = (0..8)
            .map(|corner| std::array::from_fn(|axis| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] }))
            .collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        TriMesh { vertices, triangles }
    }

    fn join(meshes: &[TriMesh]) -> TriMesh {
        let mut all = TriMesh::default();
        for mesh in meshes {
            let first = all.vertices.len() as u32;
            all.vertices.extend_from_slice(&mesh.vertices);
            all.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
        }
        all
    }

    #[test]
    fn a_cube_fills_its_grid() {
        let grid = solid_occupancy(&block([0.1; 3], [0.3; 3]), InsideTest::Crossings, false);
        assert_eq!(grid.count(), 256 * 256 * 256);
        assert!((grid.volume() - 0.008).abs() < 1e-8);
    }

    #[test]
    fn overlap_and_nesting_are_solid_and_a_cavity_is_empty() {
        let outer = block([0.0; 3], [0.256; 3]);
        let inner = block([0.064; 3], [0.128; 3]);
        let full = 256 * 256 * 256;
        let nested = solid_occupancy(&join(&[outer.clone(), inner.clone()]), InsideTest::Crossings, false);
        assert_eq!(nested.count(), full);
        let mut cavity = inner;
        cavity.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        let hollow = solid_occupancy(&join(&[outer, cavity]), InsideTest::Crossings, false);
        assert_eq!(hollow.count(), full - 64 * 64 * 64);
        // Two cubes of 128 cells that share a corner cube of 64.
        let twins = [block([0.0; 3], [0.128; 3]), block([0.064; 3], [0.192; 3]), block([0.192; 3], [0.256; 3])];
        let overlap = solid_occupancy(&join(&twins), InsideTest::Crossings, false);
        assert_eq!(overlap.count(), 2 * 128u64.pow(3) - 64u64.pow(3) + 64u64.pow(3));
    }

    #[test]
    fn nothing_gives_an_empty_grid() {
        let flat = TriMesh { vertices: vec![[1.0; 3]; 3], triangles: vec![[0, 1, 2]] };
        for mesh in [TriMesh::default(), flat] {
            assert_eq!(solid_occupancy(&mesh, InsideTest::Crossings, false).count(), 0);
        }
    }
}
