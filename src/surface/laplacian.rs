//! Laplacian smoothing of a mesh: each vertex moves to the mean of its neighbours, all at the same time (Field 1988, "Laplacian
//! smoothing and Delaunay triangulations"), with cotangent weights on request (Pinkall and Polthier 1993, "Computing discrete
//! minimal surfaces").

use kernel::geom::TriMesh;
use nalgebra::Vector3;

/// Weights by which the neighbours of a vertex count in their mean.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NeighbourWeights {
    /// All alike.
    #[default]
    Uniform,
    /// The sum of the cotangents of the two angles opposite to the edge, of the mesh as it is at each step: vertices of a flat
    /// part stay, however unevenly they lie.
    Cotangent,
}

/// Rule by which a mesh is smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaplacianRule {
    /// Steps; six in the thesis's published code.
    pub steps: u32,
    /// Weights of the neighbours.
    pub weights: NeighbourWeights,
    /// Whether a vertex of the boundary of an open mesh moves along the boundary alone, to the mean of its two neighbours there;
    /// otherwise it moves as all others do.
    pub boundary: bool,
}

impl Default for LaplacianRule {
    fn default() -> Self {
        Self { steps: 6, weights: NeighbourWeights::Uniform, boundary: false }
    }
}

impl LaplacianRule {
    /// Smooths a mesh. A vertex without neighbours stays, as one whose neighbours' weights have no sum above 0.
    pub fn smooth(&self, mesh: &mut TriMesh) {
        let edges = directed_edges(&mesh.triangles);
        let mut is_boundary = vec![false; mesh.vertices.len()];
        let single = edges.chunk_by(is_same_edge).filter(|edge| edge.len() == 1);
        single.for_each(|edge| is_boundary[edge[0].from as usize] = true);
        let mut positions: Vec<Vector3<f64>> =
            mesh.vertices.iter().map(|vertex| Vector3::from(vertex.map(f64::from))).collect();
        for _ in 0..self.steps {
            positions = self.step(&positions, &edges, &is_boundary);
        }
        mesh.vertices = positions.into_iter().map(|position| position.map(|value| value as f32).into()).collect();
    }

    fn step(&self, positions: &[Vector3<f64>], edges: &[DirectedEdge], is_boundary: &[bool]) -> Vec<Vector3<f64>> {
        let mut sums = vec![(Vector3::zeros(), 0.0); positions.len()];
        for edge in edges.chunk_by(is_same_edge) {
            let DirectedEdge { from, to, .. } = edge[0];
            let along_boundary = self.boundary && is_boundary[from as usize];
            let weight = match self.weights {
                _ if along_boundary => f64::from(u8::from(edge.len() == 1)),
                NeighbourWeights::Uniform => 1.0,
                NeighbourWeights::Cotangent => edge.iter().map(|edge| cotangent(edge, positions)).sum(),
            };
            let sum = &mut sums[from as usize];
            *sum = (sum.0 + positions[to as usize] * weight, sum.1 + weight);
        }
        let moved = |(position, (sum, weight)): (&Vector3<f64>, (Vector3<f64>, f64))| {
            if weight > 0.0 { sum / weight } else { *position }
        };
        positions.iter().zip(sums).map(moved).collect()
    }
}

/// An edge of a triangle as one of its ends sees it, with the triangle's third corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct DirectedEdge {
    from: u32,
    to: u32,
    opposite: u32,
}

fn is_same_edge(one: &DirectedEdge, other: &DirectedEdge) -> bool {
    (one.from, one.to) == (other.from, other.to)
}

/// Every edge in both directions, once per triangle that has it, sorted.
fn directed_edges(triangles: &[[u32; 3]]) -> Vec<DirectedEdge> {
    let mut edges = Vec::with_capacity(6 * triangles.len());
    for [a, b, c] in triangles {
        for (from, to, opposite) in [(*a, *b, *c), (*b, *c, *a), (*c, *a, *b)] {
            edges.push(DirectedEdge { from, to, opposite });
            edges.push(DirectedEdge { from: to, to: from, opposite });
        }
    }
    edges.sort_unstable();
    edges
}

/// Cotangent of the angle opposite to the edge; 0 in a triangle without area.
fn cotangent(edge: &DirectedEdge, positions: &[Vector3<f64>]) -> f64 {
    let [from, to, opposite] = [edge.from, edge.to, edge.opposite].map(|vertex| positions[vertex as usize]);
    let (one, other) = (from - opposite, to - opposite);
    let area = one.cross(&other).norm();
    if area > 0.0 { one.dot(&other) / area } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(steps: u32, weights: NeighbourWeights, boundary: bool) -> LaplacianRule {
        LaplacianRule { steps, weights, boundary }
    }

    /// A sheet of 7 x 7 vertices, those inside moved within it.
    fn sheet() -> TriMesh {
        let vertex = |index: u32| {
            let (x, y) = (index / 7, index % 7);
            let is_inside = (1..6).contains(&x) && (1..6).contains(&y);
            let off = |shift: u32| if is_inside { f64::from((index * 37 + shift) % 11) / 30.0 - 0.15 } else { 0.0 };
            [(f64::from(x) + off(0)) as f32, (f64::from(y) + off(5)) as f32, 0.0]
        };
        let cells = (0..6).flat_map(|x| (0..6).map(move |y| 7 * x + y));
        let triangles = cells.flat_map(|at| [[at, at + 7, at + 8], [at, at + 8, at + 1]]).collect();
        TriMesh { vertices: (0..49).map(vertex).collect(), triangles }
    }

    #[test]
    fn an_icosahedron_shrinks_by_the_root_of_five() {
        // Neighbours of a corner lie 1 / sqrt(5) of the way to it, whatever their weights are.
        let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
        let corner = |index: u32| {
            let (one, other) = (f64::from(index & 1) * 2.0 - 1.0, f64::from(index >> 1 & 1) * 2.0 - 1.0);
            let mut corner = [0.0, one, golden * other];
            corner.rotate_right(index as usize >> 2);
            corner.map(|value| value as f32)
        };
        let vertices: Vec<[f32; 3]> = (0..12).map(corner).collect();
        let apart =
            |a: usize, b: usize| (0..3).map(|axis| (vertices[a][axis] - vertices[b][axis]).powi(2)).sum::<f32>();
        let is_edge = |a: usize, b: usize| (apart(a, b) - 4.0).abs() < 1e-4;
        let mut triangles = Vec::new();
        for (a, b, c) in (0..12).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| (a, b, c)))) {
            if is_edge(a, b) && is_edge(b, c) && is_edge(a, c) {
                triangles.push([a as u32, b as u32, c as u32]);
            }
        }
        assert_eq!(triangles.len(), 20);
        for weights in [NeighbourWeights::Uniform, NeighbourWeights::Cotangent] {
            let mut mesh = TriMesh { vertices: vertices.clone(), triangles: triangles.clone() };
            rule(3, weights, false).smooth(&mut mesh);
            for (found, corner) in mesh.vertices.iter().zip(&vertices) {
                for axis in 0..3 {
                    assert!((f64::from(found[axis]) - f64::from(corner[axis]) / 5.0_f64.powf(1.5)).abs() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn cotangents_leave_what_is_flat_and_a_boundary_moves_along_itself() {
        let flat = sheet();
        let moved = |rule: LaplacianRule| {
            let mut mesh = flat.clone();
            rule.smooth(&mut mesh);
            let apart = |(one, other): (&[f32; 3], &[f32; 3])| {
                (0..3).map(|axis| (one[axis] - other[axis]).abs()).fold(0.0, f32::max)
            };
            let distances: Vec<f32> = mesh.vertices.iter().zip(&flat.vertices).map(apart).collect();
            (mesh, distances)
        };
        let is_inside = |index: &usize| (1..6).contains(&(index / 7)) && (1..6).contains(&(index % 7));
        let (_, cotangent) = moved(rule(1, NeighbourWeights::Cotangent, true));
        assert!((0..49).filter(is_inside).all(|index| cotangent[index] < 1e-5), "{cotangent:?}");
        let (mesh, uniform) = moved(rule(1, NeighbourWeights::Uniform, true));
        assert!((0..49).filter(is_inside).any(|index| uniform[index] > 0.05));
        // Along a side the mean of two neighbours is the vertex itself; a corner moves to the middle of its two.
        assert_eq!(mesh.vertices[0], [0.5, 0.5, 0.0]);
        assert_eq!((mesh.vertices[3], uniform[3]), (flat.vertices[3], 0.0));
        let (mesh, _) = moved(rule(1, NeighbourWeights::Uniform, false));
        assert!(mesh.vertices[3][0] > 0.2, "all neighbours pull it inward");
        assert_eq!(moved(rule(0, NeighbourWeights::Uniform, false)).0, flat);
    }

    #[test]
    fn vertices_of_nothing_stay() {
        let mut mesh = TriMesh { vertices: vec![[1.0, 2.0, 3.0]; 4], triangles: vec![[0, 1, 2]] };
        mesh.vertices[3] = [7.0, 8.0, 9.0];
        let before = mesh.clone();
        for weights in [NeighbourWeights::Uniform, NeighbourWeights::Cotangent] {
            rule(6, weights, false).smooth(&mut mesh);
            assert_eq!(mesh, before, "{weights:?}");
        }
        rule(6, NeighbourWeights::Uniform, true).smooth(&mut TriMesh::default());
    }
}
