//! Seams: vertices along open edges that are one but for rounding.
//!
//! Many programs write every face, or every patch of a surface, with separate vertices, and rounding moves them apart.
//! A vertex at an edge of a single face is joined with the others at such edges within [`SHARE`] of the mesh's longest
//! side, at the position of one of them. No other vertex is joined: a closed surface keeps every feature, however thin.
//! The two ends of a side stay apart, so that every face keeps its corners. Joining opens no edge, because the sides of
//! the faces that meet in an edge are those that met in its parts before.

use std::collections::HashMap;

use kernel::geom::near_groups;

/// Vertices within this share of the mesh's longest side are one where the surface is open: single precision resolves a
/// sixteenth of it, and a cell of the finest grid is 4,000 times as wide.
pub(crate) const SHARE: f64 = 1e-6;

/// Faces of any number of corners.
pub(crate) struct Polygons<'a> {
    /// Corners of all faces, one after the other.
    pub(crate) corners: &'a mut [u32],
    /// Where each face ends in `corners`.
    pub(crate) ends: &'a [u32],
}

/// Findings about the seams of a mesh.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Seams {
    /// Vertices that became one with another of the same position.
    pub(crate) equal: usize,
    /// Vertices that became one with another within rounding.
    pub(crate) near: usize,
    /// Edges that one side of one face runs along, the lower vertex first, in rising order.
    pub(crate) open: Vec<[u32; 2]>,
    /// Within how far of each other vertices are one, in the unit of the positions.
    pub(crate) reach: f64,
    /// There were too many vertices within that distance of each other to tell which are one.
    pub(crate) is_crowd: bool,
}

impl Seams {
    /// Joins the vertices at the seams of a mesh. Faces then name the lowest of the joined vertices; no face names the
    /// others.
    pub(crate) fn join(positions: &mut [[f64; 3]], polygons: &mut Polygons) -> Self {
        let reach = SHARE * longest_side(positions, polygons.corners);
        let mut seams = Self { open: open_edges(polygons, positions.len()), reach, ..Self::default() };
        if seams.open.is_empty() {
            return seams;
        }
        let vertices = vertices_of(&seams.open, positions);
        let mut first = HashMap::with_capacity(vertices.len());
        // -0 is 0.
        let bits = |vertex: u32| positions[vertex as usize].map(|coordinate| (coordinate + 0.0).to_bits());
        let equal: Vec<[u32; 2]> =
            vertices.iter().map(|&vertex| [vertex, *first.entry(bits(vertex)).or_insert(vertex)]).collect();
        seams.equal = rename(polygons.corners, &equal, positions.len());
        if seams.equal > 0 {
            seams.open = open_edges(polygons, positions.len());
        }
        seams.join_near(positions, polygons);
        seams
    }

    fn join_near(&mut self, positions: &mut [[f64; 3]], polygons: &mut Polygons) {
        let vertices = vertices_of(&self.open, positions);
        if vertices.is_empty() || self.reach <= 0.0 {
            return;
        }
        let points: Vec<[f64; 3]> = vertices.iter().map(|&vertex| positions[vertex as usize]).collect();
        let Some(mut groups) = near_groups(&points, &vec![self.reach; points.len()]) else {
            self.is_crowd = true;
            return;
        };
        part_sides(polygons, &vertices, &mut groups, positions.len());
        // The smallest position of a group is kept, for any order of vertices.
        for (point, &group) in points.iter().zip(&groups) {
            let kept = &mut positions[vertices[group as usize] as usize];
            if is_less(point, kept) {
                *kept = *point;
            }
        }
        let near: Vec<[u32; 2]> =
            vertices.iter().zip(&groups).map(|(&vertex, &group)| [vertex, vertices[group as usize]]).collect();
        self.near = rename(polygons.corners, &near, positions.len());
        if self.near > 0 {
            self.open = open_edges(polygons, positions.len());
        }
    }

    /// Whether the edge between two vertices belongs to one side of one face alone.
    pub(crate) fn is_open(&self, a: u32, b: u32) -> bool {
        self.open.binary_search(&[a.min(b), a.max(b)]).is_ok()
    }
}

fn is_less(a: &[f64; 3], b: &[f64; 3]) -> bool {
    let differs = (0..3).map(|axis| a[axis].total_cmp(&b[axis])).find(|order| order.is_ne());
    differs.is_some_and(std::cmp::Ordering::is_lt)
}

/// Longest side of the box of the vertices that faces name; positions that are not finite count to no box.
fn longest_side(positions: &[[f64; 3]], corners: &[u32]) -> f64 {
    let mut ranges = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for &corner in corners {
        for (range, coordinate) in ranges.iter_mut().zip(positions[corner as usize]) {
            if coordinate.is_finite() {
                *range = [range[0].min(coordinate), range[1].max(coordinate)];
            }
        }
    }
    ranges.iter().map(|[low, high]| high - low).filter(|side| side.is_finite()).fold(0.0, f64::max)
}

/// Takes the groups apart that hold both ends of a side: joining them would cost the faces at it. `groups` has the group of each of
/// `vertices`, by its first place among them.
fn part_sides(polygons: &Polygons, vertices: &[u32], groups: &mut [u32], positions: usize) {
    const NONE: u32 = u32::MAX;
    let mut group_of = vec![NONE; positions];
    vertices.iter().zip(groups.iter()).for_each(|(&vertex, &group)| group_of[vertex as usize] = group);
    let mut has_side = vec![false; groups.len()];
    each_side(polygons, |a, b| {
        let [one, other] = [a, b].map(|vertex| group_of[vertex as usize]);
        if one != NONE && one == other {
            has_side[one as usize] = true;
        }
    });
    for (group, place) in groups.iter_mut().zip(0..) {
        if has_side[*group as usize] {
            *group = place;
        }
    }
}

/// The vertices at some edges whose positions are finite, in rising order.
fn vertices_of(edges: &[[u32; 2]], positions: &[[f64; 3]]) -> Vec<u32> {
    let is_finite = |vertex: &u32| positions[*vertex as usize].iter().all(|coordinate| coordinate.is_finite());
    let mut vertices: Vec<u32> = edges.iter().flatten().copied().filter(is_finite).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// Renames vertices, each pair from its first to its second; returns how many have a new name.
fn rename(corners: &mut [u32], names: &[[u32; 2]], vertices: usize) -> usize {
    let renamed = names.iter().filter(|[old, new]| old != new).count();
    if renamed > 0 {
        let mut name_of: Vec<u32> = (0..vertices as u32).collect();
        names.iter().for_each(|&[old, new]| name_of[old as usize] = new);
        corners.iter_mut().for_each(|corner| *corner = name_of[*corner as usize]);
    }
    renamed
}

/// Edges that a single side of a single face runs along, the lower vertex first, in rising order.
///
/// Sides are dealt into one bucket per lower vertex, and each bucket is sorted, as the edges of triangles are found.
fn open_edges(polygons: &Polygons, vertices: usize) -> Vec<[u32; 2]> {
    let mut ends = vec![0_u32; vertices + 1];
    each_side(polygons, |a, b| ends[a.min(b) as usize] += 1);
    let mut total = 0;
    for end in &mut ends {
        total += *end;
        *end = total - *end;
    }
    let mut others = vec![0_u32; total as usize];
    each_side(polygons, |a, b| {
        let end = &mut ends[a.min(b) as usize];
        others[*end as usize] = a.max(b);
        *end += 1;
    });
    let (mut open, mut start) = (Vec::new(), 0);
    for (lower, &end) in (0..).zip(&ends[..vertices]) {
        let bucket = &mut others[start..end as usize];
        start = end as usize;
        bucket.sort_unstable();
        open.extend(bucket.chunk_by(|a, b| a == b).filter(|edge| edge.len() == 1).map(|edge| [lower, edge[0]]));
    }
    open
}

/// Calls `visit` with the two vertices of every side that has a length.
fn each_side(polygons: &Polygons, mut visit: impl FnMut(u32, u32)) {
    let mut start = 0;
    for &end in polygons.ends {
        let face = &polygons.corners[start..end as usize];
        start = end as usize;
        let mut last = face[face.len() - 1];
        for &corner in face {
            if corner != last {
                visit(last, corner);
            }
            last = corner;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cube of side 1 whose six faces have separate corners, each moved by up to `by` along every axis.
    fn cube_of_patches(by: f64) -> (Vec<[f64; 3]>, Vec<u32>, Vec<u32>) {
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut state = 7_u32;
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX)
        };
        let mut positions = Vec::new();
        for corner in quads.into_iter().flatten() {
            positions.push(std::array::from_fn(|axis| f64::from(corner >> axis & 1) + by * draw()));
        }
        (positions, (0..24).collect(), (1..=6).map(|face| 4 * face).collect())
    }

    fn join((mut positions, mut corners, ends): (Vec<[f64; 3]>, Vec<u32>, Vec<u32>)) -> (Seams, Vec<[f64; 3]>) {
        let seams = Seams::join(&mut positions, &mut Polygons { corners: &mut corners, ends: &ends });
        (seams, corners.iter().map(|corner| positions[*corner as usize]).collect())
    }

    #[test]
    fn patches_within_rounding_become_one_surface_and_others_stay_apart() {
        for (by, equal, near, open) in [(0.0, 16, 0, 0), (0.5e-6, 0, 16, 0), (1e-4, 0, 0, 24)] {
            let (seams, _) = join(cube_of_patches(by));
            assert_eq!((seams.equal, seams.near, seams.open.len()), (equal, near, open), "{by}");
        }
    }

    #[test]
    fn the_order_of_vertices_and_faces_does_not_matter() {
        let (positions, corners, ends) = cube_of_patches(0.5e-6);
        let (_, forth) = join((positions.clone(), corners.clone(), ends.clone()));
        let (_, back) = join((
            positions.iter().rev().copied().collect(),
            corners.iter().rev().map(|corner| 23 - corner).collect(),
            ends,
        ));
        let sorted = |mut corners: Vec<[f64; 3]>| {
            corners.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
            corners
        };
        assert_eq!(sorted(forth), sorted(back));
    }

    /// One vertex so far off that all others are within a millionth of the longest side of each other.
    #[test]
    fn the_ends_of_a_side_stay_apart() {
        let mut positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1e9]];
        let mut corners = vec![0, 1, 3, 1, 2, 3, 2, 0, 3];
        let seams = Seams::join(&mut positions, &mut Polygons { corners: &mut corners, ends: &[3, 6, 9] });
        assert_eq!((seams.equal, seams.near, seams.open.len()), (0, 0, 3));
        assert_eq!(corners, [0, 1, 3, 1, 2, 3, 2, 0, 3]);
    }

    #[test]
    fn a_closed_sheet_thinner_than_rounding_keeps_its_thickness() {
        let (mut positions, mut corners, ends) = cube_of_patches(0.0);
        positions.iter_mut().for_each(|position| position[2] *= 1e-7);
        let seams = Seams::join(&mut positions, &mut Polygons { corners: &mut corners, ends: &ends });
        // The corners of the patches are equal; then nothing is open.
        assert_eq!((seams.equal, seams.near, seams.open.len()), (16, 0, 0));
    }
}
