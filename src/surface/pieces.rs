//! Small pieces of a mesh that hang on nothing.

use kernel::geom::TriMesh;

/// Drops pieces whose volume is below `share` of all, never the largest one; returns how many. Hollows inside count by their
/// own volume, so small ones are filled.
pub fn drop_small_pieces(mesh: &mut TriMesh, share: f64) -> usize {
    let root_of = piece_roots(mesh);
    let mut volumes = vec![0.0; mesh.vertices.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(index).map(|corner| corner.coords);
        volumes[root_of[triangle[0] as usize] as usize] += a.dot(&b.cross(&c)) / 6.0;
    }
    let is_root = |vertex: &usize| root_of[*vertex] as usize == *vertex;
    let roots: Vec<usize> = (0..mesh.vertices.len()).filter(is_root).collect();
    let total: f64 = roots.iter().map(|root| volumes[*root]).sum();
    let largest = roots.iter().copied().max_by(|a, b| volumes[*a].abs().total_cmp(&volumes[*b].abs()).then(b.cmp(a)));
    let is_kept = |root: usize| Some(root) == largest || volumes[root].abs() >= share * total;
    let dropped = roots.iter().filter(|root| !is_kept(**root)).count();
    if dropped == 0 {
        return 0;
    }
    // Vertices that are left move up.
    let mut new_index = vec![0; mesh.vertices.len()];
    let mut vertices = Vec::new();
    for (index, vertex) in mesh.vertices.iter().enumerate().filter(|(index, _)| is_kept(root_of[*index] as usize)) {
        new_index[index] = vertices.len() as u32;
        vertices.push(*vertex);
    }
    mesh.triangles.retain(|triangle| is_kept(root_of[triangle[0] as usize] as usize));
    mesh.triangles.iter_mut().flatten().for_each(|vertex| *vertex = new_index[*vertex as usize]);
    mesh.vertices = vertices;
    dropped
}

/// The lowest vertex of the piece that each vertex belongs to.
fn piece_roots(mesh: &TriMesh) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for [a, b, c] in &mesh.triangles {
        for (a, b) in [(a, b), (b, c)] {
            let (a, b) = (find_root(&mut parents, *a), find_root(&mut parents, *b));
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    (0..mesh.vertices.len() as u32).map(|vertex| find_root(&mut parents, vertex)).collect()
}

/// The root of a vertex; the path to it is halved on the way.
fn find_root(parents: &mut [u32], mut vertex: u32) -> u32 {
    while parents[vertex as usize] != vertex {
        parents[vertex as usize] = parents[parents[vertex as usize] as usize];
        vertex = parents[vertex as usize];
    }
    vertex
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        cubes::{
            marching_cubes,
            tests::{assert_closed_and_manifold, in_cells},
        },
        field::CubeField,
    };

    #[test]
    fn crumbs_go_hollows_are_filled_and_the_largest_piece_stays() {
        let mut field = CubeField::filled(20, 0.0);
        for [x, y, z] in field.cells() {
            let inside = x < 12 && y < 12 && z < 12;
            let hollow = [x, y, z] == [5, 6, 5];
            *field.at_mut([x, y, z]) = f32::from(inside && !hollow || [x, y, z] == [15, 15, 15]);
        }
        let mut mesh = marching_cubes(&field, 0.5, 0.0, in_cells);
        let whole = mesh.signed_volume();
        assert_eq!(drop_small_pieces(&mut mesh, 0.01), 2);
        assert_closed_and_manifold(&mesh);
        // A cell alone is an octahedron of this volume: one was lost, one filled.
        assert!((mesh.signed_volume() - whole).abs() < 1e-3, "{} {whole}", mesh.signed_volume());
        assert_eq!(drop_small_pieces(&mut mesh, 1.1), 0, "the largest stays");
        assert_eq!(drop_small_pieces(&mut TriMesh::default(), 0.01), 0);
    }
}
