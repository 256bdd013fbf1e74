//! Balls around pieces of a surface, coarse to fine, sixteen at a time.

use std::ops::Range;

use nalgebra::{Point3, Vector3};

use super::{
    parts::{Bounds, around, part_size, parted},
    triangle::{self, Triangle, bounds_of, squared_distance},
};

/// Sides of the pieces [m]: a share of the mesh's longest side between these, but never under [`DEEPEST`].
const LEAF_SIDES: [f64; 2] = [0.003, 0.01];
const LEAF_SHARE: f64 = 1.0 / 48.0;
/// Smallest side of a piece as a share of the longest side: bounds the number of pieces, and the memory of a search.
const DEEPEST: f64 = 1.0 / 256.0;
/// Balls of a block: the lanes of a kernel.
pub(super) const LANES: usize = 16;
/// Blocks that a search has to remember at most. A mesh passes fewer than 16^5 cubes of a 256th, and every level of the
/// tree leaves no more than fifteen to be visited later.
pub(super) const MAX_OPEN: usize = 5 * LANES;

/// A tree of blocks over the cubes that the surface passes.
#[derive(Clone, Debug)]
pub(super) struct SurfaceTree {
    /// The first is the root; empty only of an empty surface.
    pub blocks: Vec<Block>,
    pub leaves: Vec<Leaf>,
    /// Around everything: centre and radius [m].
    pub ball: (Point3<f64>, f64),
    /// Triangles of the leaves.
    lists: Vec<u32>,
}

/// Balls side by side. A lane without one has a radius far below 0.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Block {
    pub centres: [[f32; LANES]; 3],
    pub radii: [f32; LANES],
    /// Content of each ball.
    pub below: [Below; LANES],
    pub count: usize,
}

/// Content of a ball: a block of smaller ones, or a piece of the surface; by index.
#[derive(Clone, Copy, Debug)]
pub(super) enum Below {
    Block(u32),
    Leaf(u32),
}

/// A ball that holds all of the surface inside one cube.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    pub centre: Point3<f64>,
    pub radius: f64,
    triangles: Range<u32>,
}

#[derive(Clone, Copy)]
struct Cube {
    centre: Point3<f64>,
    half: f64,
}

/// A cube with surface: what of it lies in the mesh's box, and the triangles that reach into it.
struct Piece {
    bounds: Bounds,
    triangles: Vec<u32>,
}

impl SurfaceTree {
    pub fn new(triangles: &[Triangle]) -> Self {
        let bounds = bounds_of(triangles);
        let longest = (bounds.high - bounds.low).amax();
        Self::with_pieces(triangles, (longest * LEAF_SHARE).clamp(LEAF_SIDES[0], LEAF_SIDES[1]))
    }

    /// With pieces of this side [m], unless that is too small a share of the mesh's longest side.
    pub fn with_pieces(triangles: &[Triangle], piece: f64) -> Self {
        let bounds = bounds_of(triangles);
        let longest = (bounds.high - bounds.low).amax();
        let leaf = piece.max(longest * DEEPEST);
        let (centre, radius) = bounds.ball();
        let cube = Cube { centre, half: 0.5 * longest + 1e-6 };
        let all: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut pieces = Vec::new();
        cut(triangles, bounds, cube, &all, 0.5 * leaf, &mut pieces);
        let mut tree =
            Self { blocks: Vec::new(), leaves: Vec::new(), ball: (centre, radius + 1e-6), lists: Vec::new() };
        if !pieces.is_empty() {
            tree.hang(&mut pieces);
        }
        tree
    }

    /// Makes a block over pieces, with all that hangs below; its index.
    fn hang(&mut self, pieces: &mut [Piece]) -> u32 {
        let index = self.blocks.len();
        self.blocks.push(Block::empty());
        let bounds_of = |piece: &Piece| piece.bounds;
        let size = part_size(pieces.len(), LANES);
        for (lane, pieces) in parted(pieces, size, &bounds_of).into_iter().enumerate() {
            let bounds = around(pieces, &bounds_of);
            let (centre, half_diagonal) = bounds.ball();
            let reaches = pieces.iter().map(|piece| {
                let (other, radius) = piece.bounds.ball();
                (other - centre).norm() + radius
            });
            let radius = reaches.fold(0.0, f64::max).min(half_diagonal);
            let below = match pieces {
                [piece] => Below::Leaf(self.leaf(piece, centre, radius)),
                _ => Below::Block(self.hang(pieces)),
            };
            self.blocks[index].put(lane, &centre, radius, below);
        }
        index as u32
    }

    fn leaf(&mut self, piece: &Piece, centre: Point3<f64>, radius: f64) -> u32 {
        let first = self.lists.len() as u32;
        self.lists.extend_from_slice(&piece.triangles);
        self.leaves.push(Leaf { centre, radius, triangles: first..self.lists.len() as u32 });
        self.leaves.len() as u32 - 1
    }

    /// The triangles that reach into a leaf.
    pub fn triangles(&self, leaf: &Leaf) -> &[u32] {
        &self.lists[leaf.triangles.start as usize..leaf.triangles.end as usize]
    }
}

impl Block {
    fn empty() -> Self {
        Self { centres: [[0.0; LANES]; 3], radii: [-1e30; LANES], below: [Below::Leaf(0); LANES], count: 0 }
    }

    /// Blocks of balls alone, sixteen per block.
    pub fn of_balls(balls: &[(Point3<f64>, f64)]) -> Vec<Self> {
        let block = |balls: &[(Point3<f64>, f64)]| {
            let mut block = Self::empty();
            let all = balls.iter().enumerate();
            all.for_each(|(lane, (centre, radius))| block.put(lane, centre, *radius, Below::Leaf(0)));
            block
        };
        balls.chunks(LANES).map(block).collect()
    }

    fn put(&mut self, lane: usize, centre: &Point3<f64>, radius: f64, below: Below) {
        (0..3).for_each(|axis| self.centres[axis][lane] = centre[axis] as f32);
        self.radii[lane] = radius as f32;
        self.below[lane] = below;
        self.count = lane + 1;
    }

    /// The lanes that hold a ball, a bit each.
    pub fn held(&self) -> u32 {
        (1 << self.count) - 1
    }

    /// A ball's centre, rounded [m].
    pub fn centre(&self, lane: usize) -> Point3<f64> {
        Point3::from([0, 1, 2].map(|axis| f64::from(self.centres[axis][lane])))
    }
}

/// Cuts a cube into the pieces of the surface that it holds; only what lies in the mesh's box counts.
fn cut(triangles: &[Triangle], mesh: Bounds, cube: Cube, near: &[u32], leaf: f64, pieces: &mut Vec<Piece>) {
    let half = 0.5 * cube.half;
    for octant in 0..8u8 {
        let side = |axis: u8| if octant >> axis & 1 == 0 { -half } else { half };
        let part = Cube { centre: cube.centre + Vector3::new(side(0), side(1), side(2)), half };
        let whole = Bounds { low: part.centre - Vector3::repeat(half), high: part.centre + Vector3::repeat(half) };
        if !mesh.meets(&whole) {
            continue;
        }
        let bounds = mesh.shared(&whole);
        let (centre, radius) = bounds.ball();
        let inside = |index: &&u32| {
            let triangle = &triangles[**index as usize];
            triangle::bounds(triangle).meets(&whole) && squared_distance(&centre, triangle) <= radius * radius
        };
        let near: Vec<u32> = near.iter().filter(inside).copied().collect();
        if near.is_empty() {
            continue;
        }
        if half <= leaf {
            pieces.push(Piece { bounds, triangles: near });
        } else {
            cut(triangles, mesh, part, &near, leaf, pieces);
        }
    }
}
