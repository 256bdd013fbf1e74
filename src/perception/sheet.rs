//! The part of an object that the camera sees, as a mesh (thesis, section 4.3.2).

use kernel::geom::TriMesh;

use crate::frame::DepthFrame;

/// Neighbouring pixels further apart in depth than this many footprints of a pixel see two surfaces.
pub(crate) const JUMP: f64 = 3.0;

/// A sheet of triangles over these pixels, in `CameraCv` [m], facing the camera; open at its rim. No triangle spans a jump in
/// depth of more than three footprints of a pixel. Pixels of no triangle have no vertex.
pub fn visible_sheet(frame: &DepthFrame, pixels: &[u32]) -> TriMesh {
    let width = frame.camera.width;
    let mut index_of = vec![u32::MAX; frame.depth.len()];
    let mut is_member = vec![false; frame.depth.len()];
    pixels
        .iter()
        .filter(|pixel| frame.depth[**pixel as usize] > 0.0)
        .for_each(|pixel| is_member[*pixel as usize] = true);
    let mut mesh = TriMesh::default();
    let joins = |a: u32, b: u32| {
        let jump = f64::from((frame.depth[a as usize] - frame.depth[b as usize]).abs());
        jump <= JUMP * frame.footprint(a).min(frame.footprint(b))
    };
    for corner in pixels {
        let (column, row) = frame.column_and_row(*corner);
        if column + 1 == width || row + 1 == frame.camera.height {
            continue;
        }
        let [a, b, c, d] = [*corner, corner + width, corner + 1, corner + width + 1];
        for triangle in [[a, b, c], [c, b, d]] {
            let [p, q, r] = triangle;
            if triangle.iter().all(|pixel| is_member[*pixel as usize]) && joins(p, q) && joins(q, r) && joins(r, p) {
                mesh.triangles.push(triangle);
            }
        }
    }
    for pixel in mesh.triangles.iter_mut().flatten() {
        let index = &mut index_of[*pixel as usize];
        if *index == u32::MAX {
            *index = mesh.vertices.len() as u32;
            mesh.vertices.push(frame.point(*pixel).coords.map(|value| value as f32).into());
        }
        *pixel = *index;
    }
    mesh
}
