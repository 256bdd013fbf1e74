//! The table of marching cubes, made by rule.
//!
//! Lorensen and Cline, "Marching cubes" (1987), left ambiguous faces open to holes. Here each face is decided by itself:
//! inside corners that share no edge of the face are kept apart. Both cubes of a face decide alike, so no hole can be. No
//! diagonal of a triangulated loop lies in a face of its cube, so no edge of a triangle is ever used by a third one.

use std::sync::OnceLock;

/// Corner `c` of a cube lies at bit 0 of `c` along x, bit 1 along y, bit 2 along z.
pub(crate) const CORNERS: usize = 8;

/// An edge of a cube: the axis that it runs along, and the corner that it begins at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Edge {
    pub(crate) axis: usize,
    pub(crate) corner: usize,
}

/// The twelve edges: four along x, four along y, four along z.
pub(crate) const EDGES: [Edge; 12] = {
    let mut edges = [Edge { axis: 0, corner: 0 }; 12];
    let (mut count, mut axis) = (0, 0);
    while axis < 3 {
        let mut corner = 0;
        while corner < CORNERS {
            if corner >> axis & 1 == 0 {
                edges[count] = Edge { axis, corner };
                count += 1;
            }
            corner += 1;
        }
        axis += 1;
    }
    edges
};

/// Triangles of one case, as indices of [`EDGES`], wound outward: counter-clockwise seen from where values are low.
pub(crate) type CaseTriangles = Vec<[u8; 3]>;

/// Triangles of all 256 cases; bit `c` of a case is set if corner `c` is inside.
pub(crate) fn case_table() -> &'static [CaseTriangles] {
    static TABLE: OnceLock<Vec<CaseTriangles>> = OnceLock::new();
    TABLE.get_or_init(|| (0..256).map(triangles_of).collect())
}

/// Index of the edge between two corners that differ in one bit.
fn edge_between(a: usize, b: usize) -> usize {
    let edge = Edge { axis: (a ^ b).trailing_zeros() as usize, corner: a & b };
    EDGES.iter().position(|other| *other == edge).expect("corners of one edge")
}

/// The corners of each face, counter-clockwise seen from outside of the cube.
fn faces() -> impl Iterator<Item = [usize; 4]> {
    (0..6).map(|face| {
        let (axis, high) = (face / 2, face % 2);
        let (u, v) = (1 << ((axis + 1) % 3), 1 << ((axis + 2) % 3));
        let ring = [0, u, u | v, v].map(|corner| corner | high << axis);
        if high == 1 { ring } else { [ring[3], ring[2], ring[1], ring[0]] }
    })
}

/// Whether two edges lie in one face of the cube.
fn share_face(a: u8, b: u8) -> bool {
    let sides =
        |edge: Edge| (0..3).filter(move |axis| *axis != edge.axis).map(move |axis| (axis, edge.corner >> axis & 1));
    let (a, b) = (EDGES[usize::from(a)], EDGES[usize::from(b)]);
    sides(a).any(|side| sides(b).any(|other| other == side))
}

fn triangles_of(case: usize) -> CaseTriangles {
    let is_inside = |corner: usize| case >> corner & 1 == 1;
    // On each face a segment leads from the edge where a walk round the face enters the inside to the next where it leaves.
    let mut next = [None; 12];
    for ring in faces() {
        for start in (0..4).filter(|start| !is_inside(ring[*start]) && is_inside(ring[(start + 1) % 4])) {
            let leave = (1..4).find(|step| !is_inside(ring[(start + step + 1) % 4])).expect("the start is outside");
            let from = edge_between(ring[start], ring[(start + 1) % 4]);
            next[from] = Some(edge_between(ring[(start + leave) % 4], ring[(start + leave + 1) % 4]));
        }
    }
    // Segments of the six faces close to loops: each cut edge is entered on one of its faces and left on the other.
    let mut triangles = Vec::new();
    for start in 0..EDGES.len() {
        let (mut ring, mut at) = (Vec::new(), start);
        while let Some(following) = next[at].take() {
            ring.push(at as u8);
            at = following;
        }
        if !ring.is_empty() {
            triangles.extend(triangulate(&ring).expect("every loop has a triangulation off the faces"));
        }
    }
    triangles
}

/// Triangles of a loop, with no diagonal in a face of the cube; the first such triangulation in a fixed order.
fn triangulate(ring: &[u8]) -> Option<CaseTriangles> {
    let last = ring.len() - 1;
    if last < 2 {
        return Some(Vec::new());
    }
    let is_free = |from: usize, to: usize| to == from + 1 || !share_face(ring[from], ring[to]);
    (1..last).filter(|apex| is_free(0, *apex) && is_free(*apex, last)).find_map(|apex| {
        let mut triangles = vec![[ring[0], ring[apex], ring[last]]];
        triangles.extend(triangulate(&ring[..=apex])?);
        triangles.extend(triangulate(&ring[apex..])?);
        Some(triangles)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cases_have_at_most_five_triangles_and_cut_the_right_edges() {
        for (case, triangles) in case_table().iter().enumerate() {
            assert!(triangles.len() <= 5, "case {case}: {triangles:?}");
            let is_inside = |corner: usize| case >> corner & 1 == 1;
            for (index, edge) in EDGES.iter().enumerate() {
                let is_cut = is_inside(edge.corner) != is_inside(edge.corner | 1 << edge.axis);
                let is_used = triangles.iter().flatten().any(|used| usize::from(*used) == index);
                assert_eq!(is_cut, is_used, "case {case}, edge {index}");
            }
        }
    }

    #[test]
    fn edges_of_triangles_inside_a_cube_pair_up_and_the_rest_lie_in_faces() {
        for (case, triangles) in case_table().iter().enumerate() {
            let directed: Vec<[u8; 2]> =
                triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
            for [a, b] in &directed {
                let same = directed.iter().filter(|edge| **edge == [*a, *b]).count();
                let opposite = directed.iter().filter(|edge| **edge == [*b, *a]).count();
                assert_eq!((same, opposite), (1, usize::from(!share_face(*a, *b))), "case {case}, {a} to {b}");
            }
        }
    }
}
