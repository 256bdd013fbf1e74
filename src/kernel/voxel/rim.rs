//! The rim of a surface: where its holes are, and caps that close them.
//!
//! An edge belongs to the rim as often as the triangles that run along it in one direction outnumber those in the
//! other. A surface without a rim is closed and its winding number is a whole number everywhere. Corners are one
//! when they lie on the same tick, so that a closed soup has no rim.

use super::columns::Ticks;

/// Closed polygons that run against the rim: caps over them close the surface. Empty for a closed surface. Deterministic: it
/// depends on the order of the triangles only through nothing but their positions.
pub(super) fn rim_loops(vertices: &[Ticks], triangles: &[[u32; 3]]) -> Vec<Vec<Ticks>> {
    let (points, point_of) = merge(vertices);
    let mut next = against_the_rim(triangles, &point_of, points.len());
    let mut loops = Vec::new();
    let mut step_of = vec![usize::MAX; points.len()];
    let mut path: Vec<u32> = Vec::new();
    // As many rim edges come to a point as leave it, so that a walk only ends where it began; each time it meets
    // itself, one simple polygon is cut off.
    for start in 0..points.len() {
        let mut point = start;
        loop {
            if step_of[point] != usize::MAX {
                let polygon = path.split_off(step_of[point]);
                polygon.iter().for_each(|corner| step_of[*corner as usize] = usize::MAX);
                loops.push(polygon.iter().map(|corner| points[*corner as usize]).collect());
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

/// Different positions, sorted, and for each vertex the index of its own.
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

/// For each point, the points that a rim edge leads to, run backwards, once per surplus.
fn against_the_rim(triangles: &[[u32; 3]], point_of: &[u32], points: usize) -> Vec<Vec<u32>> {
    let mut edges: Vec<(u32, u32, i32)> = Vec::with_capacity(3 * triangles.len());
    for triangle in triangles {
        let corners = triangle.map(|vertex| point_of[vertex as usize]);
        for corner in 0..3 {
            let (a, b) = (corners[corner], corners[(corner + 1) % 3]);
            if a != b {
                edges.push((a.min(b), a.max(b), if a < b { 1 } else { -1 }));
            }
        }
    }
    edges.sort_unstable();
    let mut next = vec![Vec::new(); points];
    for same in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let surplus: i32 = same.iter().map(|edge| edge.2).sum();
        let (from, to) = if surplus > 0 { (same[0].1, same[0].0) } else { (same[0].0, same[0].1) };
        next[from as usize].extend((0..surplus.abs()).map(|_| to));
    }
    next
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
        assert_eq!(rim_loops(&vertices, &triangles).iter().map(Vec::len).collect::<Vec<_>>(), [20]);
        // Squares (1, 1) and (2, 2) touch in one corner.
        triangles.retain(|triangle| triangle[0] != 7 && triangle[0] != 14);
        let mut sizes: Vec<usize> = rim_loops(&vertices, &triangles).iter().map(Vec::len).collect();
        sizes.sort_unstable();
        assert_eq!(sizes, [4, 4, 20]);
    }

    #[test]
    fn a_closed_soup_has_no_rim_and_one_face_short_has_that_face() {
        let corners = [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 0, 9]];
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let soup: Vec<Ticks> = faces.iter().flatten().map(|corner| corners[*corner]).collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
        assert!(rim_loops(&soup, &triangles).is_empty());
        let loops = rim_loops(&soup, &triangles[..3]);
        assert_eq!(loops.len(), 1);
        // The cap is wound as the missing face was: it holds the same edges, in the same direction.
        let missing = faces[3].map(|corner| corners[corner]);
        let start = loops[0].iter().position(|corner| *corner == missing[0]).unwrap();
        assert_eq!(std::array::from_fn(|i| loops[0][(start + i) % 3]), missing);
    }
}
