//! A tree of boxes, four children a node and four triangles a leaf, that finds the triangle next to a point.
//!
//! Distances are taken in f32, four at a time in plain arrays that the compiler turns into vector code; every operation
//! is exact by IEEE 754, so the answer is a function of the mesh and the point on every machine.

use crate::geom::TriMesh;

/// Children of a node and triangles of a leaf.
const WIDTH: usize = 4;
/// Marks a child that is a leaf.
const LEAF: u32 = 1 << 31;
/// No child.
const NONE: u32 = u32::MAX;

/// Triangles by place.
pub(super) struct Tree {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    root: u32,
}

/// The boxes of up to four children; a missing one has an empty box, infinitely far away.
struct Node {
    min: [[f32; WIDTH]; 3],
    max: [[f32; WIDTH]; 3],
    children: [u32; WIDTH],
}

/// Four triangles, by coordinate; the last repeats in unused places.
struct Leaf {
    corners: [[[f32; WIDTH]; 3]; 3],
    /// Place of the first in the order of the leaves.
    first: u32,
    count: u32,
}

impl Tree {
    /// Builds the tree; also gives the order of the triangles in its leaves.
    pub(super) fn new(mesh: &TriMesh) -> (Self, Vec<u32>) {
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let mut builder = Builder {
            mesh,
            centroids: (0..mesh.triangles.len())
                .map(|t| {
                    mesh.corners(t).iter().fold([0.0; 3], |sum, p| std::array::from_fn(|axis| sum[axis] + p[axis]))
                })
                .collect(),
            tree: Self { nodes: Vec::new(), leaves: Vec::new(), root: NONE },
        };
        if !order.is_empty() {
            builder.tree.root = builder.add(&mut order, 0);
        }
        (builder.tree, order)
    }

    /// Place of the triangle nearest to `point` among those with a squared distance below `bound` [m^2], if any.
    pub(super) fn nearest(&self, point: [f32; 3], mut bound: f32) -> Option<u32> {
        let mut best = None;
        // Three waiting children a level; medians of 2^31 triangles make at most 16 levels.
        let mut waiting = [(0f32, NONE); 64];
        let mut depth = 0;
        let mut next = self.root;
        while next != NONE {
            let mut nearest = (f32::INFINITY, NONE);
            if next & LEAF != 0 {
                let leaf = &self.leaves[(next & !LEAF) as usize];
                let distances = leaf.distances(point);
                for (place, distance) in distances.iter().enumerate().take(leaf.count as usize) {
                    if *distance < bound {
                        bound = *distance;
                        best = Some(leaf.first + place as u32);
                    }
                }
            } else {
                let node = &self.nodes[next as usize];
                let distances = node.distances(point);
                for (distance, child) in distances.into_iter().zip(node.children) {
                    if distance < nearest.0 {
                        if nearest.0 < bound {
                            waiting[depth] = nearest;
                            depth += 1;
                        }
                        nearest = (distance, child);
                    } else if distance < bound {
                        waiting[depth] = (distance, child);
                        depth += 1;
                    }
                }
            }
            while nearest.0 >= bound && depth > 0 {
                depth -= 1;
                nearest = waiting[depth];
            }
            next = if nearest.0 < bound { nearest.1 } else { NONE };
        }
        best
    }
}

impl Node {
    /// Squared distance of a point to each child's box.
    fn distances(&self, point: [f32; 3]) -> [f32; WIDTH] {
        let mut sums = [0.0; WIDTH];
        for (axis, p) in point.into_iter().enumerate() {
            for (lane, sum) in sums.iter_mut().enumerate() {
                let outside = above(above(self.min[axis][lane] - p, p - self.max[axis][lane]), 0.0);
                *sum += outside * outside;
            }
        }
        sums
    }
}

/// The greater one; the second where the first is no number. One vector instruction, unlike `f32::max`.
fn above(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The lesser one; the second where the first is no number.
fn below(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

type Lanes = [f32; WIDTH];

fn lanes(f: impl Fn(usize) -> f32) -> Lanes {
    std::array::from_fn(f)
}

fn minus(a: &[Lanes; 3], b: &[Lanes; 3]) -> [Lanes; 3] {
    std::array::from_fn(|axis| lanes(|lane| a[axis][lane] - b[axis][lane]))
}

fn dot(a: &[Lanes; 3], b: &[Lanes; 3]) -> Lanes {
    lanes(|lane| a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane])
}

fn cross(a: &[Lanes; 3], b: &[Lanes; 3]) -> [Lanes; 3] {
    std::array::from_fn(|axis| {
        let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
        lanes(|lane| a[i][lane] * b[j][lane] - a[j][lane] * b[i][lane])
    })
}

impl Leaf {
    /// Squared distance of a point to each triangle: to its plane inside the prism over it, else to the nearest edge.
    fn distances(&self, point: [f32; 3]) -> Lanes {
        let point = point.map(|v| [v; WIDTH]);
        let edges: [[Lanes; 3]; 3] = std::array::from_fn(|i| minus(&self.corners[(i + 1) % 3], &self.corners[i]));
        let normal = cross(&edges[0], &edges[1]);
        let mut least = [f32::INFINITY; WIDTH];
        let mut inside = [true; WIDTH];
        let mut from_first = [[0.0; WIDTH]; 3];
        for (edge, corner) in edges.iter().zip(&self.corners) {
            let from = minus(&point, corner);
            let (along, length) = (dot(edge, &from), dot(edge, edge));
            let side = dot(&cross(&normal, edge), &from);
            // An edge without length gives no number, which `above` turns to 0: its first corner.
            let share = lanes(|lane| below(above(along[lane] / length[lane], 0.0), 1.0));
            let apart: [Lanes; 3] =
                std::array::from_fn(|axis| lanes(|lane| from[axis][lane] - edge[axis][lane] * share[lane]));
            let distance = dot(&apart, &apart);
            for lane in 0..WIDTH {
                least[lane] = below(distance[lane], least[lane]);
                inside[lane] &= side[lane] > 0.0;
            }
            from_first = from;
        }
        let (height, length) = (dot(&normal, &from_first), dot(&normal, &normal));
        lanes(|lane| if inside[lane] { height[lane] * height[lane] / length[lane] } else { least[lane] })
    }
}

struct Builder<'a> {
    mesh: &'a TriMesh,
    /// Three times the centre of each triangle.
    centroids: Vec<[f64; 3]>,
    tree: Tree,
}

impl Builder<'_> {
    /// Adds the triangles in `order`, whose first stands at place `first`.
    fn add(&mut self, order: &mut [u32], first: u32) -> u32 {
        if order.len() <= WIDTH {
            let triangle = |lane: usize| self.mesh.triangles[order[lane.min(order.len() - 1)] as usize];
            let corners = std::array::from_fn(|i| {
                std::array::from_fn(|axis| lanes(|lane| self.mesh.vertices[triangle(lane)[i] as usize][axis]))
            });
            self.tree.leaves.push(Leaf { corners, first, count: order.len() as u32 });
            return (self.tree.leaves.len() - 1) as u32 | LEAF;
        }
        let (left, right) = self.split(order);
        let parts: [&mut [u32]; WIDTH] = {
            let (a, b) = if left.len() > WIDTH { self.split(left) } else { (left, &mut [][..]) };
            let (c, d) = if right.len() > WIDTH { self.split(right) } else { (right, &mut [][..]) };
            [a, b, c, d]
        };
        let node = self.tree.nodes.len();
        self.tree.nodes.push(Node {
            min: [[f32::INFINITY; WIDTH]; 3],
            max: [[f32::NEG_INFINITY; WIDTH]; 3],
            children: [NONE; WIDTH],
        });
        let mut place = first;
        for (lane, part) in parts.into_iter().enumerate().filter(|(_, part)| !part.is_empty()) {
            for vertex in part.iter().flat_map(|t| self.mesh.triangles[*t as usize]) {
                let node = &mut self.tree.nodes[node];
                for axis in 0..3 {
                    let value = self.mesh.vertices[vertex as usize][axis];
                    node.min[axis][lane] = node.min[axis][lane].min(value);
                    node.max[axis][lane] = node.max[axis][lane].max(value);
                }
            }
            let child = self.add(part, place);
            self.tree.nodes[node].children[lane] = child;
            place += part.len() as u32;
        }
        node as u32
    }

    /// Parts the triangles near the median of the axis along which they spread widest, at a full leaf.
    fn split<'o>(&self, order: &'o mut [u32]) -> (&'o mut [u32], &'o mut [u32]) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for triangle in &*order {
            for axis in 0..3 {
                low[axis] = low[axis].min(self.centroids[*triangle as usize][axis]);
                high[axis] = high[axis].max(self.centroids[*triangle as usize][axis]);
            }
        }
        let spread = |axis: usize| high[axis] - low[axis];
        let widest = (1..3).fold(0, |best, axis| if spread(axis) > spread(best) { axis } else { best });
        let middle = (order.len() / 2).next_multiple_of(WIDTH);
        // The index breaks ties, so the tree is a function of the mesh.
        order.select_nth_unstable_by(middle, |a, b| {
            let along = |triangle: u32| self.centroids[triangle as usize][widest];
            along(*a).total_cmp(&along(*b)).then(a.cmp(b))
        });
        order.split_at_mut(middle)
    }
}
