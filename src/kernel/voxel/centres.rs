//! Which voxels of a volume have their centre inside a body.

use nalgebra::Point3;

use super::{
    fusion::VolumeGrid,
    interior::{holds, winding_rows},
};
use crate::geom::{Object, Pose, SolidGrid, TriMesh, Volume};

/// Inside of a body, by what decides it.
#[derive(Clone, Copy, Debug)]
pub enum InsideOf<'a> {
    /// A watertight mesh: a point is inside where the winding number is not 0, exactly.
    Closed(&'a TriMesh),
    /// A solid of 256^3 cells, for meshes with holes: a point is inside where the cell that holds it is solid.
    Cells(&'a SolidGrid),
}

/// Gives a number to every voxel that has 0 and whose centre is inside a body; returns how many there are. `out` has a
/// value per voxel of the grid, which has at most 128 along each edge.
pub fn mark_inside(
    body: InsideOf<'_>,
    volume_from_object: &Pose<Volume, Object>,
    grid: &VolumeGrid,
    number: u8,
    out: &mut [u8],
) -> u32 {
    let n = grid.resolution as usize;
    let rows = match body {
        InsideOf::Closed(mesh) => closed_rows(mesh, volume_from_object, grid),
        InsideOf::Cells(solid) => cell_rows(solid, volume_from_object, grid),
    };
    let mut count = 0;
    for (line, row) in out.chunks_exact_mut(n).zip(rows) {
        let free = line.iter_mut().enumerate().filter(|(z, value)| row >> z & 1 != 0 && **value == 0);
        free.for_each(|(_, value)| (*value, count) = (number, count + 1));
    }
    count
}

/// Rows of voxels along z inside a watertight mesh.
fn closed_rows(mesh: &TriMesh, volume_from_object: &Pose<Volume, Object>, grid: &VolumeGrid) -> Vec<u128> {
    let scale = 1.0 / grid.voxel();
    let corner = |vertex: &[f32; 3]| -> [f64; 3] {
        let point = volume_from_object.point(&Point3::from(vertex.map(f64::from)));
        [point.x * scale, point.y * scale, point.z * scale]
    };
    let corners: Vec<[f64; 3]> = mesh.vertices.iter().map(corner).collect();
    let triangles = mesh.triangles.iter().map(|triangle| triangle.map(|vertex| corners[vertex as usize]));
    winding_rows(triangles, grid.resolution as usize)
}

/// Rows of voxels along z whose centre lies in a solid cell.
fn cell_rows(solid: &SolidGrid, volume_from_object: &Pose<Volume, Object>, grid: &VolumeGrid) -> Vec<u128> {
    let (n, object_from_volume) = (grid.resolution, volume_from_object.inverse());
    let is_solid = |voxel: [u32; 3]| {
        let point = object_from_volume.point(&grid.centre(voxel));
        holds(solid, &Point3::from((point - solid.origin) / solid.pitch))
    };
    let row = |x: u32, y: u32| (0..n).fold(0, |row, z| row | u128::from(is_solid([x, y, z])) << z);
    (0..n).flat_map(|x| (0..n).map(move |y| (x, y))).map(|(x, y)| row(x, y)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxel::{InsideTest, solid_occupancy};
    use nalgebra::{Rotation3, Vector3};

    const GRID: VolumeGrid = VolumeGrid { resolution: 40, size: 0.3 };

    /// Middle of the cube, turned about all axes.
    fn pose() -> Pose<Volume, Object> {
        Pose::new(Rotation3::from_euler_angles(0.5, -0.8, 1.1), Vector3::new(0.16, 0.14, 0.15))
    }

    /// An open box: not convex, closed.
    fn bin() -> TriMesh {
        TriMesh::open_box([0.12, 0.1, 0.08], 0.02)
    }

    fn is_in_bin(point: &Point3<f64>) -> bool {
        let within = |value: f64, half: f64| value.abs() < half;
        let outer = within(point.x, 0.08) && within(point.y, 0.07) && point.z > -0.02 && point.z < 0.08;
        outer && !(within(point.x, 0.06) && within(point.y, 0.05) && point.z > 0.0)
    }

    #[test]
    fn centres_inside_an_open_box_are_those_of_its_walls() {
        let mut exact = vec![0; GRID.voxels()];
        exact[7] = 9;
        let count = mark_inside(InsideOf::Closed(&bin()), &pose(), &GRID, 3, &mut exact);
        let solid = solid_occupancy(&bin(), InsideTest::Crossings, false);
        let mut by_cells = vec![0; GRID.voxels()];
        let of_cells = mark_inside(InsideOf::Cells(&solid), &pose(), &GRID, 3, &mut by_cells);
        let object_from_volume = pose().inverse();
        let (mut expected, mut differ) = (0, 0);
        for (index, own) in exact.iter().enumerate() {
            let voxel = [index / 1600, index / 40 % 40, index % 40].map(|value| value as u32);
            let inside = is_in_bin(&object_from_volume.point(&GRID.centre(voxel)));
            assert_eq!(*own, if index == 7 { 9 } else { u8::from(inside) * 3 }, "{voxel:?}");
            expected += u32::from(inside);
            differ += u32::from((by_cells[index] == 3) != inside);
        }
        assert_eq!(count, expected);
        // A cell of the solid is 0.6 mm wide, a voxel 7.5.
        assert!(expected > 1_000 && differ < expected / 10 && of_cells.abs_diff(expected) < expected / 20, "{differ}");
    }

    #[test]
    fn a_voxel_keeps_its_first_number_and_a_body_elsewhere_has_none() {
        let mut out = vec![0; GRID.voxels()];
        let first = mark_inside(InsideOf::Closed(&bin()), &pose(), &GRID, 1, &mut out);
        let before = out.clone();
        assert_eq!(mark_inside(InsideOf::Closed(&bin()), &pose(), &GRID, 2, &mut out), 0);
        let far = Pose::new(Rotation3::identity(), Vector3::new(2.0, 0.1, 0.1));
        assert_eq!(mark_inside(InsideOf::Closed(&bin()), &far, &GRID, 2, &mut out), 0);
        assert_eq!(out, before);
        assert_eq!(out.iter().filter(|own| **own == 1).count(), first as usize);
    }
}
