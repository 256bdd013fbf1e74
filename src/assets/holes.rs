//! Places where a surface is open or touches itself.

use super::{
    bounds::Bounds,
    edges::{BOUNDARY, Edges, NEXT, from, to},
    mend::Sets,
};
use crate::geom::TriMesh;

/// One connected run of boundary edges.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hole {
    /// Edges on it.
    pub(super) edges: u32,
    /// Their length [m].
    pub(super) rim: f64,
    bounds: Bounds,
}

impl Hole {
    /// Middle of its box, in the mesh's frame [m].
    pub(super) fn centre(&self) -> [f64; 3] {
        self.bounds.centre()
    }

    /// Longest side of its box [m].
    pub(super) fn width(&self) -> f64 {
        self.bounds.sides().into_iter().fold(0.0, f64::max)
    }
}

/// The holes, longest rim first.
pub(super) fn holes(mesh: &TriMesh, edges: &Edges) -> Vec<Hole> {
    if edges.boundary == 0 {
        return Vec::new();
    }
    let faces = &mesh.triangles;
    let rim: Vec<u32> =
        (0..edges.partner.len() as u32).filter(|&half| edges.partner[half as usize] == BOUNDARY).collect();
    let mut sets = Sets::new(mesh.vertices.len());
    rim.iter().for_each(|&half| sets.unite(from(faces, half), to(faces, half)));
    let mut place = vec![u32::MAX; mesh.vertices.len()];
    let mut holes: Vec<Hole> = Vec::new();
    for &half in &rim {
        let place = &mut place[sets.root(from(faces, half)) as usize];
        if *place == u32::MAX {
            *place = holes.len() as u32;
            holes.push(Hole { edges: 0, rim: 0.0, bounds: Bounds::EMPTY });
        }
        let hole = &mut holes[*place as usize];
        let [a, b] = [from(faces, half), to(faces, half)].map(|vertex| mesh.vertices[vertex as usize]);
        hole.edges += 1;
        hole.rim += libm::sqrt((0..3).map(|axis| f64::from(a[axis]) - f64::from(b[axis])).map(|d| d * d).sum());
        hole.bounds.add(a);
    }
    holes.sort_by(|a, b| b.rim.total_cmp(&a.rim));
    holes
}

/// Vertices beyond one per fan of faces: how often a watertight mesh touches itself in a point.
///
/// Around a vertex of a watertight, consistently wound mesh the faces form closed fans; more than one fan is a pinch.
pub(super) fn pinches(mesh: &TriMesh, edges: &Edges) -> usize {
    let mut seen = vec![false; edges.partner.len()];
    let mut fans = 0;
    for start in 0..seen.len() {
        let mut corner = start;
        if !seen[corner] {
            fans += 1;
        }
        while !seen[corner] {
            seen[corner] = true;
            // The half-edge that arrives at this corner; its partner leaves from the same vertex.
            corner = edges.partner[corner / 3 * 3 + NEXT[NEXT[corner % 3]]] as usize;
        }
    }
    fans - mesh.vertices.len()
}
