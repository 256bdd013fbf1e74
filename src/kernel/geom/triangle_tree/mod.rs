//! A tree of boxes, four children a node and four triangles a leaf: the triangle next to a point, those that a ray meets, whether
//! a box meets any.
//!
//! Plain arrays hold four numbers at a time, which the compiler vectorises; every operation is exact by IEEE 754, so an
//! answer is a function of the mesh and the query on every machine.

mod boxes;
mod nearest;
mod rays;

pub use boxes::BoxCluster;
pub use rays::Ray;

use super::TriMesh;

/// Children of a node and triangles of a leaf.
const WIDTH: usize = 4;
/// Marks a child that is a leaf.
const LEAF: u32 = 1 << 31;
/// No child.
const NONE: u32 = u32::MAX;

/// Triangles, ordered by their position.
pub struct TriangleTree {
    /// Indices of the mesh's triangles, in the order of the leaves.
    order: Vec<u32>,
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

/// Four triangles, by coordinate; the last repeats in unused lanes.
struct Leaf {
    corners: [[[f32; WIDTH]; 3]; 3],
    /// Index of the first in the order of the leaves.
    first: u32,
    count: u32,
}

impl TriangleTree {
    /// Builds the tree.
    pub fn new(mesh: &TriMesh) -> Self {
        let mut order: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let mut builder = Builder {
            mesh,
            centroids: (0..mesh.triangles.len())
                .map(|t| {
                    mesh.corners(t).iter().fold([0.0; 3], |sum, p| std::array::from_fn(|axis| sum[axis] + p[axis]))
                })
                .collect(),
            tree: Self { order: Vec::new(), nodes: Vec::new(), leaves: Vec::new(), root: NONE },
        };
        if !order.is_empty() {
            builder.tree.root = builder.add(&mut order, 0).0;
        }
        Self { order, ..builder.tree }
    }

    /// Indices of the mesh's triangles, in the order of the tree's leaves.
    pub fn order(&self) -> &[u32] {
        &self.order
    }
}

struct Builder<'a> {
    mesh: &'a TriMesh,
    /// Three times the centre of each triangle.
    centroids: Vec<[f64; 3]>,
    tree: TriangleTree,
}

/// Lower and upper ends along each axis.
type Ends = [[f32; 3]; 2];

/// The box of nothing.
const NOWHERE: Ends = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];

/// The box, reaching from at least `low` to at least `high` along an axis.
fn widened(mut ends: Ends, axis: usize, [low, high]: [f32; 2]) -> Ends {
    ends[0][axis] = if low < ends[0][axis] { low } else { ends[0][axis] };
    ends[1][axis] = if high > ends[1][axis] { high } else { ends[1][axis] };
    ends
}

impl Builder<'_> {
    /// Adds the triangles in `order`, whose first has index `first`; also returns their box.
    fn add(&mut self, order: &mut [u32], first: u32) -> (u32, Ends) {
        // Leaf: up to four triangles; empty lanes repeat the last one.
        if order.len() <= WIDTH {
            let triangle = |lane: usize| self.mesh.triangles[order[lane.min(order.len() - 1)] as usize];
            let corners: [[[f32; WIDTH]; 3]; 3] = std::array::from_fn(|i| {
                std::array::from_fn(|axis| {
                    std::array::from_fn(|lane| self.mesh.vertices[triangle(lane)[i] as usize][axis])
                })
            });
            self.tree.leaves.push(Leaf { corners, first, count: order.len() as u32 });
            let mut ends = NOWHERE;
            for (axis, value) in
                corners.iter().flat_map(|corner| (0..3).flat_map(|axis| corner[axis].map(|v| (axis, v))))
            {
                ends = widened(ends, axis, [value; 2]);
            }
            return ((self.tree.leaves.len() - 1) as u32 | LEAF, ends);
        }
        // Node: two splits make up to four children.
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
        let (mut start, mut all) = (first, NOWHERE);
        for (lane, part) in parts.into_iter().enumerate().filter(|(_, part)| !part.is_empty()) {
            let count = part.len() as u32;
            let (child, [low, high]) = self.add(part, start);
            let node = &mut self.tree.nodes[node];
            node.children[lane] = child;
            for axis in 0..3 {
                (node.min[axis][lane], node.max[axis][lane]) = (low[axis], high[axis]);
                all = widened(all, axis, [low[axis], high[axis]]);
            }
            start += count;
        }
        (node as u32, all)
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
