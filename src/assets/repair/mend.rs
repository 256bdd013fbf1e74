//! Repairs of single faces: without area, on the same three vertices, two-sided shells.

use super::edges::{BOUNDARY, CROWDED, Edges, NEXT, apex, from, to};
use kernel::geom::{Sets, TriMesh};

/// Merges the positions of a mesh that have become equal; returns the mesh with faces on the merged ones.
pub(crate) fn weld(mesh: TriMesh) -> TriMesh {
    let mut welder = super::weld::Welder::new(mesh.vertices.len());
    let merged: Vec<u32> = mesh.vertices.iter().map(|&position| welder.index(position)).collect();
    let triangles = mesh.triangles.iter().map(|face| face.map(|vertex| merged[vertex as usize])).collect();
    TriMesh { vertices: welder.into_positions(), triangles }
}

/// Drops the vertices that no face uses, keeping the order of the others; returns how many went.
pub(crate) fn drop_unused<P: Copy>(positions: &mut Vec<P>, faces: &mut [[u32; 3]]) -> usize {
    let mut index_of = vec![0u32; positions.len()];
    for &vertex in faces.iter().flatten() {
        index_of[vertex as usize] = 1;
    }
    let before = positions.len();
    let mut kept = 0;
    for vertex in 0..before {
        if index_of[vertex] == 1 {
            index_of[vertex] = kept as u32;
            positions[kept] = positions[vertex];
            kept += 1;
        }
    }
    if kept < before {
        positions.truncate(kept);
        for vertex in faces.iter_mut().flatten() {
            *vertex = index_of[*vertex as usize];
        }
    }
    before - kept
}

/// Drops the faces with a repeated corner, whose edges cancel; returns how many.
pub(crate) fn drop_collapsed(mesh: &mut TriMesh) -> usize {
    let before = mesh.triangles.len();
    mesh.triangles.retain(|&[a, b, c]| a != b && b != c && c != a);
    before - mesh.triangles.len()
}

/// Removes the faces whose three corners are in a line; returns how many.
///
/// Dropping one would open a slit: the face across its longest edge is split at the middle corner instead, so that
/// a closed mesh stays closed and no vertex moves.
pub(crate) fn drop_zero_area(mesh: &mut TriMesh) -> usize {
    let mut dropped = 0;
    // Each pass removes at least one such face without a neighbour of its kind; chains of them need a few passes.
    for _ in 0..32 {
        let flat: Vec<u32> = (0..mesh.triangles.len() as u32)
            .filter(|&face| is_zero_area(mesh, mesh.triangles[face as usize]))
            .collect();
        if flat.is_empty() {
            return dropped;
        }
        dropped += split_across(mesh, &flat);
    }
    let before = mesh.triangles.len();
    let mut faces = std::mem::take(&mut mesh.triangles);
    faces.retain(|&face| !is_zero_area(mesh, face));
    mesh.triangles = faces;
    dropped + before - mesh.triangles.len()
}

fn split_across(mesh: &mut TriMesh, flat: &[u32]) -> usize {
    let edges = Edges::of(&mesh.triangles, mesh.vertices.len());
    let faces = &mut mesh.triangles;
    let mut touched = vec![false; faces.len()];
    let (mut gone, mut removed) = (Vec::new(), 0);
    for &face in flat {
        if touched[face as usize] {
            continue;
        }
        let length = |half: u32| squared_distance(&mesh.vertices, from(faces, half), to(faces, half));
        let longest = (3 * face..3 * face + 3).max_by(|&a, &b| length(a).total_cmp(&length(b))).expect("three edges");
        let (middle, other) = (apex(faces, longest), edges.partner[longest as usize]);
        if other != BOUNDARY && other != CROWDED && apex(faces, other) != middle {
            let neighbour = other / 3;
            if touched[neighbour as usize] {
                continue;
            }
            let (start, end, top) = (from(faces, other), to(faces, other), apex(faces, other));
            faces[neighbour as usize] = [start, middle, top];
            faces[face as usize] = [middle, end, top];
            touched[neighbour as usize] = true;
        } else {
            gone.push(face);
        }
        touched[face as usize] = true;
        removed += 1;
    }
    remove(faces, &gone);
    removed
}

fn is_zero_area(mesh: &TriMesh, face: [u32; 3]) -> bool {
    let [a, b, c] = face.map(|vertex| mesh.vertices[vertex as usize].map(f64::from));
    let (u, v): ([f64; 3], [f64; 3]) = (std::array::from_fn(|i| b[i] - a[i]), std::array::from_fn(|i| c[i] - a[i]));
    (0..3).all(|i| u[NEXT[i]] * v[NEXT[NEXT[i]]] == u[NEXT[NEXT[i]]] * v[NEXT[i]])
}

fn squared_distance(vertices: &[[f32; 3]], a: u32, b: u32) -> f64 {
    let (a, b) = (vertices[a as usize], vertices[b as usize]);
    (0..3).map(|axis| f64::from(a[axis]) - f64::from(b[axis])).map(|d| d * d).sum()
}

/// Removes the faces whose indices are listed, in ascending order.
fn remove(faces: &mut Vec<[u32; 3]>, gone: &[u32]) {
    let (mut index, mut gone) = (0, gone.iter().peekable());
    faces.retain(|_| {
        let drop = gone.next_if_eq(&&index).is_some();
        index += 1;
        !drop
    });
}

/// Result of removing faces that have the same three vertices as others.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Twins {
    /// Copies and opposite pairs dropped.
    pub(crate) duplicates: u32,
    /// Faces of second sheets dropped.
    pub(crate) sheets: u32,
    /// Area of the opposite pairs that went whole [m^2].
    pub(crate) lost_area: f64,
}

impl Twins {
    pub(crate) fn dropped(&self) -> u32 {
        self.duplicates + self.sheets
    }

    pub(crate) fn add(&mut self, more: &Self) {
        self.duplicates += more.duplicates;
        self.sheets += more.sheets;
        self.lost_area += more.lost_area;
    }
}

/// Settles faces on the same three vertices.
///
/// One of several with the same orientation stays; opposite ones cancel in pairs, because a pair encloses nothing. Where
/// every face of a body has an opposite twin, the body is a two-sided shell instead: one sheet stays.
pub(crate) fn drop_twins(mesh: &mut TriMesh, edges: &Edges) -> Twins {
    if edges.twins.is_empty() {
        return Twins::default();
    }
    // Faces on the same three vertices, in groups.
    let mut faces: Vec<u32> = edges.twins.clone();
    faces.sort_unstable();
    faces.dedup();
    let corners = |face: u32| {
        let mut corners = mesh.triangles[face as usize];
        corners.sort_unstable();
        corners
    };
    faces.sort_by_key(|&face| corners(face));
    let groups: Vec<&[u32]> =
        faces.chunk_by(|&a, &b| corners(a) == corners(b)).filter(|group| group.len() > 1).collect();

    // Orientation of a face relative to its sorted vertices; a balanced group has equal numbers of both.
    let faces_up = |face: u32| {
        let [a, b, c] = mesh.triangles[face as usize];
        (a < b) as u8 + (b < c) as u8 + (c < a) as u8 == 2
    };
    let is_balanced = |group: &[u32]| 2 * group.iter().filter(|&&face| faces_up(face)).count() == group.len();
    // Bodies with a face outside balanced groups are no two-sided shells.
    let body = bodies(mesh);
    let mut single = vec![false; mesh.vertices.len()];
    let mut balanced = vec![false; mesh.triangles.len()];
    for group in groups.iter().filter(|group| is_balanced(group)) {
        group.iter().for_each(|&face| balanced[face as usize] = true);
    }
    for (face, corners) in mesh.triangles.iter().enumerate() {
        single[body[corners[0] as usize] as usize] |= !balanced[face];
    }

    // Faces to remove: all but one of a sheet, all of a balanced group, otherwise all but one of the majority.
    let (mut gone, mut sheets, mut lost_area) = (Vec::new(), 0, 0.0);
    for group in groups {
        let is_sheet = !single[body[mesh.triangles[group[0] as usize][0] as usize] as usize];
        let up = group.iter().filter(|&&face| faces_up(face)).count();
        let keep = if is_sheet {
            sheets += group.len() as u32 - 1;
            Some(group[0])
        } else if 2 * up == group.len() {
            lost_area += area(mesh, group[0]);
            None
        } else {
            group.iter().copied().find(|&face| faces_up(face) == (2 * up > group.len()))
        };
        gone.extend(group.iter().copied().filter(|&face| Some(face) != keep));
    }
    gone.sort_unstable();
    let duplicates = gone.len() as u32 - sheets;
    remove(&mut mesh.triangles, &gone);
    Twins { duplicates, sheets, lost_area }
}

fn area(mesh: &TriMesh, face: u32) -> f64 {
    let [a, b, c] = mesh.corners(face as usize);
    (b - a).cross(&(c - a)).norm() / 2.0
}

/// Per vertex, the lowest vertex that it is connected to.
pub(crate) fn bodies(mesh: &TriMesh) -> Vec<u32> {
    let mut sets = Sets::new(mesh.vertices.len());
    for &[a, b, c] in &mesh.triangles {
        sets.unite(a, b);
        sets.unite(a, c);
    }
    (0..mesh.vertices.len() as u32).map(|vertex| sets.root(vertex)).collect()
}
