//! Open boxes and walls as meshes: bins, trays, crates, fences.

use super::TriMesh;

impl TriMesh {
    /// A box without a lid, of walls and a floor of one thickness [m]: closed and wound outward. `inner` is the room inside
    /// [m]; the origin is the middle of its floor, z up.
    pub fn open_box(inner: [f64; 3], wall: f64) -> Self {
        let [x, y, z] = [inner[0] / 2.0, inner[1] / 2.0, inner[2]];
        let outer = [x + wall, y + wall];
        let levels = [level(outer, -wall), level(outer, z), level([x, y], z), level([x, y], 0.0)];
        // From one level to the next: outside upward, across the rim, inside downward.
        let mut triangles: Vec<[u32; 3]> = (0..3).flat_map(|ring| strip(ring, ring + 1)).collect();
        // The floor from above, and from below.
        triangles.extend([[12, 13, 14], [12, 14, 15], [0, 2, 1], [0, 3, 2]]);
        Self { vertices: vertices(&levels), triangles }
    }

    /// Four walls of one thickness around a room without floor and lid [m]: closed and wound outward. `inner` is the room
    /// inside [m]; the origin is the middle of its foot, z up.
    pub fn walls(inner: [f64; 3], wall: f64) -> Self {
        let [x, y, z] = [inner[0] / 2.0, inner[1] / 2.0, inner[2]];
        let outer = [x + wall, y + wall];
        let levels = [level(outer, 0.0), level(outer, z), level([x, y], z), level([x, y], 0.0)];
        // Outside upward, across the rim, inside downward, across the foot.
        let triangles = (0..4).flat_map(|ring| strip(ring, (ring + 1) % 4)).collect();
        Self { vertices: vertices(&levels), triangles }
    }
}

/// Four corners of a level, counterclockwise from above.
fn level([x, y]: [f64; 2], z: f64) -> [[f64; 3]; 4] {
    [[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]]
}

fn vertices(levels: &[[[f64; 3]; 4]]) -> Vec<[f32; 3]> {
    levels.iter().flatten().map(|corner| corner.map(|v| v as f32)).collect()
}

/// Triangles from one level to another, by their numbers.
fn strip(from: u32, to: u32) -> [[u32; 3]; 8] {
    std::array::from_fn(|index| {
        let side = index as u32 / 2;
        let next = (side + 1) % 4;
        let [a, b, c, d] = [4 * from + side, 4 * from + next, 4 * to + next, 4 * to + side];
        if index % 2 == 0 { [a, b, c] } else { [a, c, d] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_boxes_and_walls_are_closed_and_have_the_volume_of_what_they_are_made_of() {
        let (inner, wall) = ([0.4, 0.3, 0.2], 0.02);
        let around = (inner[0] + 2.0 * wall) * (inner[1] + 2.0 * wall);
        let room = inner[0] * inner[1] * inner[2];
        assert_closed(&TriMesh::open_box(inner, wall), around * (inner[2] + wall) - room);
        assert_closed(&TriMesh::walls(inner, wall), around * inner[2] - room);
    }

    fn assert_closed(mesh: &TriMesh, expected: f64) {
        assert!((mesh.signed_volume() / expected - 1.0).abs() < 1e-6, "{} {expected}", mesh.signed_volume());
        // Every edge is passed once in each direction.
        let mut edges = std::collections::BTreeSet::new();
        for [a, b, c] in &mesh.triangles {
            for edge in [[a, b], [b, c], [c, a]] {
                assert!(edges.insert(edge), "{edge:?} twice");
            }
        }
        assert!(edges.iter().all(|[a, b]| edges.contains(&[*b, *a])));
    }
}
