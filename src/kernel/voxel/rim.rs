//! The rim of a surface: where its holes are, and caps that close them.
//!
//! An edge belongs to the rim as often as the triangles that run along it in one direction outnumber those in the
//! other. A surface without a rim is closed and its winding number is a whole number everywhere. Corners are one
//! when they lie on the same tick, so that a closed soup has no rim.
//!
//! Along a crack, strips between its two sides are caps of hardly any area; caps over each of the separated pieces
//! would be as large as the surface.

use super::columns::{Ticks, in_cells};
use crate::geom::near_groups;

/// Points of a rim are on two sides of a crack when they are nearer to each other than this share of the shortest edge at either.
const CRACK: f64 = 0.25;

/// The widest crack that is bridged [cells].
const WIDEST: f64 = 0.05;

/// Caps that close a surface, as polygons that run against its rim.
#[derive(Debug, Default, PartialEq)]
pub(super) struct RimCaps {
    /// Over holes.
    pub(super) holes: Vec<Vec<Ticks>>,
    /// Across cracks: an edge of the rim from its first corner to its second, and back on the other side.
    pub(super) strips: Vec<Vec<Ticks>>,
}

impl RimCaps {
    /// The caps of a surface; none for a closed one. Deterministic: they depend on the order of the triangles only through
    /// nothing but their positions.
    pub(super) fn of(vertices: &[Ticks], triangles: &[[u32; 3]]) -> Self {
        let (points, point_of) = merge(vertices);
        let rim = against_the_rim(triangles, &point_of);
        if rim.is_empty() {
            return Self::default();
        }
        let across = across_cracks(&points, &rim, triangles, &point_of);
        let placed = |polygon: Vec<u32>| polygon.into_iter().map(|corner| points[corner as usize]).collect();
        let strips = rim.iter().filter_map(|edge| strip(*edge, &across)).map(placed).collect();
        // The remaining rim after its cracks are closed.
        let left: Vec<[u32; 2]> = rim.iter().map(|edge| edge.map(|end| across[end as usize])).collect();
        let holes = loops(&without_opposites(left), points.len()).into_iter().map(placed).collect();
        Self { holes, strips }
    }

    /// All polygons.
    pub(super) fn polygons(self) -> Vec<Vec<Ticks>> {
        self.strips.into_iter().chain(self.holes).collect()
    }
}

/// The polygon between an edge and its image across its crack; `None` where there is no crack.
fn strip([from, to]: [u32; 2], across: &[u32]) -> Option<Vec<u32>> {
    let mut strip = vec![from, to];
    strip.extend([across[to as usize], across[from as usize]].into_iter().filter(|point| ![from, to].contains(point)));
    strip.dedup();
    (strip.len() > 2).then_some(strip)
}

/// For each point, the representative of all points around it across cracks; the point itself where there is no crack.
fn across_cracks(points: &[Ticks], rim: &[[u32; 2]], triangles: &[[u32; 3]], point_of: &[u32]) -> Vec<u32> {
    let mut shortest = vec![f64::INFINITY; points.len()];
    for triangle in triangles {
        let corners = triangle.map(|vertex| point_of[vertex as usize]);
        for edge in [[corners[0], corners[1]], [corners[1], corners[2]], [corners[2], corners[0]]] {
            let [from, to] = edge.map(|end| in_cells(points[end as usize]));
            let length = libm::sqrt((0..3).map(|axis| (to[axis] - from[axis]) * (to[axis] - from[axis])).sum());
            edge.iter().for_each(|end| shortest[*end as usize] = shortest[*end as usize].min(length));
        }
    }
    let mut on_rim: Vec<u32> = rim.iter().map(|edge| edge[0]).collect();
    on_rim.sort_unstable();
    on_rim.dedup();
    let positions: Vec<[f64; 3]> = on_rim.iter().map(|point| in_cells(points[*point as usize])).collect();
    let reaches: Vec<f64> = on_rim.iter().map(|point| (CRACK * shortest[*point as usize]).min(WIDEST)).collect();
    let mut across: Vec<u32> = (0..points.len() as u32).collect();
    // In a crowd each piece has its own cap.
    for (point, group) in on_rim.iter().zip(near_groups(&positions, &reaches).into_iter().flatten()) {
        across[*point as usize] = on_rim[group as usize];
    }
    across
}

/// Closed paths along edges, of which equal numbers enter and leave each point.
fn loops(edges: &[[u32; 2]], points: usize) -> Vec<Vec<u32>> {
    let mut next = vec![Vec::new(); points];
    edges.iter().for_each(|[from, to]| next[*from as usize].push(*to));
    let mut loops = Vec::new();
    let mut step_of = vec![usize::MAX; points];
    let mut path: Vec<u32> = Vec::new();
    // A walk only ends where it began; each time it meets itself, one simple polygon is cut off.
    for start in 0..points {
        let mut point = start;
        loop {
            if step_of[point] != usize::MAX {
                let polygon = path.split_off(step_of[point]);
                polygon.iter().for_each(|corner| step_of[*corner as usize] = usize::MAX);
                loops.push(polygon);
            }
            let Some(target) = next[point].pop() else { break };
            step_of[point] = path.len();
            path.push(point as u32);
            point = target as usize;
        }
    }
    debug_assert!(path.is_empty());
    loops
}

/// Different positions, sorted, and for each vertex the index of its position.
fn merge(vertices: &[Ticks]) -> (Vec<Ticks>, Vec<u32>) {
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.sort_unstable_by_key(|vertex| vertices[*vertex as usize]);
    let mut points: Vec<Ticks> = Vec::with_capacity(vertices.len());
    let mut point_of = vec![0; vertices.len()];
    for vertex in order {
        if points.last() != Some(&vertices[vertex as usize]) {
            points.push(vertices[vertex as usize]);
        }
        point_of[vertex as usize] = points.len() as u32 - 1;
    }
    (points, point_of)
}

/// The edges of the rim, run backwards, each once per surplus.
fn against_the_rim(triangles: &[[u32; 3]], point_of: &[u32]) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| point_of[vertex as usize]);
        edges.extend([[b, a], [c, b], [a, c]]);
    }
    without_opposites(edges)
}

/// Edges after opposite ones cancel, in ascending order of their ends; without those from a point to itself.
fn without_opposites(edges: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    let runs = edges.into_iter().filter(|[from, to]| from != to);
    let mut runs: Vec<(u32, u32, i32)> =
        runs.map(|[from, to]| (from.min(to), from.max(to), if from < to { 1 } else { -1 })).collect();
    runs.sort_unstable();
    let mut left = Vec::new();
    for same in runs.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let surplus: i32 = same.iter().map(|run| run.2).sum();
        let edge = if surplus > 0 { [same[0].0, same[0].1] } else { [same[0].1, same[0].0] };
        left.extend((0..surplus.abs()).map(|_| edge));
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(n: u32) -> (Vec<Ticks>, Vec<[u32; 3]>) {
        let vertices = (0..n * n).map(|i| [(i / n) as i32, (i % n) as i32, 0]).collect();
        let squares = (0..n - 1).flat_map(|x| (0..n - 1).map(move |y| x * n + y));
        (vertices, squares.flat_map(|a| [[a, a + n, a + n + 1], [a, a + n + 1, a + 1]]).collect())
    }

    #[test]
    fn a_sheet_has_one_rim_and_two_holes_that_touch_have_two() {
        let (vertices, mut triangles) = grid(6);
        let sizes = |caps: RimCaps| caps.polygons().iter().map(Vec::len).collect::<Vec<_>>();
        assert_eq!(sizes(RimCaps::of(&vertices, &triangles)), [20]);
        // Squares (1, 1) and (2, 2) touch in one corner.
        triangles.retain(|triangle| triangle[0] != 7 && triangle[0] != 14);
        let mut found = sizes(RimCaps::of(&vertices, &triangles));
        found.sort_unstable();
        assert_eq!(found, [4, 4, 20]);
    }

    #[test]
    fn a_closed_soup_has_no_rim_and_one_face_short_has_that_face() {
        let corners = [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let soup: Vec<Ticks> = faces.iter().flatten().map(|corner| corners[*corner]).collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
        assert_eq!(RimCaps::of(&soup, &triangles), RimCaps::default());
        let loops = RimCaps::of(&soup, &triangles[..3]).holes;
        assert_eq!(loops.len(), 1);
        // The cap is wound as the missing face was: it holds the same edges, in the same direction.
        let missing = faces[3].map(|corner| corners[corner]);
        let start = loops[0].iter().position(|corner| *corner == missing[0]).unwrap();
        assert_eq!(std::array::from_fn(|i| loops[0][(start + i) % 3]), missing);
    }
}
