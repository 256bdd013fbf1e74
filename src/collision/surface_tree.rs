//! Balls around pieces of a surface, coarse to fine.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::triangle::{Triangle, bounds_of, squared_distance};

/// Sides of the smallest pieces [m]: a share of the mesh's longest side between these, but never under [`DEEPEST`].
const LEAF_SIDES: [f64; 2] = [0.005, 0.02];
const LEAF_SHARE: f64 = 1.0 / 24.0;
/// Least side of a piece as a share of the longest side: bounds the tree's depth, and with it what a search must remember.
const DEEPEST: f64 = 1.0 / 256.0;

/// An octree over the cubes that the surface passes.
#[derive(Clone, Debug)]
pub(super) struct SurfaceTree {
    pub nodes: Vec<Node>,
    /// Triangles of the leaves.
    lists: Vec<u32>,
}

/// A ball that holds all of the surface inside one cube.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub centre: Point3<f64>,
    pub radius: f64,
    /// The smaller balls inside; empty for a leaf.
    pub children: Range<u32>,
    triangles: Range<u32>,
}

#[derive(Clone, Copy)]
struct MeshBox {
    low: Point3<f64>,
    high: Point3<f64>,
}

#[derive(Clone, Copy)]
struct Cube {
    centre: Point3<f64>,
    half: f64,
}

impl SurfaceTree {
    pub fn new(triangles: &[Triangle]) -> Self {
        let (low, high) = bounds_of(triangles);
        let longest = (high - low).amax();
        let half = 0.5 * longest + 1e-6;
        let leaf = (longest * LEAF_SHARE).clamp(LEAF_SIDES[0], LEAF_SIDES[1]).max(longest * DEEPEST);
        let mut tree = Self { nodes: Vec::new(), lists: Vec::new() };
        let centre = nalgebra::center(&low, &high);
        tree.nodes.push(Node { centre, radius: 0.5 * (high - low).norm() + 1e-6, children: 0..0, triangles: 0..0 });
        let all: Vec<u32> = (0..triangles.len() as u32).collect();
        tree.split(triangles, 0, MeshBox { low, high }, Cube { centre, half }, &all, 0.5 * leaf);
        tree
    }

    /// Splits the cube of a node; of each part only what lies in the mesh's box (low, high) counts.
    fn split(&mut self, triangles: &[Triangle], node: usize, mesh_box: MeshBox, cube: Cube, near: &[u32], leaf: f64) {
        if cube.half <= leaf {
            let first = self.lists.len() as u32;
            self.lists.extend_from_slice(near);
            self.nodes[node].triangles = first..self.lists.len() as u32;
            return;
        }
        let half = 0.5 * cube.half;
        let mut parts = Vec::new();
        for octant in 0..8u8 {
            let side = |axis: u8| if octant >> axis & 1 == 0 { -half } else { half };
            let part = Cube { centre: cube.centre + Vector3::new(side(0), side(1), side(2)), half };
            let low = mesh_box.low.sup(&(part.centre - Vector3::repeat(half)));
            let high = mesh_box.high.inf(&(part.centre + Vector3::repeat(half)));
            let (centre, radius) = (nalgebra::center(&low, &high), 0.5 * (high - low).norm() + 1e-9);
            let squared = radius * radius;
            let inside = |place: &&u32| squared_distance(&centre, &triangles[**place as usize]) <= squared;
            let near: Vec<u32> = near.iter().filter(inside).copied().collect();
            if (0..3).all(|axis| low[axis] <= high[axis]) && !near.is_empty() {
                parts.push((part, Node { centre, radius, children: 0..0, triangles: 0..0 }, near));
            }
        }
        let first = self.nodes.len();
        self.nodes[node].children = first as u32..(first + parts.len()) as u32;
        self.nodes.extend(parts.iter().map(|(_, node, _)| node.clone()));
        for (child, (part, _, near)) in (first..).zip(parts) {
            self.split(triangles, child, mesh_box, part, &near, leaf);
        }
    }

    /// The triangles that reach into a leaf.
    pub fn triangles(&self, node: &Node) -> &[u32] {
        &self.lists[node.triangles.start as usize..node.triangles.end as usize]
    }
}
