//! Meshes in smaller triangles.

use std::collections::BTreeMap;

use super::TriMesh;

/// Longest edge of a mesh whose triangles MuJoCo touches one by one [m]: solids of hands pass through longer ones
/// (docs/benchmarks.md has the measurements).
pub const TOUCHED_EDGE: f64 = 0.006;

/// Where there would be too many triangles, edges may be longer by this factor.
const COARSER: f64 = 1.5;

impl TriMesh {
    /// Returns this surface with no edge longer than `longest` [m]: longer edges are halved repeatedly. Two triangles
    /// that share an edge share its new vertex, so that a closed surface stays closed. The vertices of the mesh stay
    /// and come first. If that takes more than `max_triangles`, the limit on the length is raised by half, repeatedly;
    /// returns the mesh itself if it has more.
    ///
    /// # Panics
    /// When `longest` is not positive.
    #[must_use]
    pub fn with_short_edges(&self, longest: f64, max_triangles: usize) -> Self {
        assert!(longest > 0.0, "edges of {longest} m");
        let mut longest = longest;
        loop {
            let mut mesh = self.clone();
            // No edge is halved once `longest` reaches the longest edge.
            if mesh.halve_edges(longest, max_triangles) {
                return mesh;
            }
            longest *= COARSER;
        }
    }

    /// Halves edges that are longer than `longest` [m] until there are none; false where that makes too many triangles.
    fn halve_edges(&mut self, longest: f64, max_triangles: usize) -> bool {
        loop {
            let middles = self.middles(longest);
            if middles.is_empty() {
                return true;
            }
            let middle = |one: u32, other: u32| middles.get(&[one.min(other), one.max(other)]).copied();
            // Every halved edge of a triangle makes one triangle more of it.
            let halved_edges =
                |[a, b, c]: &[u32; 3]| [middle(*a, *b), middle(*b, *c), middle(*c, *a)].iter().flatten().count();
            let count: usize = self.triangles.iter().map(|triangle| 1 + halved_edges(triangle)).sum();
            if count > max_triangles {
                return false;
            }
            self.vertices.resize(self.vertices.len() + middles.len(), [0.0; 3]);
            for ([one, other], at) in &middles {
                self.vertices[*at as usize] = midpoint(self.vertices[*one as usize], self.vertices[*other as usize]);
            }
            let mut triangles = Vec::with_capacity(count);
            for triangle in std::mem::take(&mut self.triangles) {
                self.add_parts(triangle, &middle, &mut triangles);
            }
            self.triangles = triangles;
        }
    }

    /// A new vertex for each edge that is longer than `longest` [m], numbered on from the mesh's vertices.
    fn middles(&self, longest: f64) -> BTreeMap<[u32; 2], u32> {
        let mut middles = BTreeMap::new();
        for [a, b, c] in &self.triangles {
            for [one, other] in [[*a, *b], [*b, *c], [*c, *a]] {
                if self.squared_length(one, other) > longest * longest {
                    let next = (self.vertices.len() + middles.len()) as u32;
                    middles.entry([one.min(other), one.max(other)]).or_insert(next);
                }
            }
        }
        middles
    }

    fn squared_length(&self, one: u32, other: u32) -> f64 {
        let [one, other] = [one, other].map(|vertex| self.vertices[vertex as usize].map(f64::from));
        (0..3).map(|axis| (one[axis] - other[axis]) * (one[axis] - other[axis])).sum()
    }

    /// Adds the parts of a triangle, wound as it is, some of whose edges have a vertex in their middle.
    fn add_parts(&self, [a, b, c]: [u32; 3], middle: &impl Fn(u32, u32) -> Option<u32>, parts: &mut Vec<[u32; 3]>) {
        // Begin at the corner before the halved edge, or between the two.
        let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
        match (ab, bc, ca) {
            (None, None, None) => parts.push([a, b, c]),
            (Some(ab), Some(bc), Some(ca)) => parts.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]),
            (Some(ab), None, None) => parts.extend([[a, ab, c], [ab, b, c]]),
            (None, Some(bc), None) => parts.extend([[b, bc, a], [bc, c, a]]),
            (None, None, Some(ca)) => parts.extend([[c, ca, b], [ca, a, b]]),
            (Some(ab), Some(bc), None) => self.add_corner([b, c, a], [bc, ab], parts),
            (None, Some(bc), Some(ca)) => self.add_corner([c, a, b], [ca, bc], parts),
            (Some(ab), None, Some(ca)) => self.add_corner([a, b, c], [ab, ca], parts),
        }
    }

    /// Adds the parts of a triangle whose edges from its first corner to the second and to the third have these middles: a corner,
    /// and a quadrangle cut along its shorter diagonal.
    fn add_corner(&self, [a, b, c]: [u32; 3], [ab, ca]: [u32; 2], parts: &mut Vec<[u32; 3]>) {
        parts.push([a, ab, ca]);
        if self.squared_length(ab, c) < self.squared_length(ca, b) {
            parts.extend([[ab, b, c], [ab, c, ca]]);
        } else {
            parts.extend([[ab, b, ca], [b, c, ca]]);
        }
    }
}

/// The middle of an edge, the same from either end.
fn midpoint(one: [f32; 3], other: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|axis| f64::midpoint(f64::from(one[axis]), f64::from(other[axis])) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::built_in;

    /// The area of all triangles [m^2].
    fn area(mesh: &TriMesh) -> f64 {
        let corners = (0..mesh.triangles.len()).map(|triangle| mesh.corners(triangle));
        corners.map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0).sum()
    }

    /// Whether every edge is passed as often in one direction as in the other.
    fn is_closed(mesh: &TriMesh) -> bool {
        let mut edges = BTreeMap::<[u32; 2], i32>::new();
        for [a, b, c] in &mesh.triangles {
            for [one, other] in [[*a, *b], [*b, *c], [*c, *a]] {
                *edges.entry([one.min(other), one.max(other)]).or_default() += if one < other { 1 } else { -1 };
            }
        }
        edges.values().all(|sum| *sum == 0)
    }

    fn longest_edge(mesh: &TriMesh) -> f64 {
        let edges = mesh.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        edges.map(|[one, other]| mesh.squared_length(one, other)).fold(0.0, f64::max).sqrt()
    }

    #[test]
    fn smaller_triangles_have_the_same_surface() {
        for name in ["box-01", "bottle-01", "can-01", "mug-01"] {
            let mesh = built_in(name);
            assert!(is_closed(&mesh), "{name}");
            for longest in [0.02, 0.006, 0.003] {
                let fine = mesh.with_short_edges(longest, 1_000_000);
                assert!(longest_edge(&fine) <= longest && is_closed(&fine), "{name} {longest}");
                assert_eq!(fine.vertices[..mesh.vertices.len()], mesh.vertices);
                let [before, after] = [&mesh, &fine].map(area);
                assert!((after / before - 1.0).abs() < 1e-6, "{name} {longest}: {before} {after}");
                let volumes = [&mesh, &fine].map(TriMesh::signed_volume);
                assert!((volumes[1] / volumes[0] - 1.0).abs() < 1e-6, "{name} {longest}: {volumes:?}");
                // Nothing is left to do.
                assert_eq!(fine.with_short_edges(longest, fine.triangles.len()), fine);
            }
        }
    }

    #[test]
    fn there_are_no_more_triangles_than_asked_for() {
        let mesh = TriMesh::open_box([0.1, 0.06, 0.05], 0.004);
        let fine = mesh.with_short_edges(0.001, 2_000);
        assert!(fine.triangles.len() > 500 && fine.triangles.len() <= 2_000, "{}", fine.triangles.len());
        assert!(is_closed(&fine) && longest_edge(&fine) < longest_edge(&mesh));
        assert_eq!(mesh.with_short_edges(0.001, 1), mesh);
    }
}
