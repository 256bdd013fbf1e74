//! Open boxes as meshes: bins, trays, crates.

use super::TriMesh;

impl TriMesh {
    /// A box without a lid, of walls and a floor of one thickness [m]: closed and wound outward. `inner` is the room inside
    /// [m]; the origin is the middle of its floor, z up.
    pub fn open_box(inner: [f64; 3], wall: f64) -> Self {
        let [x, y, z] = [inner[0] / 2.0, inner[1] / 2.0, inner[2]];
        // Four corners of a level, counterclockwise from above.
        let level = |[x, y]: [f64; 2], z: f64| [[-x, -y, z], [x, -y, z], [x, y, z], [-x, y, z]];
        let outer = [x + wall, y + wall];
        let levels = [level(outer, -wall), level(outer, z), level([x, y], z), level([x, y], 0.0)];
        let vertices = levels.iter().flatten().map(|corner| corner.map(|v| v as f32)).collect();
        // From one level to the next: outside upward, across the rim, inside downward.
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        for ring in 0..3 {
            for side in 0..4 {
                let next = (side + 1) % 4;
                let [a, b, c, d] = [4 * ring + side, 4 * ring + next, 4 * ring + 4 + next, 4 * ring + 4 + side];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        // The floor from above, and from below.
        triangles.extend([[12, 13, 14], [12, 14, 15], [0, 2, 1], [0, 3, 2]]);
        Self { vertices, triangles }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_open_box_is_closed_and_has_the_volume_of_its_walls() {
        let (inner, wall) = ([0.4, 0.3, 0.2], 0.02);
        let mesh = TriMesh::open_box(inner, wall);
        let whole = (inner[0] + 2.0 * wall) * (inner[1] + 2.0 * wall) * (inner[2] + wall);
        let expected = whole - inner[0] * inner[1] * inner[2];
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
