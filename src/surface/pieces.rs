//! Pieces of a mesh that hang on nothing: crumbs are dropped, bodies are counted.

use std::{collections::BTreeSet, f64::consts::PI};

use kernel::geom::TriMesh;
use nalgebra::{RealField, Vector3};

/// Bodies of a closed mesh, and how much of it is loose: in another body than the largest. A body is a piece that is wound outward;
/// hollows inside are of the body around them, and count neither as bodies nor by their area.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct LooseBodies {
    /// Count of bodies; 0 for a mesh without triangles.
    pub bodies: usize,
    /// Share of the bodies' area that is loose.
    pub loose_area: f64,
    /// Share of the bodies' volume that is loose.
    pub loose_volume: f64,
}

impl LooseBodies {
    /// Bodies of a closed mesh. A completion of two parts may be right, as of a glass whose stem is too thin for the grid;
    /// [`keep_largest_body`] drops all but one.
    pub fn from_mesh(mesh: &TriMesh) -> Self {
        let pieces = pieces(mesh);
        let bodies = || pieces.iter().filter(|piece| piece.volume > 0.0);
        let largest = bodies().max_by(|a, b| a.volume.total_cmp(&b.volume));
        let Some(largest) = largest else { return Self::default() };
        let loose = |part: f64, whole: f64| ((whole - part) / whole).max(0.0);
        Self {
            bodies: bodies().count(),
            loose_area: loose(largest.area, bodies().map(|piece| piece.area).sum()),
            loose_volume: loose(largest.volume, bodies().map(|piece| piece.volume).sum()),
        }
    }
}

/// Triangles that hang together.
struct Piece {
    /// The lowest vertex.
    root: u32,
    /// [m^2].
    area: f64,
    /// [m^3], below 0 where the piece is wound inward: the hollow of another one.
    volume: f64,
}

/// The pieces of a mesh by their lowest vertices, in order.
fn pieces(mesh: &TriMesh) -> Vec<Piece> {
    let root_of = piece_roots(mesh);
    let mut sums = vec![[0.0; 2]; mesh.vertices.len()];
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(index).map(|corner| corner.coords);
        let sum = &mut sums[root_of[triangle[0] as usize] as usize];
        sum[0] += (b - a).cross(&(c - a)).norm() / 2.0;
        sum[1] += a.dot(&b.cross(&c)) / 6.0;
    }
    let is_root = |(vertex, _): &(u32, &[f64; 2])| root_of[*vertex as usize] == *vertex;
    let roots = (0..).zip(&sums).filter(is_root);
    roots.map(|(root, [area, volume])| Piece { root, area: *area, volume: *volume }).collect()
}

/// Drops pieces whose volume is below `share` of all, never the largest one; returns how many. Hollows inside count by their
/// own volume, so small ones are filled.
pub fn drop_small_pieces(mesh: &mut TriMesh, share: f64) -> usize {
    let (root_of, pieces) = (piece_roots(mesh), pieces(mesh));
    let total: f64 = pieces.iter().map(|piece| piece.volume).sum();
    let size = |piece: &Piece| piece.volume.abs();
    let largest = pieces.iter().max_by(|a, b| size(a).total_cmp(&size(b)).then(b.root.cmp(&a.root)));
    let largest = largest.map(|piece| piece.root);
    let kept = pieces.iter().filter(|piece| Some(piece.root) == largest || size(piece) >= share * total);
    let kept: BTreeSet<u32> = kept.map(|piece| piece.root).collect();
    keep_pieces(mesh, &root_of, &kept);
    pieces.len() - kept.len()
}

/// Drops every body of a closed mesh but the one with the largest volume, with its hollows; returns the number of dropped bodies.
/// A hollow belongs to the body that its first vertex is inside of, by the winding number (Jacobson et al. 2013, equation 5).
pub fn keep_largest_body(mesh: &mut TriMesh) -> usize {
    let (root_of, pieces) = (piece_roots(mesh), pieces(mesh));
    let bodies = || pieces.iter().filter(|piece| piece.volume > 0.0);
    let largest = bodies().max_by(|a, b| a.volume.total_cmp(&b.volume).then(b.root.cmp(&a.root)));
    let Some(largest) = largest else { return 0 };
    let is_inside = |piece: &&Piece| winding(mesh, &root_of, largest.root, piece.root) > 0.5;
    let hollows = pieces.iter().filter(|piece| piece.volume <= 0.0).filter(is_inside);
    let kept: BTreeSet<u32> = hollows.map(|piece| piece.root).chain([largest.root]).collect();
    let dropped = bodies().count() - 1;
    keep_pieces(mesh, &root_of, &kept);
    dropped
}

/// Number of times that a piece winds around a vertex of another.
fn winding(mesh: &TriMesh, root_of: &[u32], piece: u32, vertex: u32) -> f64 {
    let eye = Vector3::from(mesh.vertices[vertex as usize].map(f64::from));
    let mut angle = 0.0;
    for index in (0..mesh.triangles.len()).filter(|index| root_of[mesh.triangles[*index][0] as usize] == piece) {
        let [a, b, c] = mesh.corners(index).map(|corner| corner.coords - eye);
        let [along_a, along_b, along_c] = [a.norm(), b.norm(), c.norm()];
        let below = along_a * along_b * along_c + a.dot(&b) * along_c + b.dot(&c) * along_a + c.dot(&a) * along_b;
        angle += 2.0 * RealField::atan2(a.dot(&b.cross(&c)), below);
    }
    angle / (4.0 * PI)
}

/// Keeps the pieces with these roots.
fn keep_pieces(mesh: &mut TriMesh, root_of: &[u32], kept: &BTreeSet<u32>) {
    let is_kept = |root: u32| kept.contains(&root);
    // Vertices that are left move up.
    let mut new_index = vec![0; mesh.vertices.len()];
    let mut vertices = Vec::new();
    for (index, vertex) in mesh.vertices.iter().enumerate().filter(|(index, _)| is_kept(root_of[*index])) {
        new_index[index] = vertices.len() as u32;
        vertices.push(*vertex);
    }
    mesh.triangles.retain(|triangle| is_kept(root_of[triangle[0] as usize]));
    mesh.triangles.iter_mut().flatten().for_each(|vertex| *vertex = new_index[*vertex as usize]);
    mesh.vertices = vertices;
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
        assert_eq!(LooseBodies::from_mesh(&mesh), LooseBodies { bodies: 1, loose_area: 0.0, loose_volume: 0.0 });
        assert_eq!(drop_small_pieces(&mut mesh, 1.1), 0, "the largest stays");
        assert_eq!(drop_small_pieces(&mut TriMesh::default(), 0.01), 0);
    }

    #[test]
    fn loose_bodies_are_counted_and_hollows_are_none() {
        // A cube of 10 cells with a hollow of 4, and two cubes of 5 and 3 cells beside it.
        let mut field = CubeField::filled(24, 0.0);
        for cell in field.cells() {
            let in_cube = |low: usize, side: usize| cell.iter().all(|index| (low..low + side).contains(index));
            *field.at_mut(cell) = f32::from(in_cube(1, 10) && !in_cube(4, 4) || in_cube(13, 5) || in_cube(20, 3));
        }
        let mesh = marching_cubes(&field, 0.5, 0.0, in_cells);
        assert_closed_and_manifold(&mesh);
        let found = LooseBodies::from_mesh(&mesh);
        // By the cubes alone: a field's surface cuts edges and corners of each alike.
        let cube = |side: usize| {
            let mut field = CubeField::filled(24, 0.0);
            for cell in field.cells() {
                *field.at_mut(cell) = f32::from(cell.iter().all(|index| (1..1 + side).contains(index)));
            }
            let mesh = marching_cubes(&field, 0.5, 0.0, in_cells);
            let area: f64 = (0..mesh.triangles.len())
                .map(|index| {
                    let [a, b, c] = mesh.corners(index);
                    (b - a).cross(&(c - a)).norm() / 2.0
                })
                .sum();
            (area, mesh.signed_volume())
        };
        let [large, middle, small] = [10, 5, 3].map(cube);
        let share = |part: [f64; 2], whole: f64| part.iter().sum::<f64>() / whole;
        assert_eq!(found.bodies, 3);
        let area = share([middle.0, small.0], large.0 + middle.0 + small.0);
        assert!((found.loose_area - area).abs() < 1e-6, "{found:?}, {area}");
        let volume = share([middle.1, small.1], large.1 + middle.1 + small.1);
        assert!((found.loose_volume - volume).abs() < 1e-6, "{found:?}, {volume}");
        assert_eq!(LooseBodies::from_mesh(&TriMesh::default()).bodies, 0);

        let mut alone = mesh.clone();
        assert_eq!(keep_largest_body(&mut alone), 2);
        assert_closed_and_manifold(&alone);
        let hollow = cube(4).1;
        assert!((alone.signed_volume() - (large.1 - hollow)).abs() < 1e-2 * large.1, "its hollow stays");
        assert_eq!((LooseBodies::from_mesh(&alone).bodies, keep_largest_body(&mut alone)), (1, 0));
        assert_eq!(keep_largest_body(&mut TriMesh::default()), 0);
    }
}
