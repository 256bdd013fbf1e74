//! Divergence of two surfaces by their geodesic distances (Hamza and Krim 2003, "Geodesic object representation and recognition"):
//! each point of a surface has a mean geodesic distance from all others, and two surfaces are compared by the densities of these
//! means. It needs no alignment, and tells apart what is joined in other ways: a mug whose handle is closed from one whose is not.
//!
//! Distances are those of shortest paths in a graph (Lanthier, Maheshwari and Sack 1997, "Approximating weighted shortest paths on
//! polyhedral surfaces"): its nodes are the mesh's vertices and points along its edges, and all nodes of a triangle are joined by
//! straight lines.

use std::{
    cmp::Ordering,
    collections::{BTreeMap, BinaryHeap},
    f64::consts::PI,
};

use kernel::{
    geom::{NoSurface, TriMesh},
    seed::Stream,
};
use nalgebra::{Point3, Vector6};

use crate::surfaces::{SurfacePoint, SurfaceRule, surface_points};

/// Points along each edge, beside its ends, at least.
const PER_EDGE: usize = 2;
/// Two neighbours along an edge are so near to each other, at most, as a share of the mesh's longest side.
const SPACING: f64 = 1.0 / 60.0;
/// Maximum number of source points of distances; each represents the points around it.
const SOURCES: usize = 100;
/// Rounds in which source points move to the middle of the points that they represent (Lloyd 1982).
const ROUNDS: usize = 3;
/// Distance between two points that counts as much as opposite normals, as a share of the longest side: a point on one side of a
/// wall does not represent those on the other.
const OPPOSITE: f64 = 0.5;
/// Smallest width of the kernels as a share of the longest side: mean distances on a ball are all one number.
const SMALLEST_WIDTH: f64 = 0.01;
/// Steps of the densities per width of a kernel, and the widths beyond the last point at which they end.
const STEPS_PER_WIDTH: f64 = 8.0;
const WIDTHS_BEYOND: f64 = 4.0;

/// A true surface, prepared for comparisons with several found ones by their mean geodesic distances.
pub struct TrueGeodesics {
    truth: MeanDistances,
    floor: f64,
    rule: SurfaceRule,
    id: Vec<u8>,
}

impl TrueGeodesics {
    /// Prepares a mesh. `rule` sets the number of compared points per mesh, and their seed; `id` names the sample that the
    /// meshes belong to. Points of a part that nothing joins to others are compared with those of that part alone.
    ///
    /// # Errors
    /// When it has no triangles.
    ///
    /// # Panics
    /// When the rule has no points.
    pub fn new(mesh: &TriMesh, rule: SurfaceRule, id: &[u8]) -> Result<Self, NoSurface> {
        assert!(rule.samples > 0, "means of some points at least");
        let [truth, again] = ["points of the true surface", "other points of the true surface"]
            .map(|name| MeanDistances::new(mesh, &rule, id, name));
        let (truth, again) = (truth?, again?);
        Ok(Self { floor: divergence(&truth, &again), truth, rule, id: id.to_owned() })
    }

    /// Divergence between two samplings of the true surface: a smaller difference is not significant.
    pub fn floor(&self) -> f64 {
        self.floor
    }

    /// Jensen-Shannon divergence, base 2 and so from 0 to 1, of the densities of the mean geodesic distances of a found mesh and the
    /// true one.
    ///
    /// # Errors
    /// When the found mesh has no triangles.
    pub fn divergence(&self, found: &TriMesh) -> Result<f64, NoSurface> {
        let found = MeanDistances::new(found, &self.rule, &self.id, "points of the found surface")?;
        Ok(divergence(&found, &self.truth))
    }
}

/// Geodesic distances of all vertices of a mesh from one of them [m], by shortest paths over nodes along its edges: at most a percent
/// too long. Infinite where no path leads.
///
/// # Errors
/// When the mesh has no triangles.
///
/// # Panics
/// When there is no such vertex.
pub fn geodesic_distances(mesh: &TriMesh, from: u32) -> Result<Vec<f64>, NoSurface> {
    let graph = SurfaceGraph::new(mesh)?;
    let mut search = Search::default();
    let start = Point3::from(mesh.vertices[from as usize].map(f64::from));
    graph.search(graph.triangles[from as usize].iter().map(|triangle| (*triangle as usize, start)), &mut search);
    search.distances.truncate(mesh.vertices.len());
    Ok(search.distances)
}

/// Mean geodesic distances of points of a surface, and the width of their kernels [m].
struct MeanDistances {
    means: Vec<f64>,
    width: f64,
}

impl MeanDistances {
    fn new(mesh: &TriMesh, rule: &SurfaceRule, id: &[u8], name: &str) -> Result<Self, NoSurface> {
        let graph = SurfaceGraph::new(mesh)?;
        let points = surface_points(mesh, rule.samples, &mut Stream::of_job(rule.seed, id, name));
        let (mut sums, mut weights) = (vec![0.0; points.len()], vec![0.0; points.len()]);
        let mut search = Search::default();
        for (source, weight) in sources(mesh, &points, graph.longest_side) {
            let source = &points[source];
            graph.search([(source.triangle, source.position)], &mut search);
            for (point, (sum, all)) in points.iter().zip(sums.iter_mut().zip(&mut weights)) {
                let distance = graph.distance(&search, source, point);
                if distance.is_finite() {
                    *sum += weight * distance;
                    *all += weight;
                }
            }
        }
        let reached = sums.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0);
        let means: Vec<f64> = reached.map(|(sum, weight)| sum / weight).collect();
        // The width that is best for a normal density, by the median of the deviations (Hamza and Krim 2003).
        let middle = median(&means);
        let deviations: Vec<f64> = means.iter().map(|mean| (mean - middle).abs()).collect();
        let best = libm::pow(243.0 / (70.0 * PI.sqrt() * means.len() as f64), 0.2) * median(&deviations);
        Ok(Self { width: best.max(SMALLEST_WIDTH * graph.longest_side), means })
    }

    /// Shares of the means by the steps of a line, each spread by its kernel.
    fn shares(&self, start: f64, step: f64, count: usize) -> Vec<f64> {
        let mut shares = vec![0.0; count];
        let reach = WIDTHS_BEYOND * self.width;
        for mean in &self.means {
            let first = ((mean - reach - start) / step).max(0.0) as usize;
            let last = (((mean + reach - start) / step) as usize).min(count - 1);
            for (index, share) in shares.iter_mut().enumerate().take(last + 1).skip(first) {
                let off = (start + index as f64 * step - mean) / self.width;
                *share += libm::exp(-0.5 * off * off);
            }
        }
        let all: f64 = shares.iter().sum();
        shares.iter().map(|share| share / all).collect()
    }
}

/// Indices of points that represent a surface, each with the number of points that it represents: spread out, the farthest first,
/// then moved to the middle of these points.
fn sources(mesh: &TriMesh, points: &[SurfacePoint], longest_side: f64) -> Vec<(usize, f64)> {
    let placed: Vec<Vector6<f64>> = (points.iter())
        .map(|point| {
            let [a, b, c] = mesh.corners(point.triangle);
            let normal = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default();
            let (position, normal) = (point.position.coords, normal * (0.5 * OPPOSITE * longest_side));
            Vector6::new(position.x, position.y, position.z, normal.x, normal.y, normal.z)
        })
        .collect();
    let nearest_to = |point: &Vector6<f64>, among: &mut dyn Iterator<Item = usize>| {
        let distance = |index: usize| (placed[index] - point).norm_squared();
        among.map(|index| (distance(index), index)).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, index)| index)
    };
    let mut chosen = vec![0];
    let mut apart = vec![f64::INFINITY; placed.len()];
    while chosen.len() < placed.len().min(SOURCES) {
        let last = placed[chosen[chosen.len() - 1]];
        apart.iter_mut().zip(&placed).for_each(|(apart, point)| *apart = apart.min((point - last).norm_squared()));
        chosen.push((0..placed.len()).fold(0, |best, index| if apart[index] > apart[best] { index } else { best }));
    }
    let mut stands_for: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for round in 0..=ROUNDS {
        stands_for.clear();
        for (index, point) in placed.iter().enumerate() {
            stands_for.entry(nearest_to(point, &mut chosen.iter().copied())).or_default().push(index);
        }
        if round < ROUNDS {
            let middle = |members: &Vec<usize>| {
                let mean = members.iter().map(|index| placed[*index]).sum::<Vector6<f64>>() / members.len() as f64;
                nearest_to(&mean, &mut members.iter().copied())
            };
            chosen = stands_for.values().map(middle).collect();
        }
    }
    stands_for.into_iter().map(|(source, members)| (source, members.len() as f64)).collect()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.len() / 2;
    if sorted.len() % 2 == 1 { sorted[middle] } else { f64::midpoint(sorted[middle - 1], sorted[middle]) }
}

/// Jensen-Shannon divergence, base 2.
fn divergence(one: &MeanDistances, other: &MeanDistances) -> f64 {
    let step = one.width.min(other.width) / STEPS_PER_WIDTH;
    let beyond = WIDTHS_BEYOND * one.width.max(other.width);
    let all = || one.means.iter().chain(&other.means);
    let start = all().fold(f64::INFINITY, |low, mean| low.min(*mean)) - beyond;
    let end = all().fold(f64::NEG_INFINITY, |high, mean| high.max(*mean)) + beyond;
    let count = ((end - start) / step).ceil() as usize + 1;
    let [p, q] = [one, other].map(|means| means.shares(start, step, count));
    let term = |share: f64, middle: f64| if share > 0.0 { share * libm::log2(share / middle) } else { 0.0 };
    let terms = p.iter().zip(&q).map(|(p, q)| {
        let middle = f64::midpoint(*p, *q);
        f64::midpoint(term(*p, middle), term(*q, middle))
    });
    terms.sum::<f64>().max(0.0)
}

/// Nodes on a mesh's edges, joined within its triangles.
struct SurfaceGraph {
    nodes: Vec<Point3<f64>>,
    /// Nodes around each triangle.
    around: Vec<Vec<u32>>,
    /// Triangles of each node.
    triangles: Vec<Vec<u32>>,
    longest_side: f64,
}

/// Distances of all nodes from one point [m], infinite where no path leads.
#[derive(Default)]
struct Search {
    distances: Vec<f64>,
    waiting: BinaryHeap<Waiting>,
}

/// A node that is reached, the nearest first.
#[derive(PartialEq)]
struct Waiting {
    distance: f64,
    node: u32,
}

impl Eq for Waiting {}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.node.cmp(&self.node))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl SurfaceGraph {
    /// The graph of a mesh whose triangles share vertices where they are joined.
    ///
    /// # Errors
    /// When it has no triangles.
    fn new(mesh: &TriMesh) -> Result<Self, NoSurface> {
        let bounds = mesh.aabb().filter(|_| !mesh.triangles.is_empty());
        let Some(bounds) = bounds else {
            let (triangles, vertices) = (mesh.triangles.len(), mesh.vertices.len());
            return Err(NoSurface { triangles, vertices, reason: "it has no surface".to_owned() });
        };
        let longest_side = bounds.longest_side();
        let mut nodes: Vec<Point3<f64>> =
            mesh.vertices.iter().map(|vertex| Point3::from(vertex.map(f64::from))).collect();
        let ends = |[a, b, c]: [u32; 3]| [(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to)));
        let mut edges: Vec<(u32, u32)> = mesh.triangles.iter().flat_map(|triangle| ends(*triangle)).collect();
        edges.sort_unstable();
        edges.dedup();
        // Nodes along each edge, evenly.
        let mut along = Vec::with_capacity(edges.len());
        for (from, to) in &edges {
            let [from, to] = [from, to].map(|vertex| nodes[*vertex as usize]);
            let between = (((to - from).norm() / (SPACING * longest_side)).ceil() as usize).saturating_sub(1);
            let first = nodes.len() as u32;
            let parts = between.max(PER_EDGE) + 1;
            nodes.extend((1..parts).map(|part| from + (to - from) * (part as f64 / parts as f64)));
            along.push(first..nodes.len() as u32);
        }
        let mut triangles = vec![Vec::new(); nodes.len()];
        let mut around = Vec::with_capacity(mesh.triangles.len());
        for (index, corners) in mesh.triangles.iter().enumerate() {
            let sides = ends(*corners).map(|edge| edges.binary_search(&edge).expect("each edge is listed"));
            let of_triangle: Vec<u32> =
                corners.iter().copied().chain(sides.into_iter().flat_map(|side| along[side].clone())).collect();
            of_triangle.iter().for_each(|node| triangles[*node as usize].push(index as u32));
            around.push(of_triangle);
        }
        Ok(Self { nodes, around, triangles, longest_side })
    }

    /// Distances of all nodes from a point, given with each triangle that it lies in (Dijkstra 1959).
    fn search(&self, starts: impl IntoIterator<Item = (usize, Point3<f64>)>, search: &mut Search) {
        let Search { distances, waiting } = search;
        distances.clear();
        distances.resize(self.nodes.len(), f64::INFINITY);
        let mut reach = |node: u32, distance: f64, waiting: &mut BinaryHeap<Waiting>| {
            if distance < distances[node as usize] {
                distances[node as usize] = distance;
                waiting.push(Waiting { distance, node });
            }
        };
        for (triangle, start) in starts {
            for node in &self.around[triangle] {
                reach(*node, (self.nodes[*node as usize] - start).norm(), waiting);
            }
        }
        let mut settled = vec![false; self.nodes.len()];
        while let Some(Waiting { distance, node }) = waiting.pop() {
            if std::mem::replace(&mut settled[node as usize], true) {
                continue;
            }
            let from = self.nodes[node as usize];
            for triangle in &self.triangles[node as usize] {
                for next in &self.around[*triangle as usize] {
                    if !settled[*next as usize] {
                        reach(*next, distance + (self.nodes[*next as usize] - from).norm(), waiting);
                    }
                }
            }
        }
    }

    /// Distance of a point from the source of a search [m]; infinite where no path leads.
    fn distance(&self, search: &Search, source: &SurfacePoint, point: &SurfacePoint) -> f64 {
        if point.triangle == source.triangle {
            return (point.position - source.position).norm();
        }
        let over = |node: &u32| search.distances[*node as usize] + (self.nodes[*node as usize] - point.position).norm();
        self.around[point.triangle].iter().map(over).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use kernel::geom::TriMesh;
    use nalgebra::{Rotation3, Vector3};

    use super::*;
    use crate::{mesh_overlap::tests::ball, surfaces::tests::cuboid};

    const RULE: SurfaceRule = SurfaceRule { samples: 1500, seed: 0 };

    /// A ring of a round section, about z.
    fn torus(large: f64, small: f64, around: u32, along: u32) -> TriMesh {
        let angle = |index: u32, count: u32| 2.0 * PI * f64::from(index % count) / f64::from(count);
        let vertex = |i: u32, j: u32| {
            let ((st, ct), (sp, cp)) = (libm::sincos(angle(i, around)), libm::sincos(angle(j, along)));
            let from_axis = large + small * cp;
            [from_axis * ct, from_axis * st, small * sp].map(|value| value as f32)
        };
        let at = |i: u32, j: u32| (i % around) * along + j % along;
        let pairs = || (0..around).flat_map(|i| (0..along).map(move |j| (i, j)));
        let quad = |(i, j)| {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[corners[0], corners[1], corners[2]], [corners[0], corners[2], corners[3]]]
        };
        TriMesh { vertices: pairs().map(|(i, j)| vertex(i, j)).collect(), triangles: pairs().flat_map(quad).collect() }
    }

    #[test]
    fn distances_on_a_cube_and_a_ball_have_their_closed_forms() {
        let found = geodesic_distances(&cuboid([0.0; 3], [1.0; 3]), 0).expect("a surface");
        // Over two faces to the opposite corner, over one face across, and along an edge.
        for (corner, wanted) in [(7, 5.0_f64.sqrt()), (3, 2.0_f64.sqrt()), (1, 1.0)] {
            assert!((found[corner] / wanted - 1.0).abs() < 2e-3, "{corner}: {} is not {wanted}", found[corner]);
        }
        let ball = ball([0.0; 3], 1.0);
        let found = geodesic_distances(&ball, 0).expect("a surface");
        for (vertex, distance) in ball.vertices.iter().zip(&found) {
            let wanted = f64::from(vertex[2]).clamp(-1.0, 1.0).acos();
            assert!((distance - wanted).abs() < 0.01 * wanted + 1e-3, "{distance} is not {wanted}");
        }
    }

    #[test]
    fn a_mesh_is_like_itself_however_it_is_cut_and_turned() {
        let shapes = [cuboid([0.0; 3], [0.1, 0.08, 0.06]), ball([0.0; 3], 0.05), torus(0.05, 0.02, 24, 12)];
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), 0.7);
        for (index, mesh) in shapes.iter().enumerate() {
            let truth = TrueGeodesics::new(mesh, RULE, b"shape").expect("a surface");
            // Each triangle in four, and turned.
            let mut copy = TriMesh::default();
            for triangle in 0..mesh.triangles.len() {
                let [a, b, c] = mesh.corners(triangle);
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| nalgebra::center(&p, &q));
                for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
                    copy.triangles.push([0, 1, 2].map(|corner| copy.vertices.len() as u32 + corner));
                    let place = |point: Point3<f64>| <[f32; 3]>::from((turn * point).coords.map(|value| value as f32));
                    copy.vertices.extend(corners.map(place));
                }
            }
            let copy = joined(copy);
            let (floor, found) = (truth.floor(), truth.divergence(&copy).expect("a surface"));
            assert!(floor <= 0.03 && found <= 0.03, "{index}: {floor} for itself, {found} for its copy");
        }
        // What is cut through or joined in another way is told apart.
        let truth = TrueGeodesics::new(&shapes[2], RULE, b"shape").expect("a surface");
        let found = truth.divergence(&shapes[0]).expect("a surface");
        assert!(found > 0.2, "{found}");
        assert_eq!(found, truth.divergence(&shapes[0]).expect("a surface"));
    }

    /// Two balls far apart: each has its own distances, as if the other were not there.
    #[test]
    fn parts_that_nothing_joins_are_measured_alone() {
        let one = ball([0.0; 3], 0.05);
        let mut two = one.clone();
        let other = ball([1.0, 0.0, 0.0], 0.05);
        let first = two.vertices.len() as u32;
        two.vertices.extend(other.vertices);
        two.triangles.extend(other.triangles.iter().map(|corners| corners.map(|corner| first + corner)));
        let distances = geodesic_distances(&two, 0).expect("a surface");
        assert!(distances[first as usize..].iter().all(|distance| distance.is_infinite()));
        assert!(distances[..first as usize].iter().all(|distance| *distance < 0.17));
        let found = MeanDistances::new(&two, &RULE, b"two", "points").expect("a surface");
        assert!(found.means.iter().all(|mean| (mean / (0.05 * PI / 2.0) - 1.0).abs() < 0.05));
        assert!(TrueGeodesics::new(&TriMesh::default(), RULE, b"none").is_err());
    }

    /// A mesh with vertices at the same position merged.
    fn joined(mesh: TriMesh) -> TriMesh {
        let key = |vertex: &[f32; 3]| vertex.map(|part| (f64::from(part) * 1e6).round() as i64);
        let mut known = std::collections::BTreeMap::new();
        let mut vertices = Vec::new();
        let index: Vec<u32> = mesh
            .vertices
            .iter()
            .map(|vertex| {
                *known.entry(key(vertex)).or_insert_with(|| {
                    vertices.push(*vertex);
                    vertices.len() as u32 - 1
                })
            })
            .collect();
        let triangles = mesh.triangles.iter().map(|corners| corners.map(|corner| index[corner as usize])).collect();
        TriMesh { vertices, triangles }
    }
}
