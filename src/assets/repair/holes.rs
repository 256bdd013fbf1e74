//! Locations where a surface is open or touches itself.

use super::{
    bounds::Bounds,
    edges::{BOUNDARY, Edges, NEXT, from, to},
};
use kernel::geom::{Sets, TriMesh};

/// One connected run of boundary edges.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Hole {
    /// Edges on it.
    pub(crate) edges: u32,
    /// Their length [m].
    pub(crate) rim: f64,
    bounds: Bounds,
}

impl Hole {
    /// Middle of its box, in the mesh's frame [m].
    pub(crate) fn centre(&self) -> [f64; 3] {
        self.bounds.centre()
    }

    /// Longest side of its box [m].
    pub(crate) fn width(&self) -> f64 {
        self.bounds.sides().into_iter().fold(0.0, f64::max)
    }
}

/// The holes, longest rim first.
pub(crate) fn holes(mesh: &TriMesh, edges: &Edges) -> Vec<Hole> {
    if edges.boundary == 0 {
        return Vec::new();
    }
    let faces = &mesh.triangles;
    let rim: Vec<u32> =
        (0..edges.partner.len() as u32).filter(|&half| edges.partner[half as usize] == BOUNDARY).collect();
    let mut sets = Sets::new(mesh.vertices.len());
    rim.iter().for_each(|&half| sets.unite(from(faces, half), to(faces, half)));
    let mut hole_of = vec![u32::MAX; mesh.vertices.len()];
    let mut holes: Vec<Hole> = Vec::new();
    for &half in &rim {
        let number = &mut hole_of[sets.root(from(faces, half)) as usize];
        if *number == u32::MAX {
            *number = holes.len() as u32;
            holes.push(Hole { edges: 0, rim: 0.0, bounds: Bounds::EMPTY });
        }
        let hole = &mut holes[*number as usize];
        let [a, b] = [from(faces, half), to(faces, half)].map(|vertex| mesh.vertices[vertex as usize]);
        hole.edges += 1;
        hole.rim += libm::sqrt((0..3).map(|axis| f64::from(a[axis]) - f64::from(b[axis])).map(|d| d * d).sum());
        hole.bounds.add(a);
    }
    holes.sort_by(|a, b| b.rim.total_cmp(&a.rim));
    holes
}

/// Fans of faces beyond one per vertex: how often a watertight mesh touches itself in a point.
///
/// Around a vertex of a watertight, consistently wound mesh the faces form closed fans; more than one fan is a pinch.
pub(crate) fn pinches(mesh: &TriMesh, edges: &Edges) -> usize {
    // The corner that follows around the same vertex: the partner of the half-edge that arrives at a corner leaves there.
    let next = |corner: u32| {
        let (face, k) = (corner / 3, corner as usize % 3);
        edges.partner[3 * face as usize + NEXT[NEXT[k]]]
    };
    let mut corners = vec![0u32; mesh.vertices.len()];
    let mut start = vec![0u32; mesh.vertices.len()];
    for (face, vertices) in mesh.triangles.iter().enumerate() {
        for (k, &vertex) in vertices.iter().enumerate() {
            corners[vertex as usize] += 1;
            start[vertex as usize] = (3 * face + k) as u32;
        }
    }
    // All vertices take a step at a time, so that their look-ups overlap instead of waiting for one another.
    let mut walks: Vec<(u32, u32)> = start.iter().map(|&corner| (corner, next(corner))).collect();
    let mut pinched = Vec::new();
    let mut steps = 1;
    while !walks.is_empty() {
        walks.retain_mut(|(first, at)| {
            if first == at {
                let vertex = from(&mesh.triangles, *first);
                if corners[vertex as usize] != steps {
                    pinched.push(vertex);
                }
                return false;
            }
            *at = next(*at);
            true
        });
        steps += 1;
    }
    extra_fans(mesh, &pinched, next)
}

/// Fans beyond the first around each of the vertices.
fn extra_fans(mesh: &TriMesh, pinched: &[u32], next: impl Fn(u32) -> u32) -> usize {
    if pinched.is_empty() {
        return 0;
    }
    let mut is_pinched = vec![false; mesh.vertices.len()];
    pinched.iter().for_each(|&vertex| is_pinched[vertex as usize] = true);
    let mut seen = vec![false; 3 * mesh.triangles.len()];
    let mut fans = 0;
    for start in 0..seen.len() as u32 {
        let mut corner = start;
        if !is_pinched[from(&mesh.triangles, start) as usize] || seen[start as usize] {
            continue;
        }
        fans += 1;
        while !seen[corner as usize] {
            seen[corner as usize] = true;
            corner = next(corner);
        }
    }
    fans - pinched.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_tetrahedra_on_one_vertex_pinch_it_once() {
        let one = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let other = one.map(|face| face.map(|vertex| if vertex == 0 { 0 } else { vertex + 3 }));
        let triangles = [one, other].concat();
        let mesh = |triangles: Vec<[u32; 3]>, vertices| TriMesh { vertices: vec![[0.0; 3]; vertices], triangles };
        for (mesh, wanted) in [(mesh(one.to_vec(), 4), 0), (mesh(triangles, 7), 1)] {
            let edges = Edges::of(&mesh.triangles, mesh.vertices.len());
            assert_eq!(pinches(&mesh, &edges), wanted);
        }
    }
}
